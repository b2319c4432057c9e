use std::sync::OnceLock;

use serde::{Deserialize, Serialize};

use super::events::EventCover;
use super::feet::Feet;
use super::ids::{ClipId, EdgeId, EventId, NodeId};
use crate::anim::{Chain, Clip, EventKind, Facing, JointId, Leg, Rig, Skeleton};
use crate::math::parallel::fill;
use crate::math::{Rigid2, sort_rarely};

/// A pose where motion can branch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Node {
    /// Clip of the pose.
    pub clip: ClipId,
    /// Frame of the clip.
    pub frame: u32,
}

/// A short motion from one node to another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Edge {
    /// Node at the start.
    pub from: NodeId,
    /// Node at the end.
    pub to: NodeId,
    /// Length, in frames, at least 1.
    pub frames: u32,
    /// Motion that the edge plays.
    pub motion: EdgeMotion,
    /// Event that the edge plays from its first frame to its last, if any.
    pub event: Option<EventId>,
}

/// Motion of an [`Edge`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum EdgeMotion {
    /// The frames of the clip between the edge's nodes.
    Clip,
    /// A blend from the source's clip to the target's clip over the edge's frames.
    Transition {
        /// Transform from the target clip's space to the source clip's space.
        align: Rigid2,
        /// Root of the mean squared point distance of the blended windows, in metres.
        distance: f32,
    },
}

/// An event of a clip, in frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GraphEvent {
    /// Clip of the event.
    pub clip: ClipId,
    /// Kind of the event.
    pub kind: EventKind,
    /// First frame.
    pub first: u32,
    /// Last frame, greater than `first`.
    pub last: u32,
    /// Joints that take part, or empty for all joints.
    pub joints: Vec<JointId>,
}

impl GraphEvent {
    /// Clip and seconds of the event, as text.
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

/// Clips of one skeleton and the transitions between them. Every node can be reached from every
/// other node.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotionGraph {
    pub(super) skeleton: Skeleton,
    pub(super) frame_rate: f64,
    pub(super) clips: Vec<Clip>,
    pub(super) events: Vec<GraphEvent>,
    pub(super) nodes: Vec<Node>,
    /// Edges, sorted by the node that they start from.
    pub(super) edges: Vec<Edge>,
    /// Index of each node's first edge. The last entry is the number of edges.
    pub(super) first_edge: Vec<u32>,
    pub(super) feet: Feet,
    #[serde(skip)]
    pub(super) rig: KnownRig,
}

/// The skeleton's [`Rig`], computed on first use. It is derived from the skeleton, so it is ignored by comparisons.
#[derive(Clone, Debug, Default)]
pub(super) struct KnownRig(OnceLock<Rig>);

impl PartialEq for KnownRig {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl MotionGraph {
    /// Sorts the edges and builds the index of each node's first edge.
    pub(super) fn with_index(mut self) -> Self {
        let key = |edge: &Edge| {
            let order = (edge.motion != EdgeMotion::Clip, edge.event.is_none());
            (edge.from, order, edge.to)
        };
        self.edges.sort_by_key(key);
        let nodes = self.nodes.len() as u32;
        self.first_edge = (0..=nodes)
            .map(|node| self.edges.partition_point(|edge| edge.from.0 < node) as u32)
            .collect();
        self
    }

    /// Legs, then arms, left before right. `None` is a limb that the names of the joints do not identify.
    #[must_use]
    #[doc(hidden)]
    pub fn limbs(&self) -> &[Option<Leg>; 4] {
        self.rig().limbs()
    }

    /// Trunk and limbs of the skeleton.
    #[must_use]
    pub(crate) fn rig(&self) -> &Rig {
        self.rig.0.get_or_init(|| Rig::of(&self.skeleton))
    }

    /// Skeleton of all clips.
    #[must_use]
    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    /// Frame rate of all clips, in frames per second.
    #[must_use]
    pub fn frame_rate(&self) -> f64 {
        self.frame_rate
    }

    /// All clips, including those without a frame in the graph.
    #[must_use]
    pub fn clips(&self) -> &[Clip] {
        &self.clips
    }

    /// Events that the graph's edges play.
    #[must_use]
    pub fn events(&self) -> &[GraphEvent] {
        &self.events
    }

    /// All nodes.
    #[must_use]
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// All edges, sorted by the node that they start from.
    #[must_use]
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// The clip with an id.
    #[must_use]
    pub fn clip(&self, id: ClipId) -> &Clip {
        &self.clips[id.index()]
    }

    /// The node with an id.
    #[must_use]
    pub fn node(&self, id: NodeId) -> Node {
        self.nodes[id.index()]
    }

