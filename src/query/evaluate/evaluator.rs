//! Tests candidates exactly, as far as the choice depends on it.
//!
//! Source: Masaoka & Oshita, section 5.4. Differs: V_d is never below 0, so the other two terms are a lower bound of the score. A candidate whose
//! bound is no better than the best score so far is not tested. Other candidates are tested only until it is known whether they are hit, or come
//! near enough to win.
//!
//! [`Evaluation::Lazy`] tests an evasion on its baked body track, whose samples lie up to half a sample away from those that
//! [`Evaluation::Exhaustive`] poses. If two scores differ by less than this error, their order would depend on the culling path. Such candidates are
//! tested again at the samples of the exhaustive test, so that all paths choose the same one.

use rustc_hash::FxHashMap;

use super::candidate::worse;
use super::workers::Workers;
use crate::graph::Motion;
use crate::maps::BodyTrack;
use crate::math::thread_count;
use crate::query::clearance::{Clearance, ExactTest, Extent, MotionBody, SAMPLE_RATE, Sampling};
use crate::query::gather::{CandidateKind, MoveId};
use crate::query::request::{Evaluation, Query};
use crate::query::score::{Evaluated, Score};
use crate::query::state::QueryState;

/// Tests the candidates of a query, and keeps their results. Its memory is reused from one query to the next.
#[derive(Clone, Debug, Default)]
pub(in crate::query) struct Evaluator {
    /// Candidates, each with a bound of its score or clearance.
    pub order: Vec<Bound>,
    /// Result of each candidate, or `None` if it was not tested.
    pub evaluated: Vec<Option<Evaluated>>,
    workers: Workers,
    /// Results of moves that are hit, by prefix: moves that begin with the same edges have the same hits until the prefix ends.
    hits: FxHashMap<MoveId, Clearance>,
    /// Clearances of the shallowest hits, the largest first.
    depths: Vec<f32>,
    /// Hits with bounds of their clearance at every fourth sample, the largest last.
    tight: Vec<Bound>,
}

/// A candidate and a bound of its score or clearance.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct Bound {
    pub value: f32,
    pub index: usize,
}

/// Maximum change of the difference of two clearances between the two samplings, in metres. Between two samples a limb leaves its chord by
/// less than 2 mm ([`BodyTrack::RATE`](crate::maps::BodyTrack::RATE)).
const NEAR_TIE: f32 = 0.004;

/// Clearance below which evasions are tested on their final motion, in metres.
///
/// The samples of a baked body track lie up to half a sample away from those of the motion that is played. Between two samples a
/// limb leaves its chord by less than 2 mm ([`BodyTrack::RATE`](crate::maps::BodyTrack::RATE)).
const CLOSE_CALL: f32 = 0.005;

/// Number of candidates that one thread tests before several threads share the rest.
const ALONE: usize = 4;

/// Maximum time from the time of a test's result to the last sample that the test reads, in seconds: to the end of the next interval.
const AHEAD: f32 = (2 * BodyTrack::INTERVAL + 1) as f32 / SAMPLE_RATE;

impl Evaluator {
    /// Discards all results, except those of known hits.
    pub(in crate::query) fn start(&mut self, state: &QueryState) {
        self.hits.clear();
        let (evaluated, candidates) = (&mut self.evaluated, &state.candidates);
        evaluated.clear();
        evaluated.resize(candidates.counted, None);
        evaluated.extend(candidates.known.iter().map(|hit| hit.evaluated));
    }

    /// The memory of exact tests on the caller's thread.
    pub(in crate::query) fn body(&mut self) -> &mut MotionBody {
        self.workers.body()
    }

    /// Removes all poses.
    pub(in crate::query) fn forget_poses(&mut self) {
        self.workers.forget();
    }

    /// Whether a tested candidate is clean.
    pub(in crate::query) fn has_clean(&self) -> bool {
        self.best_score().is_finite()
    }

