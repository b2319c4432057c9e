use super::answer::{Answer, CandidateReport, CandidateResult, Counts, EnteredAt, Route};
use super::ask::Query;
use super::candidate::CandidateKind;
use super::entry_candidate::EntryCandidate;
use super::evaluated::Evaluated;
use super::evaluation::Evaluation;
use super::evaluation_input::EvaluationInput;
use super::retime::RateError;
use super::select::Selection;
use super::state::QueryState;
use crate::maps::{BakedGraph, PathId};

/// Data of an answer, except the motion.
pub(super) struct Report<'a> {
    pub query: Query<'a>,
    pub state: &'a QueryState,
    /// Result of each candidate's test.
    pub evaluated: &'a [Option<Evaluated>],
    pub selection: Selection,
}

impl Answer {
    /// Replaces all data of the answer, except the motion.
    pub(super) fn fill(&mut self, report: &Report<'_>) {
        let (baked, state) = (report.query.baked, report.state);
        self.chosen = report.selection.chosen;
        self.source = state.source;
        self.search = state.search;
        self.edges.clear();
        self.candidates.clear();
        for index in 0..report.evaluated.len() {
            let route = self.route(report, index);
            self.candidates.push(report.candidate(index, route));
        }
        self.avoided = self.candidates[self.chosen].score.is_some();
        self.counts = report.counts(&self.candidates);
        let late = state.late.list.iter();
        self.candidates
            .extend(late.map(|&(path, error)| late_path(baked, path, error)));
    }

    fn route(&mut self, report: &Report<'_>, index: usize) -> Route {
        match report.state.candidates.list[index].kind {
            CandidateKind::Evasion { path, .. } => Route::Table(path),
            CandidateKind::Move(path) => {
                let start = self.edges.len();
                self.edges.extend(report.state.moves.edges_backwards(path));
                self.edges[start..].reverse();
                Route::Edges(start as u32, self.edges.len() as u32)
            }
            CandidateKind::Entry(_) | CandidateKind::Layer(_) => Route::Edges(0, 0),
        }
    }
}

impl Report<'_> {
    fn candidate(&self, index: usize, route: Route) -> CandidateReport {
        let candidate = &self.state.candidates.list[index];
        let input = EvaluationInput {
            query: self.query,
            state: self.state,
        };
        let evaluated = self.evaluated[index];
        let score = evaluated.and_then(|one| one.score);
        CandidateReport {
            route,
            evasion: match candidate.kind {
                CandidateKind::Evasion { path, .. } => {
                    Some(self.query.baked.path_evasion(path).edge)
                }
                CandidateKind::Entry(entry) => {
                    let evasion = self.state.entries[entry as usize].evasion;
                    Some(self.query.baked.evasions()[evasion].edge)
                }
                CandidateKind::Layer(layer) => {
                    let evasion = self.state.layers[layer as usize].evasion;
                    Some(self.query.baked.evasions()[evasion].edge)
                }
                CandidateKind::Move(_) => None,
            },
            entry: match candidate.kind {
                CandidateKind::Entry(entry) => {
                    let EntryCandidate { delay, entry, .. } = self.state.entries[entry as usize];
                    Some(EnteredAt { delay, entry })
                }
                _ => None,
            },
            layer: match candidate.kind {
                CandidateKind::Layer(layer) => Some(self.state.layers[layer as usize].layer),
                _ => None,
            },
            rate: Ok(candidate.rate),
            overlap: input.overlap(index),
            clearance: evaluated.map(|one| one.clearance),
            score,
            warp: evaluated.and_then(|one| one.warp),
            result: if index == self.selection.chosen {
                CandidateResult::Chosen
            } else if input.is_culled(index) {
                CandidateResult::Culled
            } else if evaluated.is_some() && score.is_none() {
                CandidateResult::Hit
            } else {
                CandidateResult::Outscored
            },
        }
    }

    fn counts(&self, candidates: &[CandidateReport]) -> Counts {
        let count = |is: fn(&CandidateReport) -> bool| candidates.iter().filter(|r| is(r)).count();
        let culled = match self.state.request.evaluation {
            Evaluation::Lazy => count(|report| report.overlap.is_some_and(|o| o.body > 0)),
            Evaluation::Exhaustive => 0,
        };
        Counts {
            candidates: candidates.len(),
            with_evasion: count(|report| report.evasion.is_some()),
            entered: count(|report| report.entry.is_some()),
            layered: count(|report| report.layer.is_some()),
            not_in_time: self.state.late.count,
            culled,
            reconsidered: self.selection.reconsidered,
            hits: count(|report| report.clearance.is_some() && report.score.is_none()),
            clean: count(|report| report.score.is_some()),
        }
    }
}

fn late_path(baked: &BakedGraph, path: PathId, error: RateError) -> CandidateReport {
    CandidateReport {
        route: Route::Table(path),
        evasion: Some(baked.path_evasion(path).edge),
        entry: None,
        layer: None,
        rate: Err(error),
        overlap: None,
        clearance: None,
        score: None,
        warp: None,
        result: CandidateResult::NotInTime,
    }
}
