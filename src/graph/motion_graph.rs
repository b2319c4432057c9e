//! The motion graph: nodes, edges, clips and events, and their indices.

pub use crate::anim::ClipId;
use crate::anim::{Chain, Clip, EventKind, Facing, JointId, Knee, Leg, Pose, Rig, Skeleton};
use crate::math::{Rigid2, in_parallel};
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::sync::OnceLock;

macro_rules! index {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        pub struct $name(pub u32);

        impl $name {
            /// The index as a `usize`.
            #[must_use]
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    };
}

index!(
    /// Index of a node in [`MotionGraph::nodes`](MotionGraph::nodes).
    NodeId
);
index!(
    /// Index of an edge in [`MotionGraph::edges`](MotionGraph::edges).
    EdgeId
);
index!(
    /// Index of an event in [`MotionGraph::events`](MotionGraph::events).
    EventId
);

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

impl EdgeMotion {
    /// Distance of the blended windows, in metres; 0 for frames of a clip.
    #[must_use]
    pub fn distance(self) -> f32 {
        match self {
            Self::Clip => 0.0,
            Self::Transition { distance, .. } => distance,
        }
    }
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

/// Positions of two events of one kind that have the same frames; `None` if there are none.
pub(crate) fn twice(events: &[GraphEvent]) -> Option<[usize; 2]> {
    let key = |&index: &usize| {
        let event = &events[index];
        (event.clip, event.first, event.last, event.kind)
    };
    let mut order: Vec<usize> = (0..events.len()).collect();
    order.sort_by_key(key);
    let mut pairs = order.windows(2);
    let pair = pairs.find(|pair| key(&pair[0]) == key(&pair[1]))?;
    Some([pair[0], pair[1]])
}

impl GraphEvent {
    /// First and last frame, as places of nodes.
    pub(crate) fn ends(&self) -> [Node; 2] {
        [self.first, self.last].map(|frame| Node {
            clip: self.clip,
            frame,
        })
    }

    /// Clip and seconds of the event, as text. `leads` are the frames that were added before each clip.
    pub(crate) fn describe(&self, clips: &[Clip], leads: &[u32], frame_rate: f64) -> String {
        let lead = leads.get(self.clip.index()).copied().unwrap_or(0);
        let seconds = |frame: u32| f64::from(frame.saturating_sub(lead)) / frame_rate;
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
    pub(crate) skeleton: Skeleton,
    pub(crate) frame_rate: f64,
    pub(crate) clips: Vec<Clip>,
    pub(crate) events: Vec<GraphEvent>,
    pub(crate) nodes: Vec<Node>,
    /// Edges, sorted by the node that they start from.
    pub(crate) edges: Vec<Edge>,
    /// Index of each node's first edge. The last entry is the number of edges.
    pub(crate) first_edge: Vec<u32>,
    pub(crate) feet: Feet,
    /// Number of frames that were added before each clip; empty if none were.
    #[serde(default)]
    pub(crate) leads: Vec<u32>,
    #[serde(skip)]
    pub(crate) rig: KnownRig,
}

/// The skeleton's [`Rig`] and how its knees bend, computed on first use. They are derived from skeleton and clips, so they are ignored by
/// comparisons.
#[derive(Clone, Debug, Default)]
pub(crate) struct KnownRig {
    rig: OnceLock<Rig>,
    knees: OnceLock<Vec<Knee>>,
}

impl PartialEq for KnownRig {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl MotionGraph {
    /// A graph without data of feet. Sorts the edges and builds the index of each node's first edge.
    pub(crate) fn new(
        skeleton: Skeleton,
        frame_rate: f64,
        clips: Vec<Clip>,
        events: Vec<GraphEvent>,
        nodes: Vec<Node>,
        mut edges: Vec<Edge>,
    ) -> Self {
        edges.sort_by_key(|edge| {
            let order = (edge.motion != EdgeMotion::Clip, edge.event.is_none());
            (edge.from, order, edge.to)
        });
        let first_edge = (0..=nodes.len() as u32)
            .map(|node| edges.partition_point(|edge| edge.from.0 < node) as u32)
            .collect();
        Self {
            skeleton,
            frame_rate,
            clips,
            events,
            nodes,
            edges,
            first_edge,
            feet: Feet::default(),
            leads: Vec::new(),
            rig: KnownRig::default(),
        }
    }

    /// Legs of the skeleton, and where their feet are planted in the clips.
    pub fn feet(&self) -> &Feet {
        &self.feet
    }

    /// Legs, then arms, left before right. `None` is a limb that the names of the joints do not identify.
    pub fn limbs(&self) -> &[Option<Leg>; 4] {
        self.rig().limbs()
    }

