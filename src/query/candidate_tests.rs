//! The exact tests of the candidates of one query.

use super::candidate::CandidateKind;
use super::clearance::{Clearance, ExactTest, Extent, Sampling};
use super::evaluated::Evaluated;
use super::evaluation::Evaluation;
use super::evaluation_input::{EvaluationInput, worse};
use super::prefix_cache::PrefixCache;
use super::workers::{Batch, Workers};
use crate::graph::Motion;
use crate::math::thread_count;

/// A candidate and a bound of its score or clearance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bound {
    pub(super) value: f32,
    pub(super) index: usize,
}

/// Results and scratch of the tests.
#[derive(Clone, Debug, Default)]
pub(super) struct Results {
    /// Result of each candidate, or `None` if it was not tested.
    pub(super) evaluated: Vec<Option<Evaluated>>,
    pub(super) workers: Workers,
    /// Results of moves that are hit.
    pub(super) hits: PrefixCache,
    /// Clearances of the shallowest hits, the largest first.
    depths: Vec<f32>,
    /// Hits with bounds of their clearance at every fourth sample, the largest last.
    tight: Vec<Bound>,
}

/// The tests of one query.
pub(super) struct Tests<'s, 'a> {
    pub(super) input: EvaluationInput<'a>,
    pub(super) results: &'s mut Results,
}

/// Maximum change of the difference of two clearances between the two samplings, in metres. Between two samples a limb leaves its chord by
/// less than 2 mm ([`BodyTrack::RATE`](crate::maps::BodyTrack::RATE)).
pub(super) const NEAR_TIE: f32 = 0.004;

/// Clearance below which evasions are tested on their final motion, in metres.
///
/// The samples of a baked body track lie up to half a sample away from those of the motion that is played. Between two samples a
/// limb leaves its chord by less than 2 mm ([`BodyTrack::RATE`](crate::maps::BodyTrack::RATE)).
const CLOSE_CALL: f32 = 0.005;

impl Tests<'_, '_> {
    /// Number of candidates that one thread tests before several threads share the rest.
    pub(super) const ALONE: usize = 4;

    /// The lowest score so far; infinite if no candidate is clean.
    pub(super) fn best_score(&self) -> f32 {
        let scores = self.results.evaluated.iter().flatten();
        scores
            .filter_map(|one| one.score)
            .map(|score| score.total)
            .fold(f32::INFINITY, f32::min)
    }

    /// Whether V without V_d is a lower bound of the score. It is not if a negative weight rewards distance.
    pub(super) fn is_bounded(&self) -> bool {
        self.input.state.request.evaluation == Evaluation::Lazy
            && self.input.query.settings.weights.distance >= 0.0
    }

    /// Clearance below which a clean candidate with this bound scores better than `best` or is nearly tied with it, in metres.
    fn winning_clearance(&self, bound: f32, best: f32) -> f32 {
        let weight = self.input.query.settings.weights.distance;
        match self.is_bounded() && weight > 0.0 {
            true => (best - bound) / weight + NEAR_TIE,
            false => f32::INFINITY,
        }
    }

    /// Tests the candidates that may still win.
    pub(super) fn possible_winners(&mut self, order: &[Bound]) {
        let mut best = self.best_score();
        for &Bound { value, index } in order {
            if self.is_bounded() && value >= best + self.near_tie() {
                break;
            }
            if self.results.evaluated[index].is_some() {
                continue;
            }
            let extent = Extent {
                below: self.winning_clearance(value, best),
                ..Extent::UNTIL_HIT
            };
            let (input, results) = (&self.input, &mut *self.results);
            let body = results.workers.body();
            let test = || input.test(index, extent, body);
            let clearance = results.hits.get_or_test(input, index, test);
            if clearance.metres >= extent.below && best.is_finite() {
                continue;
            }
            let result = self.input.result(index, clearance);
            best = result.score.map_or(best, |score| best.min(score.total));
            self.results.evaluated[index] = Some(result);
        }
    }

    /// Tests candidates up to the first clean one, on several threads. Returns the number of tested candidates. The tests are independent until
    /// a candidate is clean. Moves are left out, because their tests share prefixes.
    pub(super) fn until_clean(&mut self, order: &[Bound]) -> usize {
        let input = self.input;
        let threads = thread_count(input.query.settings.threads);
        let is_move = |bound: &Bound| input.move_of(bound.index).is_some();
        let is_short = order.len() <= Self::ALONE;
        if threads == 1 || is_short || order.iter().any(is_move) || self.best_score().is_finite() {
            return 0;
        }
        let batch = Batch {
            threads,
            count: order.len(),
            test: |at: usize, body: &mut _| input.test(order[at].index, Extent::UNTIL_HIT, body),
            ends: Clearance::is_clean,
        };
        let found = self.results.workers.run(&batch);
        let found = found.iter().map_while(|found| *found);
        let mut tested = 0;
        for (bound, clearance) in order.iter().zip(found) {
            let result = input.result(bound.index, clearance);
            self.results.evaluated[bound.index] = Some(result);
            tested += 1;
            if clearance.is_clean() {
                break;
            }
        }
        tested
    }

    /// Tests every candidate at every sample, on several threads.
    pub(super) fn all(&mut self, order: &[Bound]) {
        let input = self.input;
        let batch = Batch {
            threads: thread_count(input.query.settings.threads),
            count: order.len(),
            test: |at: usize, body: &mut _| input.test_whole(order[at].index, body),
            ends: |_: &Clearance| false,
        };
        let found = self.results.workers.run(&batch);
        for (bound, found) in order.iter().zip(found) {
            let result = found.map(|found| input.result(bound.index, found));
            self.results.evaluated[bound.index] = result;
        }
    }

