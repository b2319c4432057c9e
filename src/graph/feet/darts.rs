//! Finds transitions in which a foot darts: it moves faster than in both clips, and faster than a person steps.
//!
//! A transition may blend poses whose feet are far apart, for example a kick and a stance. The planned step between them may then be
//! faster than any step of the clips. Such transitions are left out of the graph.

use super::plan;
use crate::anim::{Chain, Clip, Pose, Skeleton};
use crate::graph::motion_graph::KnownRig;
use crate::graph::{
    ClipId, Edge, EdgeId, EdgeMotion, Feet, GraphSettings, MotionGraph, Node, NodeId, Transition,
};
use crate::math::Rigid2;

/// Number of samples of a frame.
const SAMPLES: u32 = 2;
/// Maximum ratio of a toe's speed to that of the faster clip.
const RATIO: f32 = 1.3;

/// Test of single transitions, with its scratch.
#[derive(Clone, Debug)]
pub(in crate::graph) struct DartTest {
    /// Graph of the clips, with the tested transition as its only edge.
    graph: MotionGraph,
    /// Speed of the fastest toe from each frame of each clip to the next one, in metres per second.
    clips: Vec<Vec<f32>>,
    /// Speed up to which no foot darts, in metres per second.
    limit: f32,
    pose: Pose,
}

impl DartTest {
    /// Creates the test; `None` if the settings do not ask for it or the skeleton has no feet. `feet` has the plants of the clips.
    pub(in crate::graph) fn new(
        (skeleton, clips, feet): (&Skeleton, &[Clip], &Feet),
        settings: &GraphSettings,
    ) -> Option<Self> {
        let asked = settings.feet.fastest_step;
        let limit = asked.filter(|_| settings.feet.keep && !feet.legs.is_empty())?;
        let graph = MotionGraph {
            skeleton: skeleton.clone(),
            frame_rate: settings.frame_rate,
            clips: clips.to_vec(),
            events: Vec::new(),
            nodes: Vec::new(),
            edges: Vec::new(),
            first_edge: Vec::new(),
            feet: feet.clone(),
            rig: KnownRig::default(),
        };
        let mut test = Self {
            clips: Vec::new(),
            graph,
            limit,
            pose: Pose::default(),
        };
        test.clips = (0..clips.len())
            .map(|clip| test.clip_speeds(clip))
            .collect();
        Some(test)
    }

    /// Whether a foot darts in a transition, whose target is aligned by `align`.
    pub(in crate::graph) fn darts(&mut self, transition: &Transition, align: Rigid2) -> bool {
        let ends = [
            (transition.source_clip, transition.source_frame),
            (transition.target_clip, transition.target_frame),
        ];
        self.graph.nodes.clear();
        self.graph.nodes.extend(ends.map(|(clip, frame)| Node {
            clip: ClipId(clip as u32),
            frame: frame as u32,
        }));
        self.graph.edges.clear();
        self.graph.edges.push(Edge {
            from: NodeId(0),
            to: NodeId(1),
            frames: transition.frames as u32,
            motion: EdgeMotion::Transition {
                align,
                distance: transition.distance,
            },
            event: None,
        });
        (self.graph.feet.blends, self.graph.feet.root_drops) = plan::all(&self.graph);
        let firsts = [
            transition.source_frame,
            transition.target_frame - transition.frames,
        ];
        let of_clips = [0, 1].map(|side| {
            let speeds = &self.clips[ends[side].0][firsts[side]..];
            let speeds = speeds.iter().take(transition.frames).copied();
            speeds.fold(0.0, f32::max)
        });
        let limit = self.limit.max(RATIO * of_clips[0].max(of_clips[1]));
        self.is_faster(transition.frames as u32, limit)
    }

    /// Whether a toe is faster than the limit on the only edge.
    fn is_faster(&mut self, frames: u32, limit: f32) -> bool {
        let rate = (f64::from(SAMPLES) * self.graph.frame_rate) as f32;
        let legs = self.graph.feet.legs.len();
        let mut before = vec![glam::Vec3::ZERO; legs];
        for sample in 0..=frames * SAMPLES {
            let frame = sample as f32 / SAMPLES as f32;
            self.graph.sample_edge(EdgeId(0), frame, &mut self.pose);
            let chain = Chain::of(&self.graph.skeleton, &self.pose);
            for (leg, before) in self.graph.feet.legs.iter().zip(&mut before) {
                let toe = chain.global(leg.toe_or_foot()).translation;
                if sample > 0 && toe.distance(*before) * rate > limit {
                    return true;
                }
                *before = toe;
            }
        }
        false
    }

    fn clip_speeds(&mut self, clip: usize) -> Vec<f32> {
        let rate = self.graph.frame_rate as f32;
        let graph = &self.graph;
        let mut toes = |frame: usize| -> Vec<glam::Vec3> {
            graph.clips[clip].pose(frame, &mut self.pose);
            let chain = Chain::of(&graph.skeleton, &self.pose);
            let legs = graph.feet.legs.iter();
            legs.map(|leg| chain.global(leg.toe_or_foot()).translation)
                .collect()
        };
        let mut before = toes(0);
        (1..self.graph.clips[clip].frames())
            .map(|frame| {
                let now = toes(frame);
                let ways = before.iter().zip(&now).map(|(a, b)| a.distance(*b) * rate);
                let fastest = ways.fold(0.0, f32::max);
                before = now;
                fastest
            })
            .collect()
    }
}