    pub(crate) fn rig(&self) -> &Rig {
        self.rig.rig.get_or_init(|| {
            let mut rig = Rig::of(&self.skeleton);
            for (leg, &knee) in self.feet.legs.iter().zip(self.knees()) {
                rig.set_knee(leg.hip, knee);
            }
            rig
        })
    }

    /// How the knee of each leg bends. Only a toe tells where a straight one bends to; without it the clips do.
    pub(crate) fn knees(&self) -> &[Knee] {
        self.rig.knees.get_or_init(|| {
            let knee = |leg: &Leg| match leg.toe {
                Some(_) => Knee::InPlane,
                None => Knee::Forward(self.knee_hinge(leg)),
            };
            self.feet.legs.iter().map(knee).collect()
        })
    }

    /// Axis about which a knee bends in the clips, in the hip's frame, as from [`Leg::knee_hinge`]; zero if it hardly does.
    fn knee_hinge(&self, leg: &Leg) -> Vec3 {
        /// About so many frames are looked at, and at most each of so many.
        const FRAMES: usize = 1024;
        const EVERY: usize = 4;
        /// Mean sine of the flexion from which on the axis is known.
        const BENT: f32 = 0.1;
        let frames: usize = self.clips.iter().map(Clip::frames).sum();
        let every = (frames / FRAMES).max(EVERY);
        let (mut sum, mut count, mut pose) = (Vec3::ZERO, 0.0, Pose::default());
        for clip in &self.clips {
            for frame in (0..clip.frames()).step_by(every) {
                clip.pose(frame, &mut pose);
                sum += leg.knee_hinge(&self.skeleton, &pose);
                count += 1.0;
            }
        }
        match sum.length() > BENT * count {
            true => sum.normalize(),
            false => Vec3::ZERO,
        }
    }

    /// Skeleton of all clips.
    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    /// Frame rate of all clips, in frames per second.
    pub fn frame_rate(&self) -> f64 {
        self.frame_rate
    }

    /// All clips, including those without a frame in the graph.
    pub fn clips(&self) -> &[Clip] {
        &self.clips
    }

    /// Frames of a clip, by its index, that it came with: without those that join it to the graph.
    pub fn own_frames(&self, clip: usize) -> Range<usize> {
        let lead = self.leads.get(clip).map_or(0, |&lead| lead as usize);
        lead..self.clips[clip].frames().saturating_sub(lead)
    }

    /// Events that the graph's edges play.
    pub fn events(&self) -> &[GraphEvent] {
        &self.events
    }

    /// All nodes.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// All edges, sorted by the node that they start from.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// The clip with an id.
    pub fn clip(&self, id: ClipId) -> &Clip {
        &self.clips[id.index()]
    }

    /// The node with an id.
    pub fn node(&self, id: NodeId) -> Node {
        self.nodes[id.index()]
    }

    /// The edge with an id.
    pub fn edge(&self, id: EdgeId) -> &Edge {
        &self.edges[id.index()]
    }

    /// The event with an id.
    pub fn event(&self, id: EventId) -> &GraphEvent {
        &self.events[id.index()]
    }

    /// Ids of all edges.
    pub fn edge_ids(&self) -> impl Iterator<Item = EdgeId> + use<> {
        (0..self.edges.len() as u32).map(EdgeId)
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
    pub fn seconds(&self, edge: EdgeId) -> f32 {
        (f64::from(self.edge(edge).frames) / self.frame_rate) as f32
    }

    /// Transform from the space of the clip in which an edge ends to the space of the clip in which
    /// it starts.
    pub fn clip_change(&self, edge: EdgeId) -> Rigid2 {
        match self.edge(edge).motion {
            EdgeMotion::Clip => Rigid2::IDENTITY,
            EdgeMotion::Transition { align, .. } => align,
        }
    }

    /// Default continuation at a node: the next edge of the clip, preferably one that plays an event. At the end of the clip it is the closest
    /// transition.
    pub fn natural_edge(&self, node: NodeId) -> EdgeId {
        let cost = |edge: EdgeId| self.edge(edge).motion.distance();
        let first = EdgeId(self.first_edge[node.index()]);
        let closest = |best, edge| if cost(edge) < cost(best) { edge } else { best };
        self.edges_from(node).fold(first, closest)
    }

    /// Character's frame in a frame of a clip, in the clip's space: root on the ground, facing
    /// direction.
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
        in_parallel(0, self.nodes.len(), |node| {
            self.placement_facing(facing, self.nodes[node])
        })
    }

