//! Finds transitions that a body cannot do: a foot moves faster than in both clips, and faster than a person steps, or the body pushes harder
//! than it does in any clip.
//!
//! A transition may blend poses whose feet are far apart, for example a kick and a stance. The planned step between them may then be
//! faster than any step of the clips. Such transitions are left out of the graph.

use crate::anim::{Chain, Pose};
use crate::graph::build::foot_plans;
use crate::graph::build::input::GraphBuilder;
use crate::graph::motion_graph::{Edge, EdgeId, EdgeMotion, MotionGraph, Node, NodeId};
use crate::graph::push::PushTest;
use crate::graph::search::transition::Transition;
use crate::math::in_parallel;
use rustc_hash::FxHashMap;
use std::sync::OnceLock;

/// Number of samples of a frame.
const SAMPLES: u32 = 2;
/// Maximum ratio of a toe's speed to that of the faster clip.
const RATIO: f32 = 1.3;

#[derive(Clone, Debug)]
pub(crate) struct TransitionTest {
    /// Graph of the clips, with the tested transitions as its only edges.
    graph: MotionGraph,
    /// Speed of the fastest toe from each frame of each clip to the next one, in metres per second. It is computed for a clip on first use.
    clips: Vec<OnceLock<Vec<f32>>>,
    /// Speed up to which no foot is too fast, in metres per second.
    limit: f32,
    push: PushTest,
    threads: usize,
    /// Results so far, by the ends and the length of a transition.
    known: FxHashMap<([Node; 2], usize), bool>,
}

impl TransitionTest {
    /// Creates the test; `None` if the settings do not ask for it or the skeleton has no feet.
    pub(crate) fn new(input: &GraphBuilder<'_>) -> Option<Self> {
        let (settings, feet) = (input.settings, &input.feet);
        let asked = settings.fastest_step;
        let limit = asked.filter(|_| settings.keep_feet && !feet.legs.is_empty())?;
        let (skeleton, clips) = (input.source.skeleton.clone(), input.clips.clone());
        let (events, nodes, edges) = (Vec::new(), Vec::new(), Vec::new());
        let mut graph =
            MotionGraph::new(skeleton, settings.frame_rate, clips, events, nodes, edges);
        graph.feet = feet.clone();
        Some(Self {
            clips: vec![OnceLock::new(); input.clips.len()],
            graph,
            limit,
            push: PushTest::new(&input.clouds, settings.frame_rate),
            threads: settings.threads,
            known: FxHashMap::default(),
        })
    }

    /// Returns for each transition whether a body cannot do it. The result does not depend on the number of threads.
    pub(crate) fn impossible(
        &mut self,
        input: &GraphBuilder<'_>,
        transitions: &[Transition],
    ) -> Vec<bool> {
        let key = |t: &Transition| (t.ends(), t.frames);
        let is_new = |t: &&Transition| !self.known.contains_key(&key(t));
        let new: Vec<Transition> = transitions.iter().filter(is_new).copied().collect();
        if !new.is_empty() {
            let found = self.test(input, &new);
            self.known.extend(new.iter().map(key).zip(found));
        }
        transitions.iter().map(|t| self.known[&key(t)]).collect()
    }

    fn test(&mut self, input: &GraphBuilder<'_>, transitions: &[Transition]) -> Vec<bool> {
        let aligned = in_parallel(self.threads, transitions.len(), |index| {
            input.align(&transitions[index])
        });
        let graph = &mut self.graph;
        graph.nodes.clear();
        graph.edges.clear();
        for (transition, &align) in transitions.iter().zip(&aligned) {
            let from = NodeId(graph.nodes.len() as u32);
            graph.edges.push(Edge {
                from,
                to: NodeId(from.0 + 1),
                frames: transition.frames as u32,
                motion: EdgeMotion::Transition {
                    align,
                    distance: transition.distance,
                },
                event: None,
            });
            graph.nodes.extend(transition.ends());
        }
        (graph.feet.blends, graph.feet.root_drops) = foot_plans::all(graph, self.threads);
        in_parallel(self.threads, transitions.len(), |index| {
            let of_clips = self.fastest_of_clips(&transitions[index]);
            let limit = self.limit.max(RATIO * of_clips);
            self.push.is_too_hard(&transitions[index], aligned[index])
                || is_faster(&self.graph, EdgeId(index as u32), limit)
        })
    }

    /// Speed of the fastest toe of both clips in a transition.
    fn fastest_of_clips(&self, transition: &Transition) -> f32 {
        let target_start = transition.target_frame - transition.frames;
        let ends = [
            (transition.source_clip, transition.source_frame),
            (transition.target_clip, target_start),
        ];
        let speeds = ends.iter().flat_map(|&(clip, first)| {
            let speeds = self.clips[clip].get_or_init(|| clip_speeds(&self.graph, clip));
            speeds[first..].iter().take(transition.frames)
        });
        speeds.copied().fold(0.0, f32::max)
    }
}

fn is_faster(graph: &MotionGraph, edge: EdgeId, limit: f32) -> bool {
    let rate = (f64::from(SAMPLES) * graph.frame_rate) as f32;
    let mut pose = Pose::default();
    let mut before = vec![glam::Vec3::ZERO; graph.feet.legs.len()];
    for sample in 0..=graph.edge(edge).frames * SAMPLES {
        let frame = sample as f32 / SAMPLES as f32;
        graph.sample_edge(edge, frame, &mut pose);
        let chain = Chain::of(&graph.skeleton, &pose);
        for (leg, before) in graph.feet.legs.iter().zip(&mut before) {
            let toe = chain.global(leg.toe_or_foot()).translation;
            if sample > 0 && toe.distance(*before) * rate > limit {
                return true;
            }
            *before = toe;
        }
    }
    false
}

/// Speed of the fastest toe from each frame of a clip to the next one, in metres per second.
fn clip_speeds(graph: &MotionGraph, clip: usize) -> Vec<f32> {
    let rate = graph.frame_rate as f32;
    let clip = &graph.clips[clip];
    let mut pose = Pose::default();
    let mut toes = |frame: usize| -> Vec<glam::Vec3> {
        clip.pose(frame, &mut pose);
        let chain = Chain::of(&graph.skeleton, &pose);
        let legs = graph.feet.legs.iter();
        legs.map(|leg| chain.global(leg.toe_or_foot()).translation)
            .collect()
    };
    let mut before = toes(0);
    (1..clip.frames())
        .map(|frame| {
            let now = toes(frame);
            let ways = before.iter().zip(&now).map(|(a, b)| a.distance(*b) * rate);
            let fastest = ways.fold(0.0, f32::max);
            before = now;
            fastest
        })
        .collect()
}
