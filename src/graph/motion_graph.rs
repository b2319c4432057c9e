use serde::{Deserialize, Serialize};

use super::feet::Feet;
use crate::anim::{Clip, EventKind, Facing, JointId, Pose, Skeleton, forward_kinematics};
use crate::math::Rigid2;

macro_rules! index {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        pub struct $name(pub u32);

        impl $name {
            /// As a position in arrays.
            #[must_use]
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    };
}

index!(
    /// Index of a clip in [`MotionGraph::clips`].
    ClipId
);
index!(
    /// Index of a node in [`MotionGraph::nodes`].
    NodeId
);
index!(
    /// Index of an edge in [`MotionGraph::edges`].
    EdgeId
);
index!(
    /// Index of an event in [`MotionGraph::events`].
    EventId
);

/// A posture where motion can branch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Node {
    /// Whose frame it is.
    pub clip: ClipId,
    /// Frame of the clip.
    pub frame: u32,
}

/// A short piece of motion from node to node.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Edge {
    /// Where it starts.
    pub from: NodeId,
    /// Where it ends.
    pub to: NodeId,
    /// How long it is, frames; at least 1.
    pub frames: u32,
    /// What is played.
    pub motion: EdgeMotion,
    /// The event that it holds whole, if any; the edge is then that event, from its first frame to
    /// its last.
    pub event: Option<EventId>,
}

/// What an [`Edge`] plays.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum EdgeMotion {
    /// The frames of the clip between its nodes.
    Clip,
    /// A blend from the source's clip to the target's, over the edge's frames.
    Transition {
        /// Takes the target clip's space to the source clip's.
        align: Rigid2,
        /// Root of the mean squared point distance of the blended windows, metres.
        distance: f32,
    },
}

/// An event of a clip, in frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GraphEvent {
    /// Whose frames they are.
    pub clip: ClipId,
    /// What happens.
    pub kind: EventKind,
    /// First frame.
    pub first: u32,
    /// Last frame; after `first`.
    pub last: u32,
    /// The joints that take part; empty for all.
    pub joints: Vec<JointId>,
}

impl GraphEvent {
    /// In words: its clip and its seconds.
    pub(super) fn describe(&self, clips: &[Clip], frame_rate: f64) -> String {
        let seconds = |frame: u32| f64::from(frame) / frame_rate;
        format!(
            "{} {:.2}-{:.2}",
            clips[self.clip.index()].name(),
            seconds(self.first),
            seconds(self.last)
        )
    }
}

/// Clips of one skeleton and the ways between them. From every node every other can be reached.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotionGraph {
    pub(super) skeleton: Skeleton,
    pub(super) frame_rate: f64,
    pub(super) clips: Vec<Clip>,
    pub(super) events: Vec<GraphEvent>,
    pub(super) nodes: Vec<Node>,
    /// Sorted by the node that they start from.
    pub(super) edges: Vec<Edge>,
    /// For each node its first edge; one more at the end.
    pub(super) first_edge: Vec<u32>,
    pub(super) feet: Feet,
}

impl MotionGraph {
    /// The skeleton of all clips.
    #[must_use]
    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    /// Of all clips, frames per second.
    #[must_use]
    pub fn frame_rate(&self) -> f64 {
        self.frame_rate
    }

    /// All clips, those included of which no frame is in the graph.
    #[must_use]
    pub fn clips(&self) -> &[Clip] {
        &self.clips
    }

    /// The events that an edge of the graph holds.
    #[must_use]
    pub fn events(&self) -> &[GraphEvent] {
        &self.events
    }

    /// All nodes.
    #[must_use]
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// All edges, by the node that they start from.
    #[must_use]
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// One clip.
    #[must_use]
    pub fn clip(&self, id: ClipId) -> &Clip {
        &self.clips[id.index()]
    }

    /// One node.
    #[must_use]
    pub fn node(&self, id: NodeId) -> Node {
        self.nodes[id.index()]
    }

    /// One edge.
    #[must_use]
    pub fn edge(&self, id: EdgeId) -> &Edge {
        &self.edges[id.index()]
    }

    /// One event.
    #[must_use]
    pub fn event(&self, id: EventId) -> &GraphEvent {
        &self.events[id.index()]
    }

    /// The ids of all edges.
    pub fn edge_ids(&self) -> impl Iterator<Item = EdgeId> + use<> {
        (0..self.edges.len() as u32).map(EdgeId)
    }

    /// The edges that start at `node`.
    pub fn edges_from(&self, node: NodeId) -> impl Iterator<Item = EdgeId> + use<> {
        (self.first_edge[node.index()]..self.first_edge[node.index() + 1]).map(EdgeId)
    }

    /// The edges that hold an event of `kind`, with the event.
    pub fn edges_with(&self, kind: EventKind) -> impl Iterator<Item = (EdgeId, EventId)> + '_ {
        self.edge_ids().filter_map(move |id| {
            let event = self.edge(id).event?;
            (self.event(event).kind == kind).then_some((id, event))
        })
    }

    /// Seconds that an edge lasts at rate 1.
    #[must_use]
    pub fn seconds(&self, edge: EdgeId) -> f32 {
        (f64::from(self.edge(edge).frames) / self.frame_rate) as f32
    }

    /// Takes the space of the clip in which an edge ends to the space of the clip in which it
    /// starts.
    #[must_use]
    pub fn clip_change(&self, edge: EdgeId) -> Rigid2 {
        match self.edge(edge).motion {
            EdgeMotion::Clip => Rigid2::IDENTITY,
            EdgeMotion::Transition { align, .. } => align,
        }
    }

    /// The way on from a node where nothing asks for another: the clip goes on, or else the closest
    /// transition is taken.
    #[must_use]
    pub fn natural_edge(&self, node: NodeId) -> EdgeId {
        let cost = |edge: EdgeId| match self.edge(edge).motion {
            EdgeMotion::Clip => 0.0,
            EdgeMotion::Transition { distance, .. } => distance,
        };
        let first = EdgeId(self.first_edge[node.index()]);
        self.edges_from(node).fold(
            first,
            |best, edge| if cost(edge) < cost(best) { edge } else { best },
        )
    }

    /// Where the root stands on the ground and which way the body faces in a frame of a clip, in
    /// that clip's space.
    #[must_use]
    pub fn placement(&self, clip: ClipId, frame: u32) -> Rigid2 {
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        self.clip(clip).pose(frame as usize, &mut pose);
        forward_kinematics(&self.skeleton, &pose, &mut joints);
        Facing::of(&self.skeleton).placement(&joints)
    }

    /// Seconds of clips that the graph can play, transitions not counted.
    #[must_use]
    pub fn seconds_kept(&self) -> f64 {
        let frames: u64 = self
            .edges
            .iter()
            .filter(|edge| edge.motion == EdgeMotion::Clip)
            .map(|edge| u64::from(edge.frames))
            .sum();
        frames as f64 / self.frame_rate
    }

    /// How many edges are transitions.
    #[must_use]
    pub fn transitions(&self) -> usize {
        self.edges
            .iter()
            .filter(|edge| edge.motion != EdgeMotion::Clip)
            .count()
    }

    /// An event in words: its clip and its seconds.
    #[must_use]
    pub fn describe_event(&self, event: &GraphEvent) -> String {
        event.describe(&self.clips, self.frame_rate)
    }
}