    /// Edges that play a clip outside all events. Edges that play a part of an event, which exist where events overlap, do not belong to them.
    pub fn natural_edges(&self) -> impl Iterator<Item = EdgeId> + '_ {
        // For each clip, the starts of its events in ascending order. With each start stands the latest end of this event and those before it.
        let mut cover = vec![Vec::new(); self.clips.len()];
        for event in &self.events {
            cover[event.clip.index()].push((event.first, event.last));
        }
        for ends in &mut cover {
            ends.sort();
            let mut latest = 0;
            for (_, last) in ends {
                latest = latest.max(*last);
                *last = latest;
            }
        }
        self.edge_ids().filter(move |&id| {
            let edge = self.edge(id);
            let Node { clip, frame } = self.node(edge.from);
            let ends = &cover[clip.index()];
            let begun = ends.partition_point(|&(first, _)| first <= frame);
            let is_in_event = begun > 0 && ends[begun - 1].1 > frame;
            edge.motion == EdgeMotion::Clip && !is_in_event
        })
    }

    /// Duration of clips that the graph can play, without transitions, in seconds.
    pub fn seconds_kept(&self) -> f64 {
        let mut played: Vec<(ClipId, u32, u32)> = Vec::new();
        for edge in self.edges() {
            let from = self.node(edge.from);
            if edge.motion == EdgeMotion::Clip {
                played.push((from.clip, from.frame, from.frame + edge.frames));
            }
        }
        played.sort();
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
    pub fn transitions(&self) -> usize {
        self.edges
            .iter()
            .filter(|edge| edge.motion != EdgeMotion::Clip)
            .count()
    }

    /// Clip and seconds of an event, as text.
    pub fn describe_event(&self, event: &GraphEvent) -> String {
        event.describe(&self.clips, &self.leads, self.frame_rate)
    }
}

/// The first number of each of several consecutive ranges of these lengths. The last entry is the end of all.
pub(crate) fn starts(lengths: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut starts = vec![0];
    for length in lengths {
        starts.push(starts[starts.len() - 1] + length);
    }
    starts
}

/// Numbers in groups, each in the order in which they came.
pub(crate) struct Grouped {
    values: Vec<u32>,
    /// Index of each group's first value. The last entry is the number of values.
    first: Vec<u32>,
}

impl Grouped {
    /// Sorts numbers, each with the index of its group, into `groups` groups.
    pub(crate) fn new(groups: usize, all: impl Iterator<Item = (usize, u32)> + Clone) -> Self {
        let mut first = vec![0; groups + 1];
        for (group, _) in all.clone() {
            first[group + 1] += 1;
        }
        for group in 0..groups {
            first[group + 1] += first[group];
        }
        let mut next = first.clone();
        let mut values = vec![0; first[groups] as usize];
        for (group, value) in all {
            values[next[group] as usize] = value;
            next[group] += 1;
        }
        Self { values, first }
    }

    pub(crate) fn group(&self, group: usize) -> &[u32] {
        let first = &self.first[group..];
        &self.values[first[0] as usize..first[1] as usize]
    }
}

// Foot plants: finds the frames in which feet are planted, and keeps planted feet from sliding in
// transitions.
//
// Source: the task and its parts are those of Kovar, Schreiner & Gleicher, "Footskate Cleanup for
// Motion Capture Editing" (2002), and of Ikemoto, Arikan & Forsyth, "Knowing When to Put Your Foot
// Down" (2006). Differs: the clips are not changed; their feet stay as captured. A transition
// blends each foot with its own weights ([`LegBlend`]): only the source while the foot is planted
// in the source, only the target once it is planted in the target, and a step through the air
// between them. The remaining foot slide is that of the captures.

/// Range of frames of a clip in which a foot is planted, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Plant {
    /// First frame.
    pub first: u32,
    /// Last frame.
    pub last: u32,
}

impl Plant {
    fn holds(self, frame: u32) -> bool {
        (self.first..=self.last).contains(&frame)
    }
}

/// Legs of a graph's skeleton, their plants in the clips and their blends in the transitions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Feet {
    pub(crate) legs: Vec<Leg>,
    /// Plants, `[clip][leg]`, in order of time.
    pub(crate) plants: Vec<Vec<Plant>>,
    /// Blends, `[edge][leg]`. Empty if feet are not kept planted.
    pub(crate) blends: Vec<Option<LegBlend>>,
    /// Maximum lowering of the root on each edge that keeps feet within reach, in metres. Empty if
    /// feet are not kept planted.
    #[serde(rename = "sinks")]
    pub(crate) root_drops: Vec<f32>,
}

impl Feet {
    /// Legs of the skeleton. Empty if the joints' names do not identify feet.
    pub fn legs(&self) -> &[Leg] {
        &self.legs
    }