    /// Whether a move could score better than the tested candidates.
    pub(in crate::query) fn can_moves_win(&self, query: Query<'_>, state: &QueryState) -> bool {
        let least = Score::least_of_a_move(&query.settings.weights);
        !self.has_clean() || !is_bounded(query, state) || self.best_score() > least
    }

    /// Tests candidates without a result in the order of their bounds, as far as the choice depends on them.
    pub(in crate::query) fn evaluate(
        &mut self,
        query: Query<'_>,
        state: &QueryState,
        candidates: impl Iterator<Item = usize>,
    ) {
        self.evaluated.resize(state.candidates.list.len(), None);
        let mut order = std::mem::take(&mut self.order);
        order.clear();
        order.extend(
            candidates
                .filter(|&index| self.evaluated[index].is_none())
                .map(|index| Bound {
                    value: state.score(query, index, 0.0).total,
                    index,
                }),
        );
        if state.request.evaluation == Evaluation::Exhaustive {
            self.test_all(query, state, &order);
        } else {
            order.sort_unstable_by(|a, b| a.value.total_cmp(&b.value).then(a.index.cmp(&b.index)));
            // Usually one of the first few candidates is clean.
            let (first, rest) = order.split_at(order.len().min(ALONE));
            self.test_possible_winners(query, state, first);
            let tested = self.test_until_clean(query, state, rest);
            self.test_possible_winners(query, state, &rest[tested..]);
            while self.settle_near_ties(query, state) {
                self.test_possible_winners(query, state, &order);
            }
        }
        self.order = order;
    }

    /// The lowest score so far; infinite if no candidate is clean.
    fn best_score(&self) -> f32 {
        let scores = self.evaluated.iter().flatten();
        scores
            .filter_map(|one| one.score)
            .map(|score| score.total)
            .fold(f32::INFINITY, f32::min)
    }

    /// Tests the candidates that may still win.
    fn test_possible_winners(&mut self, query: Query<'_>, state: &QueryState, order: &[Bound]) {
        let mut best = self.best_score();
        for &Bound { value, index } in order {
            if is_bounded(query, state) && value >= best + near_tie(query) {
                break;
            }
            if self.evaluated[index].is_some() {
                continue;
            }
            let extent = Extent {
                below: winning_clearance(query, state, value, best),
                ..Extent::UNTIL_HIT
            };
            let clearance = self.test_or_known(query, state, index, extent);
            if clearance.metres >= extent.below && best.is_finite() {
                continue;
            }
            let result = state.result(query, index, clearance);
            best = result.score.map_or(best, |score| best.min(score.total));
            self.evaluated[index] = Some(result);
        }
    }

    /// Tests a candidate, unless a prefix of it is known to be hit. A hit of a move is stored for the shortest prefix that decides it.
    fn test_or_known(
        &mut self,
        query: Query<'_>,
        state: &QueryState,
        index: usize,
        extent: Extent,
    ) -> Clearance {
        let path = state.move_of(index);
        let known = path.and_then(|path| {
            let mut prefixes = state.moves.prefixes(path);
            prefixes.find_map(|(prefix, _)| self.hits.get(&prefix).copied())
        });
        known.unwrap_or_else(|| {
            let result = state.test(query, index, extent, self.workers.body());
            if let Some(path) = path.filter(|_| !result.is_clean()) {
                let prefix = shortest_prefix(query, state, path, result.time + AHEAD);
                self.hits.insert(prefix, result);
            }
            result
        })
    }

    /// Tests candidates up to the first clean one, on several threads. Returns the number of tested candidates. The tests are independent until
    /// a candidate is clean. Moves are left out, because their tests share prefixes.
    fn test_until_clean(&mut self, query: Query<'_>, state: &QueryState, order: &[Bound]) -> usize {
        let threads = thread_count(query.settings.threads);
        let is_move = |bound: &Bound| state.move_of(bound.index).is_some();
        if threads == 1 || order.len() <= ALONE || order.iter().any(is_move) || self.has_clean() {
            return 0;
        }
        let test = |at: usize, body: &mut MotionBody| {
            state.test(query, order[at].index, Extent::UNTIL_HIT, body)
        };
        let found = self
            .workers
            .run(threads, order.len(), test, Clearance::is_clean);
        let found = found.iter().map_while(|found| *found);
        let mut tested = 0;
        for (bound, clearance) in order.iter().zip(found) {
            let result = state.result(query, bound.index, clearance);
            self.evaluated[bound.index] = Some(result);
            tested += 1;
            if clearance.is_clean() {
                break;
            }
        }
        tested
    }

