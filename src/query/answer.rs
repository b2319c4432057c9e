//! The answer to a query: the motion to play, and what became of each candidate.

use serde::{Deserialize, Serialize};

use super::clearance::Clearance;
use super::cull::Overlap;
use super::gather::{Candidate, CandidateKind, EntryCandidate, SearchReport};
use super::request::Evaluation;
use super::retime::{Rate, RateError, retimed};
use super::score::{Evaluated, Score};
use super::select::Selection;
use super::state::{QueryState, Source};
use crate::anim::Warp;
use crate::graph::{EdgeId, Entry, Layer, Motion, MotionStep, Playhead};
use crate::maps::{BakedGraph, PathId};

/// The answer to a query. Keep it from one query to the next, because its memory is reused.
#[derive(Clone, Debug, Default)]
pub struct Answer {
    /// Index of the chosen candidate in `candidates`.
    pub chosen: usize,
    /// Whether the chosen motion avoids the attack, by the exact test.
    pub avoided: bool,
    /// Whether the body pushes off harder in it than [allowed](super::QuerySettings::push_off), as in all candidates.
    pub too_hard: bool,
    /// Motion to play, from the moment of the query on.
    pub motion: Motion,
    /// Reports of all candidates.
    pub candidates: Vec<CandidateReport>,
    /// Set that the candidates come from.
    pub source: Source,
    /// Number of candidates by result.
    pub counts: Counts,
    /// Statistics of the search for candidates.
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
    pub entry: Option<EnteredAt>,
    /// Layer that plays the upper body of the evasion while the natural motion continues; `None` for other candidates.
    pub layer: Option<Layer>,
    /// Rate of the retimable edges, or the reason why there is none.
    pub rate: Result<Rate, RateError>,
    /// Texels that the candidate's maps share with the attack; `None` if they were not counted.
    pub overlap: Option<Overlap>,
    /// Exact distance from the attack; `None` if the candidate was not tested. A hit that was not chosen may be deeper.
    pub clearance: Option<Clearance>,
    /// Score; `None` for a hit and for a candidate that was not tested.
    pub score: Option<Score>,
    /// Warp that makes the motion clean; clearance and score are those of the warped motion. `None` without a warp.
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
    /// The body would push off harder than allowed ([`QuerySettings::push_off`](super::QuerySettings::push_off)).
    TooHard,
}

