use serde::{Deserialize, Serialize};

use super::clearance::Clearance;
use super::cull::Overlap;
use super::moves::SearchReport;
use super::retime::{Rate, RateError};
use super::score::Score;
use super::source::Source;
use crate::anim::Warp;
use crate::graph::{EdgeId, Entry, Layer, Motion};
use crate::maps::{BakedGraph, PathId};

/// The answer to a query. Keep it from one query to the next, because its memory is reused.
#[derive(Clone, Debug, Default)]
pub struct Answer {
    /// Index of the chosen candidate in `candidates`.
    pub chosen: usize,
    /// Whether the chosen motion avoids the attack, by the exact test.
    pub avoided: bool,
    /// Motion to play, from the moment of the query on.
    pub motion: Motion,
    /// Reports of all candidates.
    pub candidates: Vec<CandidateReport>,
    /// Set that the candidates come from.
    pub source: Source,
    /// Number of candidates by result.
    pub counts: Counts,
    /// Statistics of the search for candidates.
    #[doc(hidden)]
    pub search: SearchReport,
    /// Edges of all moves.
    pub(super) edges: Vec<EdgeId>,
}

/// The report of one candidate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CandidateReport {
    pub(super) route: Route,
    /// Edge of the evasion after the path; `None` for a move.
    pub evasion: Option<EdgeId>,
    /// Entry into the evasion; `None` if an edge leads to it.
    #[doc(hidden)]
    pub entry: Option<EnteredAt>,
    /// Layer that plays the upper body of the evasion while the natural motion continues; `None` for other candidates.
    #[doc(hidden)]
    pub layer: Option<Layer>,
    /// Rate of the retimable edges, or the reason why there is none.
    #[doc(hidden)]
    pub rate: Result<Rate, RateError>,
    /// Texels that the candidate's maps share with the attack; `None` if they were not counted.
    pub overlap: Option<Overlap>,
    /// Exact distance from the attack; `None` if the candidate was not tested. A hit that was not chosen may be deeper.
    pub clearance: Option<Clearance>,
    /// Score; `None` for a hit and for a candidate that was not tested.
    pub score: Option<Score>,
    /// Warp that makes the motion clean; clearance and score are those of the warped motion. `None` without a warp.
    #[doc(hidden)]
    pub warp: Option<Warp>,
    /// Result of the candidate.
    pub result: CandidateResult,
}

/// An entry and its time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EnteredAt {
    /// Time from the query to the entry, in seconds. Until then the natural motion continues.
    pub delay: f32,
    /// The entry.
    pub entry: Entry,
}

/// Where the edges of a candidate's path are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Route {
    /// A path of the baked graph.
    Table(PathId),
    /// A range of the answer's edges.
    Edges(u32, u32),
}

/// The result of a candidate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CandidateResult {
    /// The candidate was chosen.
    Chosen,
    /// Another candidate has a better score. If the candidate has no clearance, it could not have won at any clearance.
    Outscored,
    /// No rate within the limits starts the candidate's evasion in time.
    NotInTime,
    /// The candidate's body map overlaps the attack.
    Culled,
    /// The exact test found a hit.
    Hit,
}

/// The number of candidates by result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Number of candidates: evasions that a rate brings in time, and moves.
    pub candidates: usize,
    /// Number of candidates that end in an evasion.
    pub with_evasion: usize,
    /// Number of candidates that enter an evasion without an edge. They are included in `with_evasion`.
    #[serde(default)]
    pub entered: usize,
    /// Number of candidates that layer the upper body of an evasion. They are included in `with_evasion`.
    #[serde(default)]
    pub layered: usize,
    /// Number of paths to an evasion that no rate brings in time. They are not candidates.
    pub not_in_time: usize,
    /// Number of candidates that the maps removed.
    pub culled: usize,
    /// Number of culled candidates that were tested exactly because no other candidate was clean.
    pub reconsidered: usize,
    /// Number of tested candidates that are hit.
    pub hits: usize,
    /// Number of tested candidates that are clean.
    pub clean: usize,
}

impl Answer {
    /// The edges of a candidate's path, from the next node to the evasion's start, or to the end of a move. `report` is one of
    /// `candidates`, and `baked` is the graph of the query.
    pub fn path<'a>(
        &'a self,
        baked: &'a BakedGraph,
        report: &CandidateReport,
    ) -> impl Iterator<Item = EdgeId> + 'a {
        let (path, edges) = match report.route {
            Route::Table(path) => (Some(path), &[][..]),
            Route::Edges(first, end) => (None, &self.edges[first as usize..end as usize]),
        };
        let filed = path.into_iter().flat_map(|path| baked.paths().edges(path));
        filed.chain(edges.iter().copied())
    }

    /// The candidates that end in an evasion, with their paths.
    #[doc(hidden)]
    pub fn paths(&self) -> impl Iterator<Item = (PathId, &CandidateReport)> {
        self.candidates
            .iter()
            .filter_map(|report| match report.route {
                Route::Table(path) => Some((path, report)),
                Route::Edges(..) => None,
            })
    }

    /// The chosen candidate.
    ///
    /// # Panics
    /// If no query has written the answer.
    #[must_use]
    pub fn chosen(&self) -> &CandidateReport {
        &self.candidates[self.chosen]
    }

    /// The smallest distance of body and attack on the chosen motion.
    #[must_use]
    pub fn clearance(&self) -> Clearance {
        // The chosen candidate was always tested.
        let none = Clearance::none(0.0);
        self.candidates
            .get(self.chosen)
            .and_then(|report| report.clearance)
            .unwrap_or(none)
    }
}
