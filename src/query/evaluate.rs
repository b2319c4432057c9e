//! The exact test of candidates, as far as the choice needs it.
//!
//! Source: Masaoka & Oshita, section 5.4. Differs: V_d is never below 0, so the other two terms are a lower bound of the score. A
//! candidate whose bound is no better than the best score so far is not tested. Other candidates are tested only until it is known
//! whether they are hit, or come near enough to win.

use super::candidate::CandidateKind;
use super::clearance::{Clearance, Extent};
use super::entries::EntryScratch;
use super::evaluated::Evaluated;
use super::evaluation::Evaluation;
use super::evaluation_input::EvaluationInput;
use super::near_ties::NEAR_TIE;
use super::prefix_cache::{PrefixCache, PrefixTest};
use super::score::Score;
use super::state::QueryState;
use super::warp::{WarpCase, Warper};
use super::workers::{Batch, Workers};
use crate::graph::Motion;
use crate::math::thread_count;

/// Scratch of the stage.
#[derive(Clone, Debug, Default)]
pub(super) struct EvaluateScratch {
    /// The candidates to be tested, each with the bound of its score.
    order: Vec<Bound>,
    results: Results,
    pub(super) entries: EntryScratch,
    warper: Warper,
}

/// A candidate and a bound of its score or clearance.
#[derive(Clone, Copy, Debug)]
struct Bound {
    value: f32,
    index: usize,
}

/// The results of the tests, and the memory of testing.
#[derive(Clone, Debug, Default)]
pub(super) struct Results {
    /// By candidate; `None` for those that were not tested.
    pub(super) evaluated: Vec<Option<Evaluated>>,
    pub(super) workers: Workers,
    /// Moves that are hit.
    hits: PrefixCache,
    /// Moves that were tested over the whole attack.
    wholes: PrefixCache,
    /// The clearances of the least deep hits, the largest first.
    depths: Vec<f32>,
}

impl EvaluateScratch {
    /// Forgets all poses and results but those of known hits.
    pub(super) fn start(&mut self, state: &QueryState) {
        let results = &mut self.results;
        results.workers.clear();
        results.hits.clear();
        results.wholes.clear();
        let (evaluated, candidates) = (&mut results.evaluated, &state.candidates);
        evaluated.clear();
        evaluated.resize(candidates.counted, None);
        evaluated.extend(candidates.known.iter().map(|hit| hit.evaluated));
    }

    /// The results, by candidate.
    pub(super) fn evaluated(&self) -> &[Option<Evaluated>] {
        &self.results.evaluated
    }
}

/// The evaluate stage: tests candidates, the most promising first.
pub(super) struct ExactEvaluator<'s, 'a> {
    order: &'s mut Vec<Bound>,
    warper: &'s mut Warper,
    tests: Tests<'s, 'a>,
}

/// The tests of one query.
pub(super) struct Tests<'s, 'a> {
    pub(super) input: EvaluationInput<'a>,
    pub(super) results: &'s mut Results,
}

impl<'s, 'a> ExactEvaluator<'s, 'a> {
    /// Results that `scratch` already has are kept.
    pub(super) fn new(input: EvaluationInput<'a>, scratch: &'s mut EvaluateScratch) -> Self {
        let EvaluateScratch {
            order,
            results,
            warper,
            entries: _,
        } = scratch;
        let count = input.state.candidates.list.len();
        results.evaluated.resize(count, None);
        Self {
            order,
            warper,
            tests: Tests { input, results },
        }
    }

    /// Whether a tested candidate is clean.
    pub(super) fn has_clean(&self) -> bool {
        self.tests.best_score().is_finite()
    }

    /// Whether a move could score better than the tested candidates.
    pub(super) fn can_moves_win(&self) -> bool {
        let weights = &self.tests.input.query.settings.weights;
        !self.tests.is_bounded() || self.tests.best_score() > Score::least_of_a_move(weights)
    }

    /// Tests those candidates that have no result, in the order of their bounds, as far as it is needed.
    pub(super) fn evaluate(&mut self, candidates: impl Iterator<Item = usize>) {
        let Self { order, tests, .. } = self;
        let input = tests.input;
        order.clear();
        order.extend(
            candidates
                .filter(|&index| tests.results.evaluated[index].is_none())
                .map(|index| Bound {
                    value: input.score(index, 0.0).total,
                    index,
                }),
        );
        if input.state.request.evaluation == Evaluation::Exhaustive {
            tests.all(order);
            return;
        }
        order.sort_unstable_by(|a, b| a.value.total_cmp(&b.value).then(a.index.cmp(&b.index)));
        // Usually one of the first few is clean.
        let (first, rest) = order.split_at(order.len().min(Tests::ALONE));
        tests.possible_winners(first);
        let tested = tests.until_clean(rest);
        tests.possible_winners(&rest[tested..]);
        while tests.settle_near_ties() {
            tests.possible_winners(order);
        }
    }