    /// Tests every candidate at every sample, on several threads.
    fn test_all(&mut self, query: Query<'_>, state: &QueryState, order: &[Bound]) {
        let threads = thread_count(query.settings.threads);
        let test =
            |at: usize, body: &mut MotionBody| state.test_whole(query, order[at].index, body);
        let found = self.workers.run(threads, order.len(), test, |_| false);
        for (bound, found) in order.iter().zip(found) {
            let result = found.map(|found| state.result(query, bound.index, found));
            self.evaluated[bound.index] = result;
        }
    }

    /// Tests the candidates that are nearly tied with the best score again, and those that are hit by less than the error. Returns whether the best
    /// score has become so much worse that skipped candidates may win.
    fn settle_near_ties(&mut self, query: Query<'_>, state: &QueryState) -> bool {
        let before = self.best_score();
        let most = before + near_tie(query);
        let is_near = |index: usize, one: &Evaluated| match one.score {
            Some(score) => score.total <= most,
            None => {
                one.clearance.metres > -0.5 * NEAR_TIE
                    && state.score(query, index, 0.0).total <= most
            }
        };
        let (first, second) = {
            let mut near = self.tested().filter(|(index, one)| is_near(*index, one));
            (near.next(), near.next())
        };
        if let (Some((_, only)), None) = (first, second)
            && only.score.is_some()
        {
            return false;
        }
        self.settle_all(query, state, is_near);
        self.best_score() > most
    }

    /// Tests the hits that are nearly tied with the shallowest hit again.
    fn settle_hits(&mut self, query: Query<'_>, state: &QueryState) {
        let depths = self.tested().map(|(_, one)| one.clearance.metres);
        let least = depths.fold(f32::NEG_INFINITY, f32::max) - NEAR_TIE;
        let is_near = |one: &Evaluated| one.clearance.metres >= least;
        if self.tested().filter(|(_, one)| is_near(one)).count() > 1 {
            self.settle_all(query, state, |_, one| is_near(one));
        }
    }

    /// Tests all candidates for which `is_near` holds on their final motion over the whole attack, unless that was done. No test changes the
    /// result of another candidate.
    fn settle_all(
        &mut self,
        query: Query<'_>,
        state: &QueryState,
        is_near: impl Fn(usize, &Evaluated) -> bool,
    ) {
        for index in 0..self.evaluated.len() {
            let one = self.evaluated[index].filter(|one| is_near(index, one));
            if one.is_some_and(|one| !one.is_final) {
                let clearance = state.test_whole(query, index, self.workers.body());
                self.evaluated[index] = Some(Evaluated {
                    is_final: true,
                    ..state.result(query, index, clearance)
                });
            }
        }
    }

    /// The results so far, with the candidates' indices.
    fn tested(&self) -> impl Iterator<Item = (usize, Evaluated)> {
        let evaluated = self.evaluated.iter().enumerate();
        evaluated.filter_map(|(index, one)| Some((index, (*one)?)))
    }