    /// Tests hits over the whole attack, at every sample, until the `count` shallowest hits are known. These do not depend on the evaluation, so
    /// that the same candidates are warped. Each bound is first tightened at every fourth sample.
    pub(super) fn least_deep(&mut self, order: &[Bound], count: usize) {
        let mut depths = std::mem::take(&mut self.results.depths);
        let mut tight = std::mem::take(&mut self.results.tight);
        depths.clear();
        tight.clear();
        let mut loose = order.iter().copied().peekable();
        loop {
            let enough = depths.get(count - 1).copied();
            let enough = enough.unwrap_or(f32::NEG_INFINITY) - NEAR_TIE;
            let best = tight.last().map_or(f32::NEG_INFINITY, |bound| bound.value);
            let next = loose.next_if(|bound| bound.value >= best.max(enough));
            if let Some(bound) = next {
                let value = match self.is_final(bound.index) {
                    true => bound.value,
                    false => self.tightened(bound, enough),
                };
                let at = tight.partition_point(|bound| bound.value <= value);
                tight.insert(at, Bound { value, ..bound });
                continue;
            }
            let Some(Bound { value, index }) = tight.pop().filter(|one| one.value >= enough) else {
                break;
            };
            let metres = match self.is_final(index) {
                true => value,
                false => self.depth(index, enough),
            };
            let at = depths.partition_point(|&depth| depth >= metres);
            if at < count {
                depths.insert(at, metres);
                depths.truncate(count);
            }
        }
        (self.results.depths, self.results.tight) = (depths, tight);
    }

    /// Finds the `count` shallowest hits that enter no obstacle and may be bent, and measures them. Hits that enter an obstacle keep a bound of
    /// their clearance.
    pub(super) fn least_deep_free(&mut self, order: &[Bound], count: usize) {
        /// Maximum number of hits that are examined.
        const MOST: usize = 16;
        let warp = &self.input.query.settings.warp;
        let deepest = warp.deepest + self.input.state.request.margin;
        let mut found = 0;
        for &Bound { value, index } in order.iter().take(MOST) {
            if found == count || -value > deepest {
                break;
            }
            let Some(before) = self.results.evaluated[index] else {
                continue;
            };
            let body = self.results.workers.body();
            let entered = self.input.candidate_entered(index, 0.0, body);
            if entered.is_some() {
                let clearance = worse(before.clearance, entered);
                self.results.evaluated[index] = Some(self.input.result(index, clearance));
                continue;
            }
            let build = |motion: &mut Motion| self.input.motion(index, motion);
            // Whether a bend avoids the attack is tested at every sample.
            let test = ExactTest {
                sampling: Sampling::CoarseFirst,
                ..self.input.exact_test(Extent::WHOLE)
            };
            let clearance = test.on_built_motion(body, build);
            self.results.evaluated[index] = Some(Evaluated {
                is_final: true,
                ..self.input.result(index, clearance)
            });
            found += 1;
        }
    }

    /// Whether a candidate's final motion was tested over the whole attack.
    fn is_final(&self, index: usize) -> bool {
        self.results.evaluated[index].is_some_and(|one| one.is_final)
    }

    /// Lowers the bound of a hit's clearance to its clearance at every fourth sample of the posed motion, if that is lower.
    fn tightened(&mut self, Bound { value, index }: Bound, enough: f32) -> f32 {
        let clearance = self.posed(index, enough, Sampling::CoarseFirst);
        // Fewer samples may overestimate the clearance, but the candidate stays a hit.
        if clearance.metres < value {
            self.results.evaluated[index] = Some(self.input.result(index, clearance));
        }
        clearance.metres.min(value)
    }

    /// The clearance of a posed motion. If it is below `enough`, the result may be larger than the exact clearance.
    fn depth(&mut self, index: usize, enough: f32) -> f32 {
        let clearance = self.posed(index, enough, Sampling::Each);
        self.results.evaluated[index] = Some(Evaluated {
            is_final: clearance.metres >= enough,
            ..self.input.result(index, clearance)
        });
        clearance.metres
    }

    /// Tests a posed motion over the whole attack, until its clearance is below `enough`.
    fn posed(&mut self, index: usize, enough: f32, sampling: Sampling) -> Clearance {
        let extent = Extent {
            enough,
            ..Extent::WHOLE
        };
        let input = self.input;
        let test = ExactTest {
            sampling,
            ..input.exact_test(extent)
        };
        let body = self.results.workers.body();
        test.on_built_motion(body, |motion| input.motion(index, motion))
    }

    /// Writes the chosen candidate's motion to `motion` and tests it, unless the candidate is an evasion that is not a
    /// [close call](CLOSE_CALL). Returns `false` if the candidate seemed clean but is hit.
    pub(super) fn confirm(&mut self, chosen: usize, motion: &mut Motion) -> bool {
        let state = self.input.state;
        self.input.motion(chosen, motion);
        let Some(before) = self.results.evaluated[chosen] else {
            return true;
        };
        let kind = state.candidates.list[chosen].kind;
        let is_evasion = matches!(kind, CandidateKind::Evasion { .. });
        let is_close = before.clearance.metres.abs() <= CLOSE_CALL;
        let is_exhaustive = state.request.evaluation == Evaluation::Exhaustive;
        if is_exhaustive || (is_evasion && !is_close) {
            return true;
        }
        let test = self.input.exact_test(Extent::WHOLE);
        let body = self.results.workers.body();
        let clearance = test.on_motion(motion, body);
        let entered = self.input.candidate_entered(chosen, f32::INFINITY, body);
        let clearance = worse(clearance, entered);
        self.results.evaluated[chosen] = Some(Evaluated {
            is_final: true,
            ..self.input.result(chosen, clearance)
        });
        clearance.is_clean() || !before.clearance.is_clean()
    }
}
