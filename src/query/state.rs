use super::candidate::CandidateList;
use super::cull::QueryMaps;
use super::entry_candidate::EntryCandidate;
use super::layer_candidate::LayerCandidate;
use super::moves::{MoveSearch, SearchReport};
use super::request::ActiveRequest;
use super::retime::RateError;
use super::source::Source;
use crate::maps::PathId;

/// The state of one query, from its start to its answer. It is plain data: each stage reads the results of earlier stages.
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

/// Paths to an evasion that no rate brings in time.
#[derive(Clone, Debug, Default)]
pub(super) struct LatePaths {
    pub count: usize,
    /// The paths with the reasons. Empty unless [`QuerySettings::list_late`](super::QuerySettings::list_late) is set.
    pub list: Vec<(PathId, RateError)>,
}
