//! The state of one query, from its start to its answer.

use serde::{Deserialize, Serialize};

use super::cull::QueryMaps;
use super::gather::{CandidateKind, CandidateList, MoveId, MoveSearch};
use super::request::{ActiveRequest, Evaluation, PlanStage};

/// Plain data: each stage reads the results of earlier stages.
#[derive(Clone, Debug, Default)]
pub(super) struct QueryState {
    /// Number of the round, unique among all rounds of all queries of the context.
    pub round: u64,
    pub is_waiting: bool,
    pub request: ActiveRequest,
    /// The stage in which the limit of a plan was reached without a clean candidate.
    pub late_stage: Option<PlanStage>,
    pub source: Source,
    /// Time at which the attack hits the natural motion, in seconds, if it was needed.
    pub contact: Option<f32>,
    pub candidates: CandidateList,
    pub moves: MoveSearch,
    pub maps: QueryMaps,
}

impl QueryState {
    pub(super) fn move_of(&self, index: usize) -> Option<MoveId> {
        match self.candidates.list[index].kind {
            CandidateKind::Move(path) => Some(path),
            _ => None,
        }
    }

    /// Whether the maps remove a candidate.
    pub(super) fn is_culled(&self, index: usize) -> bool {
        let overlap = self.candidates.overlap(index);
        self.request.evaluation != Evaluation::Exhaustive
            && !self.starts_in_blend(index)
            && overlap.is_some_and(|overlap| overlap.body > 0)
    }

    /// Whether an evasion starts while the offset of an earlier motion still fades out. Maps and tracks do not include the offset.
    pub(super) fn starts_in_blend(&self, index: usize) -> bool {
        match self.candidates.list[index].kind {
            CandidateKind::Evasion { start, .. } => start < self.request.blend.blends_until(),
            _ => false,
        }
    }
}

/// The set that the candidates of an answer come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The grid of the node.
    Grid,
    /// All paths, because the grid cells that the attack touches are empty.
    EmptyCells,
    /// All paths, because no candidate of the grid is clean.
    NothingClean,
    /// All paths, because the settings say so.
    #[default]
    Whole,
}

impl Source {
    /// Where the candidates come from, in a few words.
    #[must_use]
    pub fn describe(self) -> &'static str {
        match self {
            Self::Grid => "the node's grid",
            Self::EmptyCells => "whole graph: the grid has no candidate",
            Self::NothingClean => "whole graph: no candidate of the grid is clean",
            Self::Whole => "whole graph",
        }
    }
}
