use serde::{Deserialize, Serialize};

use super::clearance::Clearance;
use super::cull::Overlap;
use super::moves::SearchReport;
use super::retime::{Rate, RateError};
use super::score::Score;
use super::source::Source;
use crate::graph::{EdgeId, Entry, Layer, Motion};
use crate::maps::{BakedGraph, PathId};
use sabaki_motion::internal::Warp;

/// The answer to a query. Keep it from one query to the next: its memory is used again.
#[derive(Clone, Debug, Default)]
pub struct Answer {
    /// Position of the chosen candidate in `candidates`.
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
    /// Edge of the evasion, which follows the path; `None` for a move.
    pub evasion: Option<EdgeId>,
    /// Entry into the evasion, if no edge leads to it.
    #[doc(hidden)]
    pub entry: Option<EnteredAt>,
    /// Layer that plays the evasion's upper body while the natural motion goes on; otherwise `None`.
    #[doc(hidden)]
    pub layer: Option<Layer>,
    /// Rate of the retimable edges, or the reason why there is none.
    #[doc(hidden)]
    pub rate: Result<Rate, RateError>,
    /// Texels that the candidate's maps share with the attack; `None` if they were not counted.
    pub overlap: Option<Overlap>,
    /// Exact distance from the attack; `None` if it was not needed. A hit that was not chosen may be deeper than this.
    pub clearance: Option<Clearance>,
    /// Score; `None` for a hit and for a candidate that was not tested.
    pub score: Option<Score>,
    /// Warp that makes the motion clean; clearance and score are those of the warped motion. `None` without a warp.
    #[doc(hidden)]
    pub warp: Option<Warp>,
    /// Result of the candidate.
    pub fate: Fate,
}

/// An entry and its time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EnteredAt {
    /// Time of the entry, seconds since the query. Until then the natural motion continues.
    pub delay: f32,
    /// The entry.
    pub entry: Entry,
}

/// The place of the edges of a candidate's path.
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
pub enum Fate {
    /// It was chosen.
    Chosen,
    /// Another candidate has a better score. Without a clearance: no clearance could have made this one better.
    Outscored,
    /// No rate within the limits starts its evasion in time.
    NotInTime,
    /// Its body map overlaps the attack.
    Culled,
    /// The exact test found a hit.
    Hit,
}

/// The number of candidates by result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Candidates: evasions that a rate brings in time, and moves.
    pub candidates: usize,
    /// Candidates that end in an evasion.
    pub with_evasion: usize,
    /// Candidates that enter an evasion without an edge. They count as candidates with an evasion too.
    #[serde(default)]
    pub entered: usize,
    /// Candidates that layer the upper body of an evasion. They count as candidates with an evasion too.
    #[serde(default)]
    pub layered: usize,
    /// Paths to an evasion that no rate brings in time; these are no candidates.
    pub not_in_time: usize,
    /// Candidates that the maps removed.
    pub culled: usize,
    /// Culled candidates that were tested exactly after all, because no other candidate was clean.
    pub reconsidered: usize,
    /// Tested candidates that are hit.
    pub hits: usize,
    /// Tested candidates that are clean.
    pub clean: usize,
}

impl Answer {
    /// The edges of a candidate's path, from the next node to the evasion's start, or to the end of a move. `report` is one of
    /// `candidates`, `baked` the graph of the query.
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