    /// The edge with an id.
    #[must_use]
    pub fn edge(&self, id: EdgeId) -> &Edge {
        &self.edges[id.index()]
    }

    /// The event with an id.
    #[must_use]
    pub fn event(&self, id: EventId) -> &GraphEvent {
        &self.events[id.index()]
    }

    /// Ids of all edges.
    pub fn edge_ids(&self) -> impl Iterator<Item = EdgeId> + use<> {
        (0..self.edges.len() as u32).map(EdgeId)
    }

    /// Index of each node's first edge. The last entry is the number of edges.
    pub(crate) fn first_edges(&self) -> &[u32] {
        &self.first_edge
    }

    /// Edges that start at `node`.
    pub fn edges_from(&self, node: NodeId) -> impl Iterator<Item = EdgeId> + use<> {
        (self.first_edge[node.index()]..self.first_edge[node.index() + 1]).map(EdgeId)
    }

    /// Edges that play an event of `kind`, with the event.
    pub fn edges_with(&self, kind: EventKind) -> impl Iterator<Item = (EdgeId, EventId)> + '_ {
        self.edge_ids().filter_map(move |id| {
            let event = self.edge(id).event?;
            (self.event(event).kind == kind).then_some((id, event))
        })
    }

    /// Duration of an edge at rate 1, in seconds.
    #[must_use]
    pub fn seconds(&self, edge: EdgeId) -> f32 {
        (f64::from(self.edge(edge).frames) / self.frame_rate) as f32
    }

    /// Transform from the space of the clip in which an edge ends to the space of the clip in which
    /// it starts.
    #[must_use]
    pub fn clip_change(&self, edge: EdgeId) -> Rigid2 {
        match self.edge(edge).motion {
            EdgeMotion::Clip => Rigid2::IDENTITY,
            EdgeMotion::Transition { align, .. } => align,
        }
    }

    /// Default continuation at a node: the next edge of the clip, preferably one that plays an event. At the end of the clip it is the closest
    /// transition.
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

    /// Character's frame in a frame of a clip, in the clip's space: root on the ground, facing
    /// direction.
    #[must_use]
    pub fn placement(&self, clip: ClipId, frame: u32) -> Rigid2 {
        self.placement_facing(Facing::of(&self.skeleton), Node { clip, frame })
    }

    fn placement_facing(&self, facing: Facing, Node { clip, frame }: Node) -> Rigid2 {
        let moment = self.clip(clip).at(frame as f32);
        let chain = Chain {
            skeleton: &self.skeleton,
            local: |id| moment.local(&self.skeleton, id),
        };
        facing.placement_by(|joint| chain.global(joint))
    }

    /// [`MotionGraph::placement`] of each node.
    pub(crate) fn placements(&self) -> Vec<Rigid2> {
        let facing = Facing::of(&self.skeleton);
        let mut placements = vec![Rigid2::IDENTITY; self.nodes.len()];
        fill(&mut placements, |node| {
            self.placement_facing(facing, self.nodes[node])
        });
        placements
    }

    /// Edges that play a clip outside all events. Edges that play a part of an event, which exist where events overlap, do not belong to them.
    pub fn natural_edges(&self) -> impl Iterator<Item = EdgeId> + '_ {
        let cover = EventCover::new(&self.events, self.clips.len());
        self.edge_ids().filter(move |&id| {
            let edge = self.edge(id);
            let from = self.node(edge.from);
            edge.motion == EdgeMotion::Clip && !cover.plays(from.clip, from.frame)
        })
    }

    /// Duration of clips that the graph can play, without transitions, in seconds.
    #[must_use]
    pub fn seconds_kept(&self) -> f64 {
        let mut played: Vec<(ClipId, u32, u32)> = Vec::new();
        for edge in self.edges() {
            let from = self.node(edge.from);
            if edge.motion == EdgeMotion::Clip {
                played.push((from.clip, from.frame, from.frame + edge.frames));
            }
        }
        sort_rarely(&mut played, Ord::cmp);
        let (mut frames, mut end) = (0, (ClipId(0), 0));
        for (clip, first, last) in played {
            let first = if clip == end.0 {
                first.max(end.1)
            } else {
                first
            };
            frames += u64::from(last.saturating_sub(first));
            end = (clip, last.max(first));
        }
        frames as f64 / self.frame_rate
    }

    /// Number of edges that are transitions.
    #[must_use]
    pub fn transitions(&self) -> usize {
        self.edges
            .iter()
            .filter(|edge| edge.motion != EdgeMotion::Clip)
            .count()
    }

    /// Clip and seconds of an event, as text.
    #[must_use]
    pub fn describe_event(&self, event: &GraphEvent) -> String {
        event.describe(&self.clips, self.frame_rate)
    }
}
