//! Assembles nodes and edges from clips, events and transitions.
//!
//! Each event is one edge. Where events overlap, additional edges play the parts between their ends.

use rustc_hash::FxHashSet;

use super::feet::{Aligner, DartKey, FootPlans};
use super::{
    ClipId, Edge, EdgeMotion, EventId, Feet, GraphEvent, MotionGraph, Node, NodeId, Transition,
};
use crate::anim::{Clip, Skeleton};
use crate::math::in_parallel;

/// Data from which the graph is assembled.
pub(super) struct Parts<'a> {
    pub(super) skeleton: &'a Skeleton,
    pub(super) clips: Vec<Clip>,
    pub(super) events: Vec<GraphEvent>,
    pub(super) aligner: Aligner<'a>,
    pub(super) transitions: &'a [Transition],
    /// Known plans of how transitions move their feet.
    pub(super) plans: &'a FootPlans,
    pub(super) frame_rate: f64,
    pub(super) threads: usize,
}

impl Parts<'_> {
    /// Assembles all nodes and edges, including those that the largest component leaves out.
    pub(super) fn assemble(self) -> MotionGraph {
        let nodes = self.nodes();
        let mut edges: Vec<Edge> = self.event_edges(&nodes).collect();
        let of_events: FxHashSet<(NodeId, NodeId)> =
            edges.iter().map(|edge| (edge.from, edge.to)).collect();
        let of_clips = nodes.windows(2).zip(0..).filter_map(|(pair, index)| {
            let ends = (NodeId(index), NodeId(index + 1));
            let is_new = pair[0].clip == pair[1].clip && !of_events.contains(&ends);
            is_new.then(|| clip_edge(&nodes, ends.0, ends.1))
        });
        edges.extend(of_clips);
        edges.extend(in_parallel(self.threads, self.transitions.len(), |index| {
            self.blend(&self.transitions[index], &nodes)
        }));
        MotionGraph {
            skeleton: self.skeleton.clone(),
            frame_rate: self.frame_rate,
            clips: self.clips,
            events: self.events,
            nodes,
            edges,
            first_edge: Vec::new(),
            feet: Feet::default(),
            rig: super::motion_graph::KnownRig::default(),
        }
        .with_index()
    }

    /// Nodes at the ends of clips, events and transitions, sorted.
    fn nodes(&self) -> Vec<Node> {
        let mut places = Vec::new();
        for (index, clip) in self.clips.iter().enumerate() {
            places.extend([node(index, 0), node(index, clip.frames() - 1)]);
        }
        for event in &self.events {
            places.extend([event.first, event.last].map(|frame| Node {
                clip: event.clip,
                frame,
            }));
        }
        for t in self.transitions {
            places.extend([
                node(t.source_clip, t.source_frame),
                node(t.target_clip, t.target_frame),
            ]);
        }
        places.sort_unstable();
        places.dedup();
        places
    }

    /// The edges of events that have motion.
    fn event_edges<'a>(&'a self, nodes: &'a [Node]) -> impl Iterator<Item = Edge> + 'a {
        let playable = self.events.iter().zip(0..);
        let playable = playable.filter(|(event, _)| event.first < event.last);
        playable.map(|(event, index)| {
            let ends = [event.first, event.last].map(|frame| Node {
                clip: event.clip,
                frame,
            });
            let [from, to] = ends.map(|end| node_id(nodes, end));
            Edge {
                event: Some(EventId(index)),
                ..clip_edge(nodes, from, to)
            }
        })
    }

    fn blend(&self, t: &Transition, nodes: &[Node]) -> Edge {
        let align = match self.plans.get(&DartKey::of(t)) {
            Some(plan) => plan.root.align,
            None => self.aligner.align(t),
        };
        Edge {
            from: node_id(nodes, node(t.source_clip, t.source_frame)),
            to: node_id(nodes, node(t.target_clip, t.target_frame)),
            frames: t.frames as u32,
            motion: EdgeMotion::Transition {
                align,
                distance: t.distance,
            },
            event: None,
        }
    }
}

/// Edge that plays the clip between two of its nodes, without an event.
fn clip_edge(nodes: &[Node], from: NodeId, to: NodeId) -> Edge {
    Edge {
        from,
        to,
        frames: nodes[to.index()].frame - nodes[from.index()].frame,
        motion: EdgeMotion::Clip,
        event: None,
    }
}

fn node_id(nodes: &[Node], place: Node) -> NodeId {
    NodeId(nodes.partition_point(|other| *other < place) as u32)
}

fn node(clip: usize, frame: usize) -> Node {
    Node {
        clip: ClipId(clip as u32),
        frame: frame as u32,
    }
}
