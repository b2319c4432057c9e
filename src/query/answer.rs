use serde::{Deserialize, Serialize};

use super::clearance::Clearance;
use super::cull::Overlap;
use super::moves::SearchReport;
use super::retime::{Rate, RateError};
use super::score::Score;
use super::source::Source;
use crate::anim::Warp;
use crate::graph::{EdgeId, Motion};
use crate::maps::{BakedGraph, PathId};

/// What a query answers. Its memory is used again by the next one.
#[derive(Clone, Debug, Default)]
pub struct Answer {
    /// Position of the chosen candidate in `candidates`.
    pub chosen: usize,
    /// Whether the chosen motion avoids the attack: exactly tested, not by maps.
    pub avoided: bool,
    /// What to play, from the moment of the query on.
    pub motion: Motion,
    /// Every candidate with what became of it.
    pub candidates: Vec<CandidateReport>,
    /// Where the candidates come from.
    pub source: Source,
    /// How many of each.
    pub counts: Counts,
    /// How the search for candidates went.
    pub search: SearchReport,
    /// The edges of moves.
    pub(super) edges: Vec<EdgeId>,
}

/// One candidate and what became of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CandidateReport {
    pub(super) route: Route,
    /// The evasion's edge, which follows the path; `None` for a path that only moves.
    pub evasion: Option<EdgeId>,
    /// The rate of the retimable edges, or why there is none.
    pub rate: Result<Rate, RateError>,
    /// Texels of the attack on its maps; `None` where nothing was counted.
    pub overlap: Option<Overlap>,
    /// The exact distance; `None` where it was not needed. A hit that was not chosen may be deeper than
    /// this.
    pub clearance: Option<Clearance>,
    /// Its score; `None` for a hit and for what was not tested.
    pub score: Option<Score>,
    /// How its motion is bent so that it is clean; clearance and score are those of the bent motion. `None` where it is not.
    pub warp: Option<Warp>,
    /// What became of it.
    pub fate: Fate,
}

/// Where the edges of a candidate's path stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Route {
    /// In the table of the baked graph.
    Table(PathId),
    /// In the answer: the first one, and the end.
    Edges(u32, u32),
}

/// What became of a candidate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fate {
    /// It is the answer.
    Chosen,
    /// Another one scored better; where it has no clearance, it could not have scored better with
    /// any.
    Outscored,
    /// No rate brings its evasion in time.
    NotInTime,
    /// Its body map meets the attack.
    Culled,
    /// The exact test finds a hit.
    Hit,
}

/// How many candidates of each fate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// That an evasion ends and that a rate brings in time, and those that only move.
    pub candidates: usize,
    /// Of these, how many end in an evasion.
    pub with_evasion: usize,
    /// Paths to an evasion that no rate brings in time.
    pub not_in_time: usize,
    /// Removed by the maps.
    pub culled: usize,
    /// Of the culled ones, how many the exact test was asked about after all, since it found
    /// nothing clean among the others.
    pub reconsidered: usize,
    /// Exact hits among those tested.
    pub hits: usize,
    /// Exactly clean among those tested.
    pub clean: usize,
}

impl Answer {
    /// The edges of a candidate's path: from the next node to the evasion's start, or as far as the
    /// search for moves went. `report` is one of `candidates`, `baked` the graph that was asked.
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

    /// Each candidate that ends in an evasion, by its path in the table.
    pub(super) fn paths(&self) -> impl Iterator<Item = (PathId, &CandidateReport)> {
        self.candidates
            .iter()
            .filter_map(|report| match report.route {
                Route::Table(path) => Some((path, report)),
                Route::Edges(..) => None,
            })
    }

    /// The chosen candidate.
    #[must_use]
    pub fn chosen(&self) -> &CandidateReport {
        &self.candidates[self.chosen]
    }

    /// The smallest distance of body and attack on the chosen motion.
    #[must_use]
    pub fn clearance(&self) -> Clearance {
        // The chosen one was tested.
        let none = Clearance::none(0.0);
        self.candidates
            .get(self.chosen)
            .and_then(|report| report.clearance)
            .unwrap_or(none)
    }
}
