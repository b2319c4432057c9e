//! The state of one query, from its start to its answer.

use serde::{Deserialize, Serialize};

use super::cull::QueryMaps;
use super::gather::{
    CandidateList, EntryCandidate, LatePaths, LayerCandidate, MoveSearch, SearchReport,
};
use super::request::ActiveRequest;

/// Plain data: each stage reads the results of earlier stages.
#[derive(Clone, Debug, Default)]
pub(super) struct QueryState {
    /// Number of the round, unique among all rounds of all queries of the context.
    pub round: u64,
    /// Whether the round waits for counts.
    pub is_waiting: bool,
    pub request: ActiveRequest,
    pub source: Source,
    pub candidates: CandidateList,
    pub late: LatePaths,
    pub search: SearchReport,
    /// Paths of the candidates that are moves.
    pub moves: MoveSearch,
    /// Candidates that enter an evasion.
    pub entries: Vec<EntryCandidate>,
    /// Candidates that layer an evasion.
    pub layers: Vec<LayerCandidate>,
    /// The maps of this round's candidates.
    pub maps: QueryMaps,
}

/// The set that the candidates of an answer come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The grid of the node.
    Grid,
    /// All paths, because the grid cells that the attack touches are empty.
    NothingFiled,
    /// All paths, because no candidate of the grid is clean.
    NothingClean,
    /// All paths, because the settings say so.
    #[default]
    Whole,
}
