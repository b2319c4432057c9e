use crate::anim::{Facing, Pose, forward_kinematics};
use crate::graph::motion_graph::{EdgeId, MotionGraph, NodeId};
use crate::math::Rigid2;
use serde::{Deserialize, Serialize};

/// Distance from the origin beyond which a transform is replaced by the identity, in metres.
const NOWHERE: f32 = 1e7;

/// A character's position in the graph and in the world.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Playhead {
    /// Edge that is playing.
    pub edge: EdgeId,
    /// Time since the edge's start, in frames.
    pub frame: f32,
    /// Transform from the space of the clip in which the edge starts to the world.
    pub clip_to_world: Rigid2,
}

impl Playhead {
    /// Playhead at a frame of an edge, with the character's frame (root on the ground, facing) at
    /// `world`.
    #[must_use]
    pub fn at(graph: &MotionGraph, edge: EdgeId, frame: f32, world: Rigid2) -> Self {
        let start = Self {
            edge,
            frame,
            clip_to_world: Rigid2::IDENTITY,
        };
        Self {
            clip_to_world: world * start.placement(graph).inverse(),
            ..start
        }
    }

    /// Whether the graph has this edge and frame and the transform is finite and leads no further
    /// than 10,000 km. It checks playheads that come from a file.
    pub fn is_sound(&self, graph: &MotionGraph) -> bool {
        let edge = graph.edges().get(self.edge.index());
        edge.is_some_and(|edge| (0.0..=edge.frames as f32).contains(&self.frame))
            && self.clip_to_world.is_sound(NOWHERE)
    }

    /// Returns a valid playhead: this one if the graph has its edge and frame. Otherwise the frame
    /// is clamped to the edge, and the transform is the identity if it is not finite or more than
    /// 10,000 km from the origin. Queries and motions use this for invalid input.
    ///
    /// # Panics
    /// Panics if the graph has no such edge, for example because the playhead belongs to another
    /// graph.
    #[must_use]
    pub fn sanitized(self, graph: &MotionGraph) -> Self {
        let last = graph.edge(self.edge).frames as f32;
        let sound = self.clip_to_world.is_sound(NOWHERE);
        Self {
            edge: self.edge,
            // `f32::max` turns NaN into 0.
            frame: self.frame.max(0.0).min(last),
            clip_to_world: match sound {
                true => self.clip_to_world,
                false => Rigid2::IDENTITY,
            },
        }
    }

    /// Writes the pose in the world to `out`.
    pub fn pose(&self, graph: &MotionGraph, out: &mut Pose) {
        graph.sample_edge(self.edge, self.frame, out);
        out.place(self.clip_to_world);
    }

    /// Character's frame in the world: root on the ground, facing direction.
    pub fn placement(&self, graph: &MotionGraph) -> Rigid2 {
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        self.pose(graph, &mut pose);
        forward_kinematics(graph.skeleton(), &pose, &mut joints);
        Facing::of(graph.skeleton()).placement(&joints)
    }

    /// Node at the edge's end.
    pub fn next_node(&self, graph: &MotionGraph) -> NodeId {
        graph.edge(self.edge).to
    }

    /// Time until the next node at rate 1, in seconds.
    pub fn seconds_to_next_node(&self, graph: &MotionGraph) -> f32 {
        (graph.edge(self.edge).frames as f32 - self.frame) / graph.frame_rate() as f32
    }

    /// Transform from the space of the clip in which the edge ends to the world.
    pub fn next_clip_to_world(&self, graph: &MotionGraph) -> Rigid2 {
        self.clip_to_world * graph.clip_change(self.edge)
    }
}

/// One edge of a path, with its playback rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionStep {
    /// Edge to play.
    pub edge: EdgeId,
    /// Playback rate, above 0. At rate 2 the edge plays twice as fast.
    pub rate: f32,
}
