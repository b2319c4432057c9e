//! Every frame of every clip under one number: the graph before it has nodes.

use super::prune::{self, Way};
use super::{EdgeMotion, MotionGraph, Transition};

/// Numbers the frames of all clips, clip after clip.
#[derive(Clone, Debug)]
pub(super) struct Moments {
    /// Number of each clip's first frame; one more at the end.
    first: Vec<u32>,
}

/// A way from one moment to another that is not its clip's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Jump {
    pub(super) from: u32,
    pub(super) to: u32,
    pub(super) frames: u32,
}

impl Moments {
    /// `frames` says how many each clip has.
    pub(super) fn new(frames: impl Iterator<Item = usize>) -> Self {
        let mut first = vec![0];
        let mut all = 0;
        for frames in frames {
            all += frames as u32;
            first.push(all);
        }
        Self { first }
    }

    pub(super) fn len(&self) -> usize {
        self.first[self.first.len() - 1] as usize
    }

    pub(super) fn at(&self, clip: usize, frame: usize) -> u32 {
        self.first[clip] + frame as u32
    }

    /// The numbers of a clip's frames.
    pub(super) fn of_clip(&self, clip: usize) -> std::ops::Range<usize> {
        self.first[clip] as usize..self.first[clip + 1] as usize
    }

    pub(super) fn jump(&self, transition: &Transition) -> Jump {
        Jump {
            from: self.at(transition.source_clip, transition.source_frame),
            to: self.at(transition.target_clip, transition.target_frame),
            frames: transition.frames as u32,
        }
    }

    /// For each moment whether its clip goes on after it.
    pub(super) fn goes_on(&self) -> Vec<bool> {
        let mut goes_on = vec![true; self.len()];
        for pair in self.first.windows(2).filter(|pair| pair[0] < pair[1]) {
            goes_on[pair[1] as usize - 1] = false;
        }
        goes_on
    }

    /// The moments of the largest strongly connected component; `None` where there is none.
    pub(super) fn component(&self, jumps: &[Jump]) -> Option<Vec<bool>> {
        let goes_on = self.goes_on();
        let steps = (0..self.len() as u32).filter(|&moment| goes_on[moment as usize]);
        let clip_ways = steps.map(|moment| Way {
            from: moment,
            to: moment + 1,
            clip_frames: 1,
            frames: 1,
        });
        let jump_ways = jumps.iter().map(|jump| Way {
            from: jump.from,
            to: jump.to,
            clip_frames: 0,
            frames: jump.frames,
        });
        prune::largest(self.len(), &clip_ways.chain(jump_ways).collect::<Vec<_>>())
    }
}

/// The moments of a finished graph, the jumps between them, and for each moment whether an edge
/// plays from it on to the next frame of its clip.
pub(super) fn of_graph(graph: &MotionGraph) -> (Moments, Vec<Jump>, Vec<bool>) {
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