    /// The clean candidate with the lowest score, or if none is clean, the hit with the largest clearance. Ties are decided by the index.
    pub(in crate::query) fn best(&self) -> usize {
        let smallest = |value: fn(&Evaluated) -> Option<f32>| {
            let evaluated = self.evaluated.iter().enumerate();
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
    /// [close call](CLOSE_CALL). Returns `false` if the candidate seemed clean but is hit.
    pub(in crate::query) fn confirm(
        &mut self,
        query: Query<'_>,
        state: &QueryState,
        chosen: usize,
        motion: &mut Motion,
    ) -> bool {
        state.motion(query, chosen, motion);
        let Some(before) = self.evaluated[chosen] else {
            return true;
        };
        let kind = state.candidates.list[chosen].kind;
        let is_evasion = matches!(kind, CandidateKind::Evasion { .. });
        let is_close = before.clearance.metres.abs() <= CLOSE_CALL;
        let is_exhaustive = state.request.evaluation == Evaluation::Exhaustive;
        if is_exhaustive || (is_evasion && !is_close) {
            return true;
        }
        let test = state.exact_test(query, Extent::WHOLE);
        let body = self.workers.body();
        let clearance = test.on_motion(motion, body);
        let entered = state.candidate_entered(query, chosen, f32::INFINITY, body);
        let clearance = worse(clearance, entered);
        self.evaluated[chosen] = Some(Evaluated {
            is_final: true,
            ..state.result(query, chosen, clearance)
        });
        clearance.is_clean() || !before.clearance.is_clean()
    }

    /// Lists the tested candidates in `order`, the one with the largest clearance first.
    pub(in crate::query) fn order_by_depth(&mut self) {
        let Self {
            order, evaluated, ..
        } = self;
        order.clear();
        order.extend(evaluated.iter().enumerate().filter_map(|(index, one)| {
            Some(Bound {
                value: one.as_ref()?.clearance.metres,
                index,
            })
        }));
        order.sort_unstable_by(|a, b| b.value.total_cmp(&a.value).then(a.index.cmp(&b.index)));
    }

    /// Finds the hit with the largest clearance, for queries without a clean candidate. The known clearance of a hit is an upper bound, because
    /// over the whole attack it can only be smaller.
    pub(in crate::query) fn measure_shallowest_hit(
        &mut self,
        query: Query<'_>,
        state: &QueryState,
    ) {
        let is_among_obstacles = state.request.is_among_obstacles();
        let is_exhaustive = state.request.evaluation == Evaluation::Exhaustive;
        if is_exhaustive && !is_among_obstacles {
            return;
        }
        self.order_by_depth();
        let order = std::mem::take(&mut self.order);
        let count = query.settings.warp.candidates.max(1);
        if is_among_obstacles {
            self.measure_free(query, state, &order, count);
        } else {
            self.measure_shallowest(query, state, &order, count);
            if !is_exhaustive {
                self.settle_hits(query, state);
            }
        }
        self.order = order;
    }

    /// Tests hits over the whole attack, at every sample, until the `count` shallowest hits are known. These do not depend on the evaluation, so
    /// that the same candidates are warped. Each bound is first tightened at every fourth sample.
    fn measure_shallowest(
        &mut self,
        query: Query<'_>,
        state: &QueryState,
        order: &[Bound],
        count: usize,
    ) {
        let mut depths = std::mem::take(&mut self.depths);
        let mut tight = std::mem::take(&mut self.tight);
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
                    false => self.tightened(query, state, bound, enough),
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
                false => self.depth(query, state, index, enough),
            };
            let at = depths.partition_point(|&depth| depth >= metres);
            if at < count {
                depths.insert(at, metres);
                depths.truncate(count);
            }
        }
        (self.depths, self.tight) = (depths, tight);
    }

    /// Finds the `count` shallowest hits that enter no obstacle and may be bent, and measures them. Hits that enter an obstacle keep a bound of
    /// their clearance.
    fn measure_free(
        &mut self,
        query: Query<'_>,
        state: &QueryState,
        order: &[Bound],
        count: usize,
    ) {
        /// Maximum number of hits that are examined.
        const MOST: usize = 16;
        let warp = &query.settings.warp;
        let deepest = warp.deepest + state.request.margin;
        let mut found = 0;
        for &Bound { value, index } in order.iter().take(MOST) {
            if found == count || -value > deepest {
                break;
            }
            let Some(before) = self.evaluated[index] else {
                continue;
            };
            let body = self.workers.body();
            let entered = state.candidate_entered(query, index, 0.0, body);
            if entered.is_some() {
                let clearance = worse(before.clearance, entered);
                self.evaluated[index] = Some(state.result(query, index, clearance));
                continue;
            }
            let build = |motion: &mut Motion| state.motion(query, index, motion);
            // Whether a bend avoids the attack is tested at every sample.
            let test = ExactTest {
                sampling: Sampling::CoarseFirst,
                ..state.exact_test(query, Extent::WHOLE)
            };
            let clearance = test.on_built_motion(body, build);
            self.evaluated[index] = Some(Evaluated {
                is_final: true,
                ..state.result(query, index, clearance)
            });
            found += 1;
        }
    }

