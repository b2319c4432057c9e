//! Frames of the clips that can be entered.

use crate::graph::{ClipId, EdgeId, EdgeMotion, MotionGraph, Node, Playhead};
use crate::maps::entries::table::{EntryTarget, ExitTarget};
use crate::maps::regions::Evasion;
use crate::math::Rigid2;

/// A frame of a clip, and the edge that plays it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ClipFrame {
    pub(crate) clip: ClipId,
    pub(crate) frame: u32,
    pub(crate) edge: EdgeId,
    /// Position of the frame on the edge, in frames.
    pub(crate) edge_frame: u32,
}

impl ClipFrame {
    pub(crate) fn new(graph: &MotionGraph, edge: EdgeId, edge_frame: u32) -> Self {
        let from = graph.node(graph.edge(edge).from);
        Self {
            clip: from.clip,
            frame: from.frame + edge_frame,
            edge,
            edge_frame,
        }
    }

    /// The playhead at the frame, in the space of the clip.
    pub(crate) fn playhead(&self) -> Playhead {
        Playhead {
            edge: self.edge,
            frame: self.edge_frame as f32,
            clip_to_world: Rigid2::IDENTITY,
        }
    }

    pub(crate) fn node(&self) -> Node {
        Node {
            clip: self.clip,
            frame: self.frame,
        }
    }
}

impl From<&ClipFrame> for ExitTarget {
    fn from(at: &ClipFrame) -> Self {
        Self {
            edge: at.edge,
            edge_frame: at.edge_frame,
        }
    }
}

/// The edges that play the frames of each clip.
pub(crate) struct ClipPlaces {
    /// For each clip, first frame, end and edge of all edges that play it, in order.
    edges: Vec<Vec<(u32, u32, EdgeId)>>,
}

impl ClipPlaces {
    pub(crate) fn new(graph: &MotionGraph) -> Self {
        let mut edges = vec![Vec::new(); graph.clips().len()];
        for id in graph.edge_ids() {
            let edge = graph.edge(id);
            if edge.motion == EdgeMotion::Clip {
                let from = graph.node(edge.from);
                edges[from.clip.index()].push((from.frame, from.frame + edge.frames, id));
            }
        }
        edges.iter_mut().for_each(|list| list.sort());
        Self { edges }
    }

    /// First frame, end and edge of all edges that play a clip, in order.
    pub(crate) fn edges(&self, clip: ClipId) -> &[(u32, u32, EdgeId)] {
        &self.edges[clip.index()]
    }

    /// Finds the edge that plays a frame.
    pub(crate) fn find(&self, at: Node) -> Option<ClipFrame> {
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

/// Interval of the frames that can be entered, of an evasion or of natural motion, in frames. It grows if there would be too many.
const STEP: u32 = 2;
/// Longest time before its start at which an evasion can be entered, in seconds.
const LEAD_IN: f32 = 0.4;
/// Longest time after its start at which an evasion can be entered, in seconds.
const LATE: f32 = 1.2;
/// Maximum number of frames of evasions that can be entered, or one for each evasion.
const MOST_TARGETS: usize = 256;
/// Time without an event after a frame that an exit leads to, in seconds.
const BEFORE_EVENTS: f64 = 0.5;
/// Maximum number of frames that exits lead to.
const MOST_NATURAL: usize = 4096;

/// Frames of natural motion, in order: no event begins within [`BEFORE_EVENTS`] after them.
pub(crate) fn natural(graph: &MotionGraph) -> Vec<ClipFrame> {
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
    let mut step = STEP;
    loop {
        let frames: Vec<ClipFrame> = graph
            .edge_ids()
            .filter(|&id| graph.edge(id).motion == EdgeMotion::Clip)
            .flat_map(|id| (0..graph.edge(id).frames).map(move |at| ClipFrame::new(graph, id, at)))
            .filter(|at| at.frame % step == 0 && free[at.clip.index()][at.frame as usize])
            .collect();
        if frames.len() <= MOST_NATURAL {
            return frames;
        }
        step += 1;
    }
}

/// Frames of evasions and their lead-ins, sorted by evasion and frame.
pub(crate) fn targets(
    graph: &MotionGraph,
    places: &ClipPlaces,
    evasions: &[Evasion],
) -> Vec<EntryTarget> {
    let mut step = STEP;
    loop {
        let targets = targets_at_steps(graph, places, evasions, step);
        if targets.len() <= MOST_TARGETS.max(evasions.len()) {
            return targets;
        }
        step += 1;
    }
}

fn targets_at_steps(
    graph: &MotionGraph,
    places: &ClipPlaces,
    evasions: &[Evasion],
    step: u32,
) -> Vec<EntryTarget> {
    let frames = |seconds: f32| (f64::from(seconds) * graph.frame_rate()).round() as u32;
    let mut targets = Vec::new();
    for (index, evasion) in evasions.iter().enumerate() {
        let edge = graph.edge(evasion.edge);
        let start = graph.node(edge.from);
        let last = start.frame + edge.frames.min(frames(LATE));
        let mut frame = start.frame;
        // Parts of the lead-in that are not in the graph cannot be played.
        let earliest = start.frame.saturating_sub(frames(LEAD_IN));
        let place = |frame: u32| places.find(Node { frame, ..start });
        while frame >= earliest + step && place(frame - step).is_some() {
            frame -= step;
        }
        while frame < last && targets.len() < usize::from(u16::MAX) {
            targets.extend(place(frame).map(|at| EntryTarget {
                evasion: index as u16,
                frame,
                edge: at.edge,
                edge_frame: at.edge_frame,
            }));
            frame += step;
        }
    }
    targets
}
