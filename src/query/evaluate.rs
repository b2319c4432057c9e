//! Tests candidates exactly, as far as the choice depends on it.
//!
//! Source: Masaoka & Oshita, section 5.4. Differs: V_d is never below 0, so the other two terms are a lower bound of the score. A
//! candidate whose bound is no better than the best score so far is not tested. Other candidates are tested only until it is known
//! whether they are hit, or come near enough to win.

use super::candidate_tests::{Bound, Results, Tests};
use super::clearance::{Clearance, MotionBody};
use super::entries::EntryScratch;
use super::evaluated::Evaluated;
use super::evaluation::Evaluation;
use super::evaluation_input::EvaluationInput;
use super::score::Score;
use super::state::QueryState;
use super::warp::{Tested, WarpCase, Warper};
use crate::graph::Motion;

/// Scratch of the stage.
#[derive(Clone, Debug, Default)]
pub(super) struct EvaluateScratch {
    /// Candidates to be tested, each with a bound of its score.
    order: Vec<Bound>,
    results: Results,
    pub(super) entries: EntryScratch,
    warper: Warper,
}

impl EvaluateScratch {
    /// Discards all results, except those of known hits.
    pub(super) fn start(&mut self, state: &QueryState) {
        self.entries.start();
        let results = &mut self.results;
        results.hits.clear();
        let (evaluated, candidates) = (&mut results.evaluated, &state.candidates);
        evaluated.clear();
        evaluated.resize(candidates.counted, None);
        evaluated.extend(candidates.known.iter().map(|hit| hit.evaluated));
    }

    /// The memory of exact tests on the caller's thread.
    pub(super) fn body(&mut self) -> &mut MotionBody {
        self.results.workers.body()
    }

    /// Removes all poses.
    pub(super) fn forget_poses(&mut self) {
        self.results.workers.forget();
    }

    /// The scratch of the entries, and the body on which the natural motion is tested.
    pub(super) fn for_entries(&mut self) -> (&mut EntryScratch, &mut MotionBody) {
        (&mut self.entries, self.results.workers.body())
    }

    /// Result of each candidate.
    pub(super) fn evaluated(&self) -> &[Option<Evaluated>] {
        &self.results.evaluated
    }
}

/// The evaluate stage: tests candidates, those with the lowest bound first.
pub(super) struct ExactEvaluator<'s, 'a> {
    order: &'s mut Vec<Bound>,
    warper: &'s mut Warper,
    tests: Tests<'s, 'a>,
}

impl<'s, 'a> ExactEvaluator<'s, 'a> {
    /// Prepares the stage. Existing results of `scratch` are kept.
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
        !self.has_clean()
            || !self.tests.is_bounded()
            || self.tests.best_score() > Score::least_of_a_move(weights)
    }

    /// Tests candidates without a result in the order of their bounds, as far as the choice depends on them.
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
        // Usually one of the first few candidates is clean.
        let (first, rest) = order.split_at(order.len().min(Tests::ALONE));
        tests.possible_winners(first);
        let tested = tests.until_clean(rest);
        tests.possible_winners(&rest[tested..]);
        while tests.settle_near_ties() {
            tests.possible_winners(order);
        }
    }

    /// Warps one of the shallowest hits so that it is clean, the shallowest first, and writes its motion to `motion`. Returns its index, or
    /// `None` if no hit can be made clean.
    pub(super) fn warp(&mut self, motion: &mut Motion) -> Option<usize> {
        let _span = tracing::trace_span!("query: warp").entered();
        let Self {
            order,
            tests,
            warper,
        } = self;
        let (input, results) = (tests.input, &mut *tests.results);
        let (settings, request) = (&input.query.settings, &input.state.request);
        least_deep_first(order, &results.evaluated);
        let is_free = |bound: &Bound| {
            // If there are obstacles, only hits that enter none were measured.
            let one = results.evaluated[bound.index];
            !input.is_among_obstacles() || one.is_some_and(|one| one.is_final)
        };
        order.retain(is_free);
        order.truncate(settings.warp.candidates);
        let case = WarpCase {
            baked: input.query.baked,
            attack: &request.attack,
            settings: &settings.warp,
        };
        let plain = WarpCase {
            attack: &request.plain,
            ..case
        };
        let turns = [(case, 0.0), (plain, request.margin)];
        let turns = turns
            .into_iter()
            .take(if request.margin > 0.0 { 2 } else { 1 });
        for (case, margin) in turns {
            for &Bound { value, index } in order.iter() {
                let hit = results.evaluated[index].map(|one| one.clearance)?;
                if -value - margin > settings.warp.deepest {
                    break;
                }
                input.motion(index, motion);
                if value + margin >= 0.0 {
                    // The attack without the margin misses the motion without a warp.
                    return Some(index);
                }
                let tested = Tested {
                    clearance: Clearance {
                        metres: hit.metres + margin,
                        ..hit
                    },
                    body: results.workers.body(),
                };
                let Some(warped) = warper.warp(case, motion, tested) else {
                    continue;
                };
                let body = results.workers.body();
                if input.entered(motion, 0.0, body).is_some() {
                    continue;
                }
                // The clearance of the request's attack, which is larger by the margin.
                let clearance = Clearance {
                    metres: warped.clearance.metres - margin,
                    ..warped.clearance
                };
                let score = input.score(index, clearance.metres);
                results.evaluated[index] = Some(Evaluated {
                    clearance,
                    score: Some(score.warped(warped.effort, &settings.weights)),
                    is_final: true,
                    warp: motion.warp().copied(),
                });
                return Some(index);
            }
        }
        None
    }

    /// Warps the chosen candidate, which is clean and whose motion is `motion`, if the settings ask for a larger or a smaller clearance.
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
        let is_far = settings
            .widest
            .is_some_and(|widest| before.clearance.metres > widest);
        let tested = Tested {
            clearance: before.clearance,
            body: results.workers.body(),
        };
        let warped = match (is_near, is_far) {
            (true, _) => warper.warp(case, motion, tested),
            (_, true) => warper.lessen(case, motion, tested),
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
        let body = results.workers.body();
        if !gains || input.entered(motion, 0.0, body).is_some() {
            motion.set_warp(None);
            return;
        }
        results.evaluated[chosen] = Some(Evaluated {
            clearance: warped.clearance,
            score: Some(score),
            is_final: true,
            warp: motion.warp().copied(),
        });
    }

    /// Finds the hit with the largest clearance, for queries without a clean candidate. The known clearance of a hit is an upper bound, because
    /// over the whole attack it can only be smaller.
    pub(super) fn measure_least_deep_hit(&mut self) {
        let Self { order, tests, .. } = self;
        let is_among_obstacles = tests.input.is_among_obstacles();
        let is_exhaustive = tests.input.state.request.evaluation == Evaluation::Exhaustive;
        if is_exhaustive && !is_among_obstacles {
            return;
        }
        least_deep_first(order, &tests.results.evaluated);
        let count = tests.input.query.settings.warp.candidates.max(1);
        if is_among_obstacles {
            tests.least_deep_free(order, count);
            return;
        }
        tests.least_deep(order, count);
        tests.settle_hits();
    }

    /// The clean candidate with the lowest score, or if none is clean, the hit with the largest clearance. Ties are decided by the index.
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

    /// Runs [`Tests::confirm`].
    pub(super) fn confirm(&mut self, chosen: usize, motion: &mut Motion) -> bool {
        self.tests.confirm(chosen, motion)
    }
}

/// Lists the tested candidates, the one with the largest clearance first.
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
