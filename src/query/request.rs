use glam::Vec3;

use super::attack::Attack;
use super::clearance::PlacedEvasion;
use super::evaluation::Evaluation;
use super::obstacle::{NearObstacles, Obstacle};
use super::retime::Durations;
use crate::graph::{EdgeId, Motion, MotionGraph, MotionMoment, NodeId, Played, Playhead};
use crate::maps::{BakedGraph, NodePath, PathId};
use crate::math::Rigid2;

/// Input of a [`Query`](super::Query): a character, and the attack that it has to avoid.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// Position of the character in graph and world.
    pub playhead: Playhead,
    /// Attack, in the same world. Its times count from now.
    pub attack: &'a Attack,
    /// Motion that the character is playing. It is needed during a blend, a layer or a warp, so that the offset from the playhead fades out in
    /// every candidate. Default: none.
    pub playing: Option<MotionMoment<'a>>,
    /// Which candidates are tested exactly. Default: [`Evaluation::Lazy`].
    pub evaluation: Evaluation,
    /// Obstacles at their current positions, which no candidate may enter. Default: none.
    pub obstacles: &'a [Obstacle],
}

impl<'a> Request<'a> {
    /// Creates a request with lazy evaluation and without obstacles.
    #[must_use]
    pub fn new(playhead: Playhead, attack: &'a Attack) -> Self {
        Self {
            playhead,
            attack,
            playing: None,
            evaluation: Evaluation::Lazy,
            obstacles: &[],
        }
    }

    /// Creates a request for a character that is at a moment of a motion.
    #[must_use]
    pub fn of_motion(graph: &MotionGraph, playing: MotionMoment<'a>, attack: &'a Attack) -> Self {
        let playhead = playing.motion.playhead(graph, playing.seconds);
        Self {
            playing: Some(playing),
            ..Self::new(playhead, attack)
        }
    }
}

/// A request with its own copy of the attack, and the node where the motion can branch next.
#[derive(Clone, Debug)]
pub(super) struct ActiveRequest {
    pub playhead: Playhead,
    pub attack: Attack,
    /// Motion with the offset that still fades out; empty without one.
    pub blend: Motion,
    pub evaluation: Evaluation,
    pub obstacles: NearObstacles,
    /// Next node of the playhead.
    pub node: NodeId,
    /// Time until the playhead reaches the next node, in seconds.
    pub wait: f32,
    /// Time from the next node to the attack's start, in seconds.
    pub available: f32,
    /// The character's frame (root on the ground, facing +Z) at the node, in the world.
    pub node_frame: Rigid2,
    /// Attack without the margin. It is used only if there is a margin.
    pub plain: Attack,
    /// Margin by which the radii of `attack` are larger, in metres; 0 for none.
    pub margin: f32,
    /// Whether only paths to an evasion are candidates.
    pub evasions_only: bool,
}

/// Differences of a query of a plan from an ordinary query.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlanScope<'a> {
    /// Attack of the request without the margin. If no motion avoids the request's attack, one that avoids this attack is chosen.
    pub plain: &'a Attack,
    /// Margin by which the radii of the request's attack are larger, in metres.
    pub margin: f32,
    /// Whether only paths to an evasion are candidates, because an earlier query has tested the others.
    pub evasions_only: bool,
}

impl Default for ActiveRequest {
    fn default() -> Self {
        Self {
            playhead: Playhead {
                edge: EdgeId(0),
                frame: 0.0,
                clip_to_world: Rigid2::IDENTITY,
            },
            attack: Attack::empty(),
            blend: Motion::default(),
            evaluation: Evaluation::Lazy,
            obstacles: NearObstacles::default(),
            node: NodeId(0),
            wait: 0.0,
            available: 0.0,
            node_frame: Rigid2::IDENTITY,
            plain: Attack::empty(),
            margin: 0.0,
            evasions_only: false,
        }
    }
}

impl ActiveRequest {
    /// Replaces the request. The attack is copied into existing memory.
    pub(super) fn set(&mut self, baked: &BakedGraph, request: Request<'_>) {
        let graph = baked.graph();
        let playhead = request.playhead.sanitized(graph);
        self.attack.clone_from(request.attack);
        (self.margin, self.evasions_only) = (0.0, false);
        self.playhead = playhead;
        self.evaluation = request.evaluation;
        let root = graph.sample_edge_root(playhead.edge, playhead.frame);
        let middle = playhead.clip_to_world.point(root);
        self.obstacles.set(baked, request.obstacles, middle);
        self.blend.clear();
        if let Some(playing) = request.playing {
            self.set_blend(baked.graph(), playing);
        }
        self.node = playhead.next_node(graph);
        self.wait = playhead.seconds_to_next_node(graph);
        self.available = self.attack.start() - self.wait;
        self.node_frame = playhead.next_clip_to_world(graph) * baked.placement(self.node);
    }

    /// Applies the scope of a plan to the request.
    pub(super) fn limit(&mut self, scope: PlanScope<'_>) {
        self.plain.clone_from(scope.plain);
        (self.margin, self.evasions_only) = (scope.margin, scope.evasions_only);
    }

    /// Keeps the offset that fades out. A layer of the upper body or a warp becomes such an offset.
    fn set_blend(&mut self, graph: &MotionGraph, playing: MotionMoment<'_>) {
        /// Time in which a layer or a warp fades out, in seconds.
        const BENT: f32 = 0.25;
        let MotionMoment { motion, seconds } = playing;
        if !motion.is_bent(seconds) {
            self.blend.continue_blend(motion, seconds);
            return;
        }
        self.blend.restart(graph, self.playhead, []);
        let played = Played {
            motion,
            seconds,
            rate: 1.0,
        };
        self.blend.blend_from(graph, played, BENT);
    }

    /// Durations of a path's edges at rate 1.
    pub(super) fn durations(baked: &BakedGraph, path: &NodePath) -> Durations {
        let seconds = |frames: u16| (f64::from(frames) / baked.graph().frame_rate()) as f32;
        Durations {
            total: seconds(path.frames),
            faster: seconds(path.faster),
            slower: seconds(path.slower),
        }
    }

    /// The evasion at the end of a path, performed `start` seconds from now.
    pub(super) fn evasion<'a>(
        &self,
        baked: &'a BakedGraph,
        path: PathId,
        start: f32,
    ) -> PlacedEvasion<'a> {
        let path = baked.paths().path(path);
        PlacedEvasion {
            track: baked.track(path.goal as usize),
            placement: self.node_frame * path.placement,
            start,
        }
    }

    /// The root's position at the node, in the character's frame there.
    pub(super) fn root(&self, baked: &BakedGraph) -> Vec3 {
        let graph = baked.graph();
        let node = graph.node(self.node);
        let root = graph.clip(node.clip).root(node.frame as usize);
        baked.placement(self.node).inverse().point(root)
    }
}
