use glam::{Vec2, Vec3};

use sabaki::graph::{EdgeId, EdgeMotion, Motion, MotionGraph, MotionStep, NodeId, Playhead};

/// Walks a graph for ever: mostly along the clips, sometimes along a transition, and back home from far away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walker {
    /// Home in the ground plane (x and z), in metres.
    pub home: Vec2,
    /// Largest distance from home, in metres.
    pub leash: f32,
    state: u64,
}

/// Number of transitions that are considered: the closest ones.
const WAYS: usize = 12;
/// Time that is looked ahead, in seconds.
const AHEAD: f32 = 1.5;
/// Percentage of nodes at which it leaves the clip although the clip goes on.
const WHIMS: u64 = 30;

impl Walker {
    /// Creates a walker. Equal seeds walk equal paths.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self {
            home: Vec2::ZERO,
            leash: 1.2,
            state: seed,
        }
    }

    /// Advances by some seconds, but at most to the next node.
    pub fn advance_to_node(&self, graph: &MotionGraph, playhead: &mut Playhead, seconds: f32) {
        playhead.frame += seconds.max(0.0) * graph.frame_rate() as f32;
        let frames = graph.edge(playhead.edge).frames as f32;
        playhead.frame = playhead.frame.min(frames);
    }

    /// Advances by some seconds.
    pub fn advance(&mut self, graph: &MotionGraph, playhead: &mut Playhead, seconds: f32) {
        playhead.frame += seconds.max(0.0) * graph.frame_rate() as f32;
        loop {
            let over = playhead.frame - graph.edge(playhead.edge).frames as f32;
            if over < 0.0 {
                return;
            }
            let next = self.choose(graph, playhead);
            *playhead = Playhead {
                edge: next,
                frame: over,
                clip_to_world: playhead.next_clip_to_world(graph),
            };
        }
    }

    fn choose(&mut self, graph: &MotionGraph, playhead: &Playhead) -> EdgeId {
        let node = playhead.next_node(graph);
        let natural = graph.natural_edge(node);
        let at_node = Playhead {
            frame: graph.edge(playhead.edge).frames as f32,
            ..*playhead
        };
        let home = self.home;
        let away = |edge: EdgeId| {
            let step = MotionStep { edge, rate: 1.0 };
            let mut motion = Motion::new(graph, at_node, &[step]);
            motion.extend(graph, AHEAD);
            let root: Vec3 = motion.root(graph, AHEAD);
            Vec2::new(root.x, root.z).distance(home)
        };
        let ahead = away(natural);
        let whim = self.random() % 100 < WHIMS;
        if ahead > self.leash {
            let ways = ways(graph, node).into_iter().map(|edge| (away(edge), edge));
            let nearest = ways.min_by(|a, b| a.0.total_cmp(&b.0));
            return match nearest {
                Some((other, edge)) if other < ahead => edge,
                _ => natural,
            };
        }
        if whim {
            let ways = ways(graph, node);
            let pick = self.random() as usize % ways.len().max(1);
            if let Some(&edge) = ways.get(pick).filter(|&&edge| away(edge) <= self.leash) {
                return edge;
            }
        }
        natural
    }

    /// A random number (splitmix64).
    fn random(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }
}

/// The edges from a node: the clip's own first, then the closest transitions.
fn ways(graph: &MotionGraph, node: NodeId) -> Vec<EdgeId> {
    let cost = |edge: &EdgeId| match graph.edge(*edge).motion {
        EdgeMotion::Clip => 0.0,
        EdgeMotion::Transition { distance, .. } => distance,
    };
    let mut ways: Vec<EdgeId> = graph.edges_from(node).collect();
    ways.sort_by(|a, b| cost(a).total_cmp(&cost(b)).then(a.0.cmp(&b.0)));
    ways.truncate(WAYS);
    ways
}