    /// Bends one of the least deep hits so that it is clean, the least deep first, and leaves its motion in `motion`. Returns its
    /// position; `None` if none can be bent so.
    pub(super) fn warp(&mut self, motion: &mut Motion) -> Option<usize> {
        let Self {
            order,
            tests,
            warper,
        } = self;
        let (input, results) = (tests.input, &mut *tests.results);
        let settings = &input.query.settings;
        let case = WarpCase {
            baked: input.query.baked,
            attack: &input.state.request.attack,
            settings: &settings.warp,
        };
        least_deep_first(order, &results.evaluated);
        for &Bound { value, index } in order.iter().take(settings.warp.candidates) {
            let hit = results.evaluated[index].map(|one| one.clearance)?;
            if -value > settings.warp.deepest {
                break;
            }
            input.motion(index, motion);
            let Some(warped) = warper.warp(case, motion, (hit, results.workers.body())) else {
                continue;
            };
            let clearance = warped.clearance;
            let score = input.score(index, clearance.metres);
            results.evaluated[index] = Some(Evaluated {
                clearance,
                score: Some(score.warped(warped.effort, &settings.weights)),
                is_final: true,
                warp: motion.warp().copied(),
            });
            return Some(index);
        }
        None
    }

    /// Bends the chosen candidate, which is clean and whose motion is `motion`, where the settings ask for a larger or a smaller
    /// clearance.
    pub(super) fn adjust(&mut self, chosen: usize, motion: &mut Motion) {
        let Self { tests, warper, .. } = self;
        let (input, results) = (tests.input, &mut *tests.results);
        let weights = &input.query.settings.weights;
        let mut settings = input.query.settings.warp;
        let Some(before) = results.evaluated[chosen].filter(|one| one.score.is_some()) else {
            return;
        };
        let is_near = before.clearance.metres < settings.nearest;
        settings.margin = settings.margin.max(settings.nearest);
        let case = WarpCase {
            baked: input.query.baked,
            attack: &input.state.request.attack,
            settings: &settings,
        };
        let is_far = { settings.widest }.is_some_and(|widest| before.clearance.metres > widest);
        let test = (before.clearance, results.workers.body());
        let warped = match (is_near, is_far) {
            (true, _) => warper.warp(case, motion, test),
            (_, true) => warper.lessen(case, motion, test),
            _ => return,
        };
        let Some(warped) = warped else {
            return;
        };
        let metres = warped.clearance.metres;
        let score = input.score(chosen, metres).warped(warped.effort, weights);
        let gains = match is_near {
            true => metres > before.clearance.metres,
            false => before.score.is_some_and(|own| score.total < own.total),
        };
        if !gains {
            motion.bend(None);
            return;
        }
        results.evaluated[chosen] = Some(Evaluated {
            clearance: warped.clearance,
            score: Some(score),
            is_final: true,
            warp: motion.warp().copied(),
        });
    }

    /// Finds the hit with the largest clearance, for queries without a clean candidate. The clearance of a hit so far is a bound:
    /// over the whole attack it can only get smaller.
    pub(super) fn measure_least_deep_hit(&mut self) {
        let Self { order, tests, .. } = self;
        if tests.input.state.request.evaluation == Evaluation::Exhaustive {
            return;
        }
        least_deep_first(order, &tests.results.evaluated);
        let count = tests.input.query.settings.warp.candidates.max(1);
        tests.least_deep(order, count);
        tests.settle_hits();
    }

    /// The clean candidate with the smallest score; if none is clean, the hit with the largest clearance. Of equal ones the first.
    pub(super) fn best(&self) -> usize {
        let smallest = |value: fn(&Evaluated) -> Option<f32>| {
            let evaluated = self.tests.results.evaluated.iter().enumerate();
            evaluated
                .filter_map(|(index, one)| Some((index, value(one.as_ref()?)?)))
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .map(|(index, _)| index)
        };
        smallest(|one| one.score.map(|score| score.total))
            .or_else(|| smallest(|one| Some(-one.clearance.metres)))
            .unwrap_or(0)
    }

    /// Writes the chosen candidate's motion to `motion` and tests it, unless the candidate is an evasion that is not a
    /// [close call](CLOSE_CALL). Returns false if the candidate seemed clean and is hit.
    pub(super) fn confirm(&mut self, chosen: usize, motion: &mut Motion) -> bool {
        self.tests.confirm(chosen, motion)
    }
}

