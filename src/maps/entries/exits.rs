//! Exits: cuts from any moment of the clips, also inside an evasion or an attack, back into natural motion.

use serde::{Deserialize, Serialize};

use super::KnownEntry;
use crate::graph::{EdgeId, EdgeMotion, MotionGraph};

/// A frame of natural motion that an exit leads to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ExitTarget {
    /// Edge that plays the frame.
    pub edge: EdgeId,
    /// Position of the frame on that edge, in frames.
    pub edge_frame: u32,
}

impl From<(EdgeId, u32)> for ExitTarget {
    fn from((edge, edge_frame): (EdgeId, u32)) -> Self {
        Self { edge, edge_frame }
    }
}

/// Exits of all moments, which are those of the [`EntryTable`](super::EntryTable).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct ExitTable {
    pub(super) targets: Vec<ExitTarget>,
    /// End of each moment's exits in `exits`.
    ends: Vec<u32>,
    exits: Vec<KnownEntry>,
}

impl ExitTable {
    /// All frames that exits lead to.
    #[must_use]
    pub(crate) fn targets(&self) -> &[ExitTarget] {
        &self.targets
    }

    /// Number of exits.
    #[must_use]
    pub(super) fn len(&self) -> usize {
        self.exits.len()
    }

    /// Appends the exits of the next moment.
    pub(super) fn push(&mut self, exits: &[KnownEntry]) {
        self.exits.extend_from_slice(exits);
        self.ends.push(self.exits.len() as u32);
    }

    /// Exits of a moment, the least departure first.
    pub(super) fn of(&self, moment: u32) -> &[KnownEntry] {
        let moment = moment as usize;
        let start = moment.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.exits[start as usize..self.ends[moment] as usize]
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
        self.ends.len() == moments
            && self.ends.is_sorted()
            && self.ends.last().map_or(0, |&end| end as usize) == self.exits.len()
            && self.targets.iter().all(target_fits)
            && self.exits.iter().all(exit_fits)
    }
}