/// The number of candidates by result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Number of candidates: evasions that a rate brings in time, and moves.
    pub candidates: usize,
    /// Number of candidates that end in an evasion.
    pub with_evasion: usize,
    /// Number of candidates that enter an evasion without an edge. They are included in `with_evasion`.
    pub entered: usize,
    /// Number of candidates that layer the upper body of an evasion. They are included in `with_evasion`.
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
    /// Number of tested candidates that push off too hard.
    #[serde(default)]
    pub too_hard: usize,
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
        let stored = path.into_iter().flat_map(|path| baked.paths().edges(path));
        stored.chain(edges.iter().copied())
    }

    /// The candidates that end in an evasion, with their paths.
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
    pub fn chosen(&self) -> &CandidateReport {
        &self.candidates[self.chosen]
    }

    /// The smallest distance of body and attack on the chosen motion.
    pub fn clearance(&self) -> Clearance {
        // The chosen candidate was always tested.
        let chosen = self.candidates.get(self.chosen);
        let clearance = chosen.and_then(|report| report.clearance);
        clearance.unwrap_or(Clearance::none(0.0))
    }

    /// The motion of a candidate, from the moment of the query until the end of its evasion. Returns `None` for a path that no rate
    /// brings in time.
    ///
    /// `report` is one of `candidates`, `baked` is the graph of the query, and `playhead` is the position of its request.
    pub fn motion_of(
        &self,
        baked: &BakedGraph,
        playhead: Playhead,
        report: &CandidateReport,
    ) -> Option<Motion> {
        let mut motion = Motion::default();
        if let Some(EnteredAt { delay, entry }) = &report.entry {
            motion.restart(baked.graph(), playhead, []);
            motion.enter(baked.graph(), *delay, entry);
        } else if let Some(layer) = report.layer {
            motion.restart(baked.graph(), playhead, []);
            motion.extend(baked.graph(), layer.end());
            motion.set_layer(Some(layer));
        } else {
            let steps = retimed(baked, report.rate.ok()?, self.path(baked, report));
            let evasion = report.evasion.map(|edge| MotionStep { edge, rate: 1.0 });
            motion.restart(baked.graph(), playhead, steps.chain(evasion));
        }
        if let Some(warp) = report.warp {
            motion.extend(baked.graph(), warp.envelope.end);
        }
        motion.set_warp(report.warp);
        Some(motion)
    }

    /// Replaces all data of the answer, except the motion.
    pub(super) fn fill(
        &mut self,
        baked: &BakedGraph,
        state: &QueryState,
        evaluated: &[Option<Evaluated>],
        selection: Selection,
    ) {
        let candidates = &state.candidates;
        self.chosen = selection.chosen;
        self.source = state.source;
        self.search = candidates.search;
        self.edges.clear();
        self.candidates.clear();
        for (index, candidate) in candidates.list.iter().enumerate() {
            let mut report = self.report(baked, state, candidate);
            report.overlap = candidates.overlap(index);
            if let Some(one) = evaluated[index] {
                report.clearance = Some(one.clearance);
                (report.score, report.warp) = (one.score, one.warp);
            }
            report.result = if index == selection.chosen {
                CandidateResult::Chosen
            } else if evaluated[index].is_some_and(|one| one.is_too_hard()) {
                CandidateResult::TooHard
            } else if state.is_culled(index) {
                CandidateResult::Culled
            } else if report.clearance.is_some() && report.score.is_none() {
                CandidateResult::Hit
            } else {
                CandidateResult::Outscored
            };
            self.candidates.push(report);
        }
        self.avoided = self.candidates[self.chosen].score.is_some();
        self.too_hard = evaluated[self.chosen].is_some_and(|one| one.is_too_hard());
        let count = |is: fn(&CandidateReport) -> bool| {
            let counted = self.candidates.iter().filter(|report| is(report));
            counted.count()
        };
        self.counts = Counts {
            candidates: self.candidates.len(),
            with_evasion: count(|report| report.evasion.is_some()),
            entered: count(|report| report.entry.is_some()),
            layered: count(|report| report.layer.is_some()),
            not_in_time: candidates.late_count,
            culled: match state.request.evaluation {
                Evaluation::Lazy | Evaluation::Kept => {
                    count(|report| report.overlap.is_some_and(|o| o.body > 0))
                }
                Evaluation::Exhaustive => 0,
            },
            reconsidered: selection.reconsidered,
            hits: count(|report| {
                let is_hit = report.clearance.is_some() && report.score.is_none();
                is_hit && report.result != CandidateResult::TooHard
            }),
            clean: count(|report| report.score.is_some()),
            too_hard: count(|report| report.result == CandidateResult::TooHard),
        };
        let late = candidates.late.iter();
        self.candidates.extend(late.map(|&(path, error)| {
            let evasion = state.request.path(path).goal as usize;
            let edge = baked.evasions()[evasion].edge;
            CandidateReport::untested(Route::Table(path), Some(edge), Err(error))
        }));
    }

    fn report(
        &mut self,
        baked: &BakedGraph,
        state: &QueryState,
        candidate: &Candidate,
    ) -> CandidateReport {
        let candidates = &state.candidates;
        let none = Route::Edges(0, 0);
        let (mut entered_at, mut layered) = (None, None);
        let (route, evasion) = match candidate.kind {
            CandidateKind::Evasion { path, .. } => {
                let evasion = state.request.path(path).goal as usize;
                (Route::Table(path), Some(evasion))
            }
            CandidateKind::Move(path) => {
                let start = self.edges.len() as u32;
                let mut push = |edge| self.edges.push(edge);
                state.moves.for_each_edge(path, &mut push);
                (Route::Edges(start, self.edges.len() as u32), None)
            }
            CandidateKind::Entry(entry) => {
                let candidate = &candidates.entries[entry as usize];
                let EntryCandidate { delay, entry, .. } = *candidate;
                entered_at = Some(EnteredAt { delay, entry });
                (none, Some(candidate.evasion))
            }
            CandidateKind::Layer(layer) => {
                let candidate = &candidates.layers[layer as usize];
                layered = Some(candidate.layer);
                (none, Some(candidate.evasion))
            }
        };
        let edge = evasion.map(|evasion| baked.evasions()[evasion].edge);
        CandidateReport {
            entry: entered_at,
            layer: layered,
            ..CandidateReport::untested(route, edge, Ok(candidate.rate))
        }
    }
}

impl CandidateReport {
    /// The report of a path that is not in time, until it is known to be a candidate.
    fn untested(route: Route, evasion: Option<EdgeId>, rate: Result<Rate, RateError>) -> Self {
        Self {
            route,
            evasion,
            entry: None,
            layer: None,
            rate,
            overlap: None,
            clearance: None,
            score: None,
            warp: None,
            result: CandidateResult::NotInTime,
        }
    }
}
