use super::candidate::CandidateList;
use super::cull::QueryMaps;
use super::entry_candidate::EntryCandidate;
use super::layer_candidate::LayerCandidate;
use super::moves::{MoveSearch, SearchReport};
use super::request::ActiveRequest;
use super::retime::RateError;
use super::source::Source;
use crate::maps::PathId;

/// The state of one query, from its start to its answer. Plain data: each stage reads what the stages before it wrote.
#[derive(Clone, Debug, Default)]
pub(super) struct QueryState {
    /// Number of the round; each round of each query has its own.
    pub round: u64,
    /// Whether the round waits for counts.
    pub is_waiting: bool,
    pub request: ActiveRequest,
    pub source: Source,
    pub candidates: CandidateList,
    pub late: LatePaths,
    pub search: SearchReport,
    /// The paths of those candidates that are moves.
    pub moves: MoveSearch,
    /// Those candidates that enter an evasion.
    pub entries: Vec<EntryCandidate>,
    /// Those candidates that layer an evasion.
    pub layers: Vec<LayerCandidate>,
    /// The maps of this round's candidates.
    pub maps: QueryMaps,
}

/// Paths to an evasion that no rate brings in time.
#[derive(Clone, Debug, Default)]
pub(super) struct LatePaths {
    pub count: usize,
    /// The paths; empty unless the settings ask for them.
    pub list: Vec<(PathId, RateError)>,
}