    /// Plants of a leg's foot in a clip.
    pub fn plants(&self, clip: ClipId, leg: usize) -> &[Plant] {
        &self.plants[clip.index() * self.legs.len() + leg]
    }

    /// Blend of a leg's foot on an edge, or `None` if the edge is not a transition or the foot is
    /// planted neither before nor after it.
    pub(crate) fn blend(&self, edge: EdgeId, leg: usize) -> Option<LegBlend> {
        let legs = self.legs.len();
        *self.blends.get(edge.index() * legs + leg)?
    }

    /// Maximum lowering of the root on an edge, in metres.
    pub fn max_root_drop(&self, edge: EdgeId) -> f32 {
        self.root_drops.get(edge.index()).copied().unwrap_or(0.0)
    }

    /// Whether the foot of a leg stands in a frame of a clip.
    pub(crate) fn stands(&self, clip: ClipId, leg: usize, frame: u32) -> bool {
        self.stands_for(clip, leg, frame) > 0
    }

    /// Number of frames for which the foot of a leg stands from a frame of a clip on, 0 if it does not.
    pub(crate) fn stands_for(&self, clip: ClipId, leg: usize, frame: u32) -> u32 {
        let plants = self.plants(clip, leg);
        let next = plants.partition_point(|plant| plant.last < frame);
        let plant = plants.get(next).filter(|plant| plant.holds(frame));
        plant.map_or(0, |plant| plant.last + 1 - frame)
    }
}

/// Blend of one foot in a transition. The foot follows the source until it leaves, the target from
/// when it lands, and a blend of both in between.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LegBlend {
    /// Time when the foot leaves the source's motion, in frames since the transition's start.
    pub leave: f32,
    /// Time when the foot reaches the target's motion, in frames since the transition's start. It
    /// is later than `leave`.
    pub land: f32,
    /// Height of the step, in metres. It is above 0 if the foot would otherwise slide along the
    /// ground.
    pub lift: f32,
}

impl LegBlend {
    /// Weight of the target, and height to add to the blend, in metres.
    pub(crate) fn at(self, frame: f32) -> (f32, f32) {
        let s = ((frame - self.leave) / (self.land - self.leave)).clamp(0.0, 1.0);
        // A foot that is in the air anyway uses a quintic. A lifted foot uses a higher degree, so
        // that it hardly moves horizontally while it is low. Both start slowly enough that a
        // straight knee, whose angle grows with the square root of the foot's displacement, does
        // not start with a jerk.
        let weight = if self.lift > 0.0 {
            s.powi(4) * (35.0 + s * (-84.0 + s * (70.0 - 20.0 * s)))
        } else {
            s.powi(3) * (10.0 + s * (-15.0 + 6.0 * s))
        };
        let arc = 4.0 * s * (1.0 - s);
        (weight, self.lift * arc * arc * arc)
    }

    pub(crate) fn is_sound(self, frames: u32, furthest: f32) -> bool {
        (0.0..=frames as f32).contains(&self.leave)
            && self.land > self.leave
            && self.land <= frames as f32
            && (0.0..=furthest).contains(&self.lift)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anim::{Bend, KneeLimit};
    use crate::query::fixture::baked;

    #[test]
    fn a_straight_leg_without_a_toe_bends_as_its_knee_does_in_the_clips() {
        let mut graph = baked().graph().clone();
        graph.rig = KnownRig::default();
        graph.feet.legs.iter_mut().for_each(|leg| leg.toe = None);
        let rig = graph.rig();
        for (limb, leg) in graph.feet.legs.iter().enumerate() {
            let mut pose = Pose::default();
            graph.clip(ClipId(0)).pose(0, &mut pose);
            let bends = |pose: &Pose| leg.knee_hinge(&graph.skeleton, pose);
            let bent = bends(&pose);
            let Knee::Forward(hinge) = graph.knees()[limb] else {
                panic!("the clips tell nothing");
            };
            assert!(bent.dot(hinge) > 0.9 * bent.length());
            // A little to the wrong side: all that a plane could tell is rounding.
            let straight = KneeLimit {
                hinge: -bent.normalize(),
                flexion: 0.002,
            };
            leg.limit_knee(&graph.skeleton, &mut pose, straight);
            assert!(bends(&pose).dot(bent) < 0.0);
            let mut bend = Bend::default();
            bend.ends[limb] = Vec3::Y * 0.1;
            bend.apply(graph.rigged_skeleton(), 1.0, &mut pose);
            let now = bends(&pose);
            assert!(now.length() > 0.3, "{now}");
            assert!(now.dot(bent) > 0.8 * now.length() * bent.length(), "{now}");
            assert_ne!(rig.knee(limb), Knee::InPlane);
        }
    }
}
