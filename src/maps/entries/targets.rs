//! Frames of the clips that can be entered.

use crate::graph::{ClipId, EdgeId, EdgeMotion, MotionGraph, Node, Playhead};
use crate::math::{Rigid2, sort_rarely};

/// A frame of a clip, and the edge that plays it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ClipFrame {
    pub(super) clip: ClipId,
    pub(super) frame: u32,
    pub(super) edge: EdgeId,
    /// Position of the frame on the edge, in frames.
    pub(super) edge_frame: u32,
}

impl ClipFrame {
    pub(super) fn of(graph: &MotionGraph, edge: EdgeId, edge_frame: u32) -> Self {
        let from = graph.node(graph.edge(edge).from);
        Self {
            clip: from.clip,
            frame: from.frame + edge_frame,
            edge,
            edge_frame,
        }
    }

    /// The playhead at the frame, in the space of the clip.
    pub(super) fn playhead(&self) -> Playhead {
        Playhead {
            edge: self.edge,
            frame: self.edge_frame as f32,
            clip_to_world: Rigid2::IDENTITY,
        }
    }

    /// Clip and frame as a [`Node`].
    pub(super) fn node(&self) -> Node {
        Node {
            clip: self.clip,
            frame: self.frame,
        }
    }
}

/// The edges that play the frames of each clip.
pub(super) struct ClipPlaces {
    /// For each clip, first frame, end and edge of all edges that play it, in order.
    edges: Vec<Vec<(u32, u32, EdgeId)>>,
}

impl ClipPlaces {
    pub(super) fn new(graph: &MotionGraph) -> Self {
        let mut edges = vec![Vec::new(); graph.clips().len()];
        for id in graph.edge_ids() {
            let edge = graph.edge(id);
            if edge.motion == EdgeMotion::Clip {
                let from = graph.node(edge.from);
                edges[from.clip.index()].push((from.frame, from.frame + edge.frames, id));
            }
        }
        edges
            .iter_mut()
            .for_each(|list| sort_rarely(list, Ord::cmp));
        Self { edges }
    }

    /// First frame, end and edge of all edges that play a clip, in order.
    pub(super) fn of(&self, clip: ClipId) -> &[(u32, u32, EdgeId)] {
        &self.edges[clip.index()]
    }

    /// Finds the edge that plays a frame.
    pub(super) fn find(&self, at: Node) -> Option<ClipFrame> {
        let Node { clip, frame } = at;
        let list = &self.edges[clip.index()];
        let after = list.partition_point(|&(first, _, _)| first <= frame);
        let &(first, end, edge) = list.get(after.checked_sub(1)?)?;
        (frame < end).then_some(ClipFrame {
            clip,
            frame,
            edge,
            edge_frame: frame - first,
        })
    }
}

/// Frames of natural motion, in order: no event begins within [`BEFORE_EVENTS`] after them.
pub(super) fn natural(graph: &MotionGraph, step: u32) -> Vec<ClipFrame> {
    let before_events = (BEFORE_EVENTS * graph.frame_rate()).round() as u32;
    let mut free: Vec<Vec<bool>> = graph
        .clips()
        .iter()
        .map(|clip| vec![true; clip.frames()])
        .collect();
    for event in graph.events() {
        let first = event.first.saturating_sub(before_events) as usize;
        free[event.clip.index()][first..=event.last as usize].fill(false);
    }
    let mut step = step.max(1);
    loop {
        let frames: Vec<ClipFrame> = graph
            .edge_ids()
            .filter(|&id| graph.edge(id).motion == EdgeMotion::Clip)
            .flat_map(|id| (0..graph.edge(id).frames).map(move |at| ClipFrame::of(graph, id, at)))
            .filter(|at| at.frame % step == 0 && free[at.clip.index()][at.frame as usize])
            .collect();
        if frames.len() <= MOST_NATURAL {
            return frames;
        }
        step += 1;
    }
}

/// Time without an event after a frame that an exit leads to, in seconds.
const BEFORE_EVENTS: f64 = 0.5;
/// Maximum number of frames that exits lead to.
const MOST_NATURAL: usize = 4096;
