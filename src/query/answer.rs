use serde::{Deserialize, Serialize};

use super::Judging;
use super::candidate::Way;
use super::case::Case;
use super::clearance::Clearance;
use super::cull::Overlap;
use super::judge::Judged;
use super::moves::SearchReport;
use super::retime::{Rate, RateError};
use super::score::Score;
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
    /// The edges of the paths that only move.
    edges: Vec<EdgeId>,
}

/// Where the candidates of an answer come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The node's grid.
    Grid,
    /// From everywhere: nothing is filed in the cells that were looked up.
    NothingFiled,
    /// From everywhere: nothing that is filed there is clean.
    NothingClean,
    /// From everywhere, as the settings say.
    #[default]
    Whole,
}

/// One candidate and what became of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CandidateReport {
    route: Route,
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
    /// What became of it.
    pub fate: Fate,
}

/// Where the edges of a candidate's path stand.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Route {
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

/// How a query was decided.
pub(super) struct Decision {
    pub chosen: usize,
    pub source: Source,
    pub search: SearchReport,
    pub judging: Judging,
    pub reconsidered: usize,
    pub not_in_time: usize,
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

    /// Takes over everything but the motion.
    pub(super) fn fill(&mut self, case: &Case<'_>, judged: &[Option<Judged>], decision: &Decision) {
        self.chosen = decision.chosen;
        self.source = decision.source;
        self.search = decision.search;
        self.edges.clear();
        self.candidates.clear();
        for (index, judged) in judged.iter().enumerate() {
            let report = self.report(case, (index, *judged), decision);
            self.candidates.push(report);
        }
        self.avoided = self.candidates[self.chosen].score.is_some();
        self.counts = Counts::of(&self.candidates, decision);
    }

    fn report(
        &mut self,
        case: &Case<'_>,
        (index, judged): (usize, Option<Judged>),
        decision: &Decision,
    ) -> CandidateReport {
        let candidate = &case.candidates[index];
        let baked = case.query.baked;
        let (route, evasion) = match candidate.way {
            Way::Evasion { path, .. } => (Route::Table(path), Some(evasion_of(baked, path))),
            Way::Move(path) => {
                let start = self.edges.len();
                self.edges.extend(case.moves.edges_backwards(path));
                self.edges[start..].reverse();
                let route = Route::Edges(start as u32, self.edges.len() as u32);
                (route, None)
            }
        };
        let overlap = case.overlap(index);
        let score = judged.and_then(|judged| judged.score);
        let is_culled =
            decision.judging == Judging::Needed && overlap.is_some_and(|overlap| overlap.body > 0);
        CandidateReport {
            route,
            evasion,
            rate: Ok(candidate.rate),
            overlap,
            clearance: judged.map(|judged| judged.clearance),
            score,
            fate: if index == decision.chosen {
                Fate::Chosen
            } else if is_culled {
                Fate::Culled
            } else if judged.is_some() && score.is_none() {
                Fate::Hit
            } else {
                Fate::Outscored
            },
        }
    }

    /// Appends the paths that no rate brings in time.
    pub(super) fn list_late(&mut self, baked: &BakedGraph, late: &[(PathId, RateError)]) {
        for &(path, error) in late {
            self.candidates.push(CandidateReport {
                route: Route::Table(path),
                evasion: Some(evasion_of(baked, path)),
                rate: Err(error),
                overlap: None,
                clearance: None,
                score: None,
                fate: Fate::NotInTime,
            });
        }
    }
}

fn evasion_of(baked: &BakedGraph, path: PathId) -> EdgeId {
    baked.evasions()[baked.paths().path(path).evasion as usize].edge
}

impl Counts {
    fn of(candidates: &[CandidateReport], decision: &Decision) -> Self {
        let count = |is: fn(&CandidateReport) -> bool| candidates.iter().filter(|r| is(r)).count();
        let culled = match decision.judging {
            Judging::Needed => count(|report| report.overlap.is_some_and(|o| o.body > 0)),
            Judging::All => 0,
        };
        Self {
            candidates: candidates.len(),
            with_evasion: count(|report| report.evasion.is_some()),
            not_in_time: decision.not_in_time,
            culled,
            reconsidered: decision.reconsidered,
            hits: count(|report| report.clearance.is_some() && report.score.is_none()),
            clean: count(|report| report.score.is_some()),
        }
    }
}