/// The tested candidates, the largest clearance first.
fn least_deep_first(order: &mut Vec<Bound>, evaluated: &[Option<Evaluated>]) {
    order.clear();
    order.extend(evaluated.iter().enumerate().filter_map(|(index, one)| {
        Some(Bound {
            value: one.as_ref()?.clearance.metres,
            index,
        })
    }));
    order.sort_unstable_by(|a, b| b.value.total_cmp(&a.value).then(a.index.cmp(&b.index)));
}

/// Evasions within this clearance are tested on their final motion, metres.
///
/// The samples of a baked body track lie up to half a sample away from those of the motion that is played. Between two samples a
/// limb leaves its chord by less than 2 mm ([`BodyTrack::RATE`](crate::maps::BodyTrack::RATE)).
const CLOSE_CALL: f32 = 0.005;

impl Tests<'_, '_> {
    /// Number of candidates that one thread tests before several threads share the rest.
    const ALONE: usize = 4;

    /// The best score so far; infinite if no candidate is clean.
    pub(super) fn best_score(&self) -> f32 {
        let scores = self.results.evaluated.iter().flatten();
        scores
            .filter_map(|one| one.score)
            .map(|score| score.total)
            .fold(f32::INFINITY, f32::min)
    }

    /// Whether V without V_d is a lower bound of the score. A negative weight rewards distance.
    fn is_bounded(&self) -> bool {
        self.input.state.request.evaluation == Evaluation::Lazy
            && self.input.query.settings.weights.distance >= 0.0
    }

    /// The clearance below which a clean candidate with this bound scores better than `best` or is nearly tied with it, metres.
    fn winning_clearance(&self, bound: f32, best: f32) -> f32 {
        let weight = self.input.query.settings.weights.distance;
        match self.is_bounded() && weight > 0.0 {
            true => (best - bound) / weight + NEAR_TIE,
            false => f32::INFINITY,
        }
    }

    /// Tests the candidates that may still win.
    fn possible_winners(&mut self, order: &[Bound]) {
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
            let test = PrefixTest {
                index,
                test: || input.test(index, extent, body),
                decided_at: |found: &Clearance| (!found.is_clean()).then_some(found.time),
            };
            let clearance = results.hits.get_or_eval(input, test);
            if clearance.metres >= extent.below && best.is_finite() {
                continue;
            }
            let result = self.input.result(index, clearance);
            best = result.score.map_or(best, |score| best.min(score.total));
            self.results.evaluated[index] = Some(result);
        }
    }

    /// Tests candidates up to the first clean one, on several threads; returns how many. The tests are independent as long as none
    /// is clean. Moves are left out, since their tests share prefixes.
    fn until_clean(&mut self, order: &[Bound]) -> usize {
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
    fn all(&mut self, order: &[Bound]) {
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

    /// Tests hits over the whole attack, at every sample, until the `count` least deep ones are known. These are the same for
    /// every evaluation, so that what is bent is the same too.
    fn least_deep(&mut self, order: &[Bound], count: usize) {
        let mut depths = std::mem::take(&mut self.results.depths);
        depths.clear();
        for &Bound { value, index } in order {
            let last = depths.get(count - 1).copied();
            let enough = last.unwrap_or(f32::NEG_INFINITY) - NEAR_TIE;
            if value < enough {
                break;
            }
            let mut metres = value;
            if !self.results.evaluated[index].is_some_and(|one| one.is_final) {
                let clearance = self.whole(index, enough);
                metres = clearance.metres;
                self.results.evaluated[index] = Some(Evaluated {
                    is_final: metres >= enough,
                    ..self.input.result(index, clearance)
                });
            }
            let at = depths.partition_point(|&depth| depth >= metres);
            if at < count {
                depths.insert(at, metres);
                depths.truncate(count);
            }
        }
        self.results.depths = depths;
    }

    /// The clearance of a posed motion over the whole attack. It may be larger where it is below `enough`.
    fn whole(&mut self, index: usize, enough: f32) -> Clearance {
        let extent = Extent {
            enough,
            ..Extent::WHOLE
        };
        let (input, results) = (&self.input, &mut *self.results);
        let body = results.workers.body();
        let build = |motion: &mut Motion| input.motion(index, motion);
        let test = PrefixTest {
            index,
            test: || input.exact_test(extent).on_built_motion(body, build),
            decided_at: |_: &Clearance| Some(input.state.request.attack.end()),
        };
        results.wholes.get_or_eval(input, test)
    }

    /// See [`ExactEvaluator::confirm`].
    fn confirm(&mut self, chosen: usize, motion: &mut Motion) -> bool {
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
        let clearance = test.on_shared_motion(motion, self.results.workers.body());
        self.results.evaluated[chosen] = Some(Evaluated {
            is_final: true,
            ..self.input.result(chosen, clearance)
        });
        clearance.is_clean() || !before.clearance.is_clean()
    }
}
