//! Numbers all frames of all clips consecutively. These moments form a graph before nodes exist.

use crate::graph::build::prune::{self, WeightedEdge};
use crate::graph::motion_graph::{EdgeMotion, GraphEvent, MotionGraph, starts};
use crate::graph::search::transition::Transition;

#[derive(Clone, Debug)]
pub(crate) struct Moments {
    /// Number of each clip's first frame. The last entry is the total.
    first: Vec<u32>,
}

/// A connection between two moments that is not the next frame of a clip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Jump {
    pub(crate) from: u32,
    pub(crate) to: u32,
    pub(crate) frames: u32,
}

impl Moments {
    pub(crate) fn new(frames: impl Iterator<Item = usize>) -> Self {
        Self {
            first: starts(frames.map(|frames| frames as u32)),
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.first[self.first.len() - 1] as usize
    }

    pub(crate) fn at(&self, clip: usize, frame: usize) -> u32 {
        self.first[clip] + frame as u32
    }

    pub(crate) fn ends(&self, event: &GraphEvent) -> [u32; 2] {
        [event.first, event.last].map(|frame| self.at(event.clip.index(), frame as usize))
    }

    pub(crate) fn of_clip(&self, clip: usize) -> std::ops::Range<usize> {
        self.first[clip] as usize..self.first[clip + 1] as usize
    }

    pub(crate) fn jump(&self, transition: &Transition) -> Jump {
        Jump {
            from: self.at(transition.source_clip, transition.source_frame),
            to: self.at(transition.target_clip, transition.target_frame),
            frames: transition.frames as u32,
        }
    }

    /// Returns for each moment whether its clip has a next frame.
    pub(crate) fn goes_on(&self) -> Vec<bool> {
        let mut goes_on = vec![true; self.len()];
        for pair in self.first.windows(2).filter(|pair| pair[0] < pair[1]) {
            goes_on[pair[1] as usize - 1] = false;
        }
        goes_on
    }

    /// Returns for each moment whether it belongs to the largest strongly connected component, or `None` if there is none.
    pub(crate) fn component(&self, jumps: &[Jump]) -> Option<Vec<bool>> {
        let goes_on = self.goes_on();
        let steps = (0..self.len() as u32).filter(|&moment| goes_on[moment as usize]);
        let clip_edges = steps.map(|moment| WeightedEdge {
            from: moment,
            to: moment + 1,
            clip_frames: 1,
            frames: 1,
        });
        let jump_edges = jumps.iter().map(|jump| WeightedEdge {
            from: jump.from,
            to: jump.to,
            clip_frames: 0,
            frames: jump.frames,
        });
        prune::largest(
            self.len(),
            &clip_edges.chain(jump_edges).collect::<Vec<_>>(),
        )
    }
}

/// Moments of a finished graph, the jumps between them and, for each moment, whether an edge plays
/// its clip's next frame.
pub(crate) fn from_graph(graph: &MotionGraph) -> (Moments, Vec<Jump>, Vec<bool>) {
    let moments = Moments::new(graph.clips().iter().map(|clip| clip.frames()));
    let mut played = vec![false; moments.len()];
    let mut jumps = Vec::new();
    for edge in graph.edges() {
        let [from, to] = [edge.from, edge.to].map(|node| {
            let node = graph.node(node);
            moments.at(node.clip.index(), node.frame as usize)
        });
        let frames = edge.frames;
        match edge.motion {
            EdgeMotion::Clip => played[from as usize..to as usize].fill(true),
            EdgeMotion::Transition { .. } => jumps.push(Jump { from, to, frames }),
        }
    }
    (moments, jumps, played)
}
