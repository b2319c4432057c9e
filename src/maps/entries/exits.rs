//! Exits: cuts from any moment of the clips, also inside an evasion or an attack, back into natural motion.

use serde::{Deserialize, Serialize};

use super::targets::ClipFrame;
use super::{KnownEntry, MomentLists};
use crate::graph::{EdgeId, EdgeMotion, MotionGraph};

/// A frame of natural motion that an exit leads to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ExitTarget {
    /// Edge that plays the frame.
    pub edge: EdgeId,
    /// Position of the frame on that edge, in frames.
    pub edge_frame: u32,
}

impl From<&ClipFrame> for ExitTarget {
    fn from(at: &ClipFrame) -> Self {
        Self {
            edge: at.edge,
            edge_frame: at.edge_frame,
        }
    }
}

/// Exits of all moments. The moments are those of the [`EntryTable`](super::EntryTable).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct ExitTable {
    pub(super) targets: Vec<ExitTarget>,
    /// Exits of each moment, the one with the least departure first.
    pub(super) lists: MomentLists,
}

impl ExitTable {
    /// All frames that exits lead to.
    #[must_use]
    pub(crate) fn targets(&self) -> &[ExitTarget] {
        &self.targets
    }

    /// Checks all indices.
    pub(super) fn fits(&self, graph: &MotionGraph, moments: usize) -> bool {
        let target_fits = |target: &ExitTarget| {
            let edge = graph.edges().get(target.edge.index());
            edge.is_some_and(|edge| {
                edge.motion == EdgeMotion::Clip && target.edge_frame < edge.frames
            })
        };
        let legs = graph.feet().legs().len();
        let exit_fits = |exit: &KnownEntry| {
            usize::from(exit.target) < self.targets.len() && exit.pin().is_none_or(|leg| leg < legs)
        };
        self.targets.iter().all(target_fits) && self.lists.fits(moments, exit_fits)
    }
}