    /// Whether a candidate's final motion was tested over the whole attack.
    fn is_final(&self, index: usize) -> bool {
        self.evaluated[index].is_some_and(|one| one.is_final)
    }

    /// Lowers the bound of a hit's clearance to its clearance at every fourth sample of the posed motion, if that is lower.
    fn tightened(
        &mut self,
        query: Query<'_>,
        state: &QueryState,
        Bound { value, index }: Bound,
        enough: f32,
    ) -> f32 {
        let clearance = self.posed(query, state, index, enough, Sampling::CoarseFirst);
        // Fewer samples may overestimate the clearance, but the candidate stays a hit.
        if clearance.metres < value {
            self.evaluated[index] = Some(state.result(query, index, clearance));
        }
        clearance.metres.min(value)
    }

    /// The clearance of a posed motion. If it is below `enough`, the result may be larger than the exact clearance.
    fn depth(&mut self, query: Query<'_>, state: &QueryState, index: usize, enough: f32) -> f32 {
        let clearance = self.posed(query, state, index, enough, Sampling::Each);
        self.evaluated[index] = Some(Evaluated {
            is_final: clearance.metres >= enough,
            ..state.result(query, index, clearance)
        });
        clearance.metres
    }

    /// Tests a posed motion over the whole attack, until its clearance is below `enough`.
    fn posed(
        &mut self,
        query: Query<'_>,
        state: &QueryState,
        index: usize,
        enough: f32,
        sampling: Sampling,
    ) -> Clearance {
        let extent = Extent {
            enough,
            ..Extent::WHOLE
        };
        let test = ExactTest {
            sampling,
            ..state.exact_test(query, extent)
        };
        let body = self.workers.body();
        test.on_built_motion(body, |motion| state.motion(query, index, motion))
    }
}

/// The shortest prefix of a move that lasts until `time`, in seconds since the query, or the whole path if it ends earlier.
fn shortest_prefix(query: Query<'_>, state: &QueryState, path: MoveId, time: f32) -> MoveId {
    let frame_rate = query.baked.graph().frame_rate();
    let lasts = |frames: u32| {
        let seconds = f64::from(frames) / frame_rate;
        state.request.wait + seconds as f32 >= time
    };
    let prefixes = state.moves.prefixes(path);
    let shortest = prefixes.take_while(|&(_, frames)| lasts(frames)).last();
    // The motion after the end of a path belongs to that path alone.
    shortest.map_or(path, |(prefix, _)| prefix)
}

/// Whether V without V_d is a lower bound of the score. It is not if a negative weight rewards distance.
fn is_bounded(query: Query<'_>, state: &QueryState) -> bool {
    state.request.evaluation == Evaluation::Lazy && query.settings.weights.distance >= 0.0
}

/// Maximum difference of scores that count as nearly tied.
fn near_tie(query: Query<'_>) -> f32 {
    query.settings.weights.distance.abs() * NEAR_TIE
}

/// Clearance below which a clean candidate with this bound scores better than `best` or is nearly tied with it, in metres.
fn winning_clearance(query: Query<'_>, state: &QueryState, bound: f32, best: f32) -> f32 {
    let weight = query.settings.weights.distance;
    match is_bounded(query, state) && weight > 0.0 {
        true => (best - bound) / weight + NEAR_TIE,
        false => f32::INFINITY,
    }
}
