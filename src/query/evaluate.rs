//! Tests candidates exactly, as far as the choice depends on it.
//!
//! Source: Masaoka & Oshita, section 5.4. A candidate is tested against the attack and the obstacles ([`clearance`](super::clearance)) and
//! gets a [`Score`]. Differs: V_d is never below 0, so the other two terms are a lower bound of the score. A candidate whose bound is no
//! better than the best score so far is not tested. Other candidates are tested only until it is known whether they are hit, or come
//! near enough to win.
//!
//! [`Evaluation::Lazy`] tests an evasion on its baked body track, whose samples lie up to half a sample away from those that
//! [`Evaluation::Exhaustive`] poses. If two scores differ by less than this error, their order would depend on the culling path. Such
//! candidates are tested again at the samples of the exhaustive test, so that all paths choose the same one.

use glam::Vec3Swizzles;
use rustc_hash::FxHashMap;

use super::clearance::{
    Clearance, ExactTest, Extent, MotionBody, ObstacleHit, ObstacleTest, SAMPLE_RATE, Sampling,
};
use super::gather::{CandidateKind, CandidateList, EntryCandidate, MoveId};
use super::request::{Evaluation, Query};
use super::retime::retimed;
use super::score::{Evaluated, Push, Score};
use super::state::QueryState;
use super::workers::Workers;
use crate::anim::EventKind;
use crate::graph::{EdgeId, Motion, MotionGraph, MotionStep};
use crate::maps::{BodyTrack, PathId};
use crate::math::thread_count;

/// One round of a query: its candidates, and what a culling path counted of them.
#[derive(Clone, Copy)]
pub(super) struct Round<'a> {
    pub query: Query<'a>,
    pub state: &'a QueryState,
}

impl Round<'_> {
    /// How hard the body may push off. An attack whose contact is not known is not urgent.
    fn allowed_push(self) -> f32 {
        let contact = self.state.contact.unwrap_or(f32::INFINITY);
        let settings = self.query.settings;
        settings.allowed_push(self.query.baked, contact)
    }

    /// The score of a candidate at a clearance of `metres`.
    pub(super) fn score(self, index: usize, metres: f32) -> Score {
        let candidates = &self.state.candidates;
        let candidate = &candidates.list[index];
        let overlap = candidates.overlap(index).unwrap_or_default();
        Score::new(
            self.region_texels(index),
            overlap.evasion,
            metres,
            candidate.rate.rate,
            matches!(candidate.kind, CandidateKind::Layer(_)),
            &self.query.settings.weights,
        )
        .towards(
            candidates.goals.get(index).copied().unwrap_or(0.0),
            &self.query.settings.weights,
        )
    }

    /// V_g of a candidate, whose motion is written to `motion`.
    pub(super) fn goal(self, index: usize, motion: &mut Motion) -> f32 {
        const MOST: f32 = 2.0;
        /// A goal within this distance does not count, in metres.
        const NEAR: f32 = 0.1;
        let request = &self.state.request;
        let way = request.velocity * request.attack.end();
        if way.length() < NEAR || self.query.settings.weights.goal == 0.0 {
            return 0.0;
        }
        self.motion(index, motion);
        let graph = self.query.baked.graph();
        let [from, to] = [0.0, request.attack.end()].map(|t| motion.root(graph, t).xz());
        ((to - from - way).length() / way.length()).min(MOST)
    }

    fn result(self, index: usize, clearance: Clearance) -> Evaluated {
        let score = || self.score(index, clearance.metres);
        Evaluated {
            score: clearance.is_clean().then(score),
            ..Evaluated::hit(clearance)
        }
    }

    /// The result of a candidate whose final motion was tested.
    fn final_result(self, index: usize, clearance: Clearance) -> Evaluated {
        Evaluated {
            is_final: true,
            ..self.result(index, clearance)
        }
    }

    /// Whether V without V_d is a lower bound of the score. It is not if a negative weight rewards distance.
    fn is_bounded(self) -> bool {
        let is_lazy = self.state.request.evaluation == Evaluation::Lazy;
        is_lazy && self.query.settings.weights.distance >= 0.0
    }

    /// Maximum difference of scores that count as nearly tied.
    fn near_tie(self) -> f32 {
        self.query.settings.weights.distance.abs() * NEAR_TIE
    }

    /// Clearance below which a clean candidate with this bound scores better than `best` or is nearly tied with it, in metres.
    fn winning_clearance(self, bound: f32, best: f32) -> f32 {
        let weight = self.query.settings.weights.distance;
        match self.is_bounded() && weight > 0.0 {
            true => (best - bound) / weight + NEAR_TIE,
            false => f32::INFINITY,
        }
    }

    /// Number of texels of a candidate's evasion region in the slabs that the attack touches.
    fn region_texels(self, index: usize) -> u32 {
        let maps = &self.state.maps;
        let Some(candidate) = maps.candidates.get(index) else {
            return 0;
        };
        let texels = |slab| self.query.baked.evasion_texels(candidate.region, slab);
        maps.slabs(index).map(texels).sum()
    }

    fn exact_test(&self, extent: Extent, sampling: Sampling) -> ExactTest<'_> {
        ExactTest {
            baked: self.query.baked,
            attack: &self.state.request.attack,
            extent,
            sampling,
        }
    }

    /// Tests a candidate's posed motion against the attack alone.
    fn test_posed(
        self,
        index: usize,
        extent: Extent,
        sampling: Sampling,
        body: &mut MotionBody,
    ) -> Clearance {
        let test = self.exact_test(extent, sampling);
        test.on_built_motion(body, |motion| self.motion(index, motion))
    }

    /// Tests a candidate. Obstacles are tested exactly only if the attack misses it, because that is cheaper.
    fn test(self, index: usize, extent: Extent, body: &mut MotionBody) -> Clearance {
        let request = &self.state.request;
        let is_among_obstacles = request.is_among_obstacles();
        if is_among_obstacles && self.state.move_of(index).is_some() {
            // The root may enter an obstacle.
            let motion = &mut body.among_obstacles;
            self.motion(index, motion);
            let end = motion.moment_at(request.attack.end());
            let graph = self.query.baked.graph();
            if let Some(hit) = request.obstacles.until(graph, end, 0.0) {
                return hit.as_clearance();
            }
        }
        let clearance = self.test_attack(index, extent, body);
        let may_win = clearance.is_clean() && clearance.metres < extent.below;
        if !is_among_obstacles || !may_win {
            return clearance;
        }
        worse(clearance, self.candidate_entered(index, 0.0, body))
    }

    fn evasion_edge(self, path: PathId) -> EdgeId {
        let goal = self.state.request.path(path).goal;
        self.query.baked.evasions()[goal as usize].edge
    }

    /// Tests a candidate against the attack alone. An evasion is tested on its baked body track, and what is posed, such as a move, at every
    /// fourth sample first.
    fn test_attack(self, index: usize, extent: Extent, body: &mut MotionBody) -> Clearance {
        let (state, baked) = (self.state, self.query.baked);
        let mut moved = (0.0, 0.0);
        let (track, sampling) = match state.candidates.list[index].kind {
            CandidateKind::Evasion { path, start } => {
                // The track is that of a body without offset, but for feet that are held.
                let (blend, graph) = (&state.request.blend, baked.graph());
                let lifted = graph.first_lifts(self.evasion_edge(path), start);
                let held = blend.held_feet_moved(start, &lifted);
                moved = held.unwrap_or_default();
                let track = held.map(|_| state.request.evasion(baked, path, start));
                (track, Sampling::CoarseFirst)
            }
            CandidateKind::Entry(entry) => {
                // The chosen candidate is tested again at every sample.
                let sampling = match state.request.is_among_obstacles() {
                    true => Sampling::CoarseFirst,
                    false => Sampling::Each,
                };
                let entry = &state.candidates.entries[entry as usize];
                (Some(entry.played_track(baked)), sampling)
            }
            CandidateKind::Move(_) | CandidateKind::Layer(_) => (None, Sampling::CoarseFirst),
        };
        let Some(track) = track else {
            return self.test_posed(index, extent, sampling, body);
        };
        let test = self.exact_test(extent, sampling);
        test.on_track_with_held_feet(&track, moved, body, |motion| self.motion(index, motion))
    }

    /// The most harmful entry of a candidate into an obstacle. The search stops at a harm above `enough`, in metres.
    fn candidate_entered(
        self,
        index: usize,
        enough: f32,
        body: &mut MotionBody,
    ) -> Option<ObstacleHit> {
        if !self.state.request.is_among_obstacles() {
            return None;
        }
        let mut motion = std::mem::take(&mut body.among_obstacles);
        self.motion(index, &mut motion);
        let hit = self.entered(&mut motion, enough, body);
        body.among_obstacles = motion;
        hit
    }

    /// The most harmful entry of a motion into an obstacle until the attack and its evasions have ended, or one above `enough`.
    pub(super) fn entered(
        self,
        motion: &mut Motion,
        enough: f32,
        body: &mut MotionBody,
    ) -> Option<ObstacleHit> {
        let (baked, request) = (self.query.baked, &self.state.request);
        if !request.is_among_obstacles() {
            return None;
        }
        let end = evasions_end(baked.graph(), motion, request.attack.end());
        motion.extend(baked.graph(), end);
        let until = motion.moment_at(end);
        let quick = request.obstacles.until(baked.graph(), until, enough);
        quick.or_else(|| {
            let test = ObstacleTest {
                baked,
                obstacles: &request.obstacles.obstacles,
                seconds: (0.0, end),
                enough,
            };
            body.worst_entry(&test, motion)
        })
    }

    /// Tests a candidate's whole motion, posed at every sample over the whole attack.
    fn test_whole(self, index: usize, body: &mut MotionBody) -> Clearance {
        let clearance = self.test_posed(index, Extent::WHOLE, Sampling::Each, body);
        worse(
            clearance,
            self.candidate_entered(index, f32::INFINITY, body),
        )
    }

    /// Clearance below which a hit is of no use, in metres: no warp makes it clean.
    fn useful(self) -> f32 {
        let request = &self.state.request;
        let deepest = self.query.settings.warp.deepest + request.margin;
        let is_used = !request.is_plan || request.is_among_obstacles();
        if is_used { f32::NEG_INFINITY } else { -deepest }
    }

    /// Writes a candidate's whole motion, from now until one sample after the attack's end or later.
    pub(super) fn motion(self, index: usize, motion: &mut Motion) {
        let (baked, graph) = (self.query.baked, self.query.baked.graph());
        let (state, request) = (self.state, &self.state.request);
        let candidate = &state.candidates.list[index];
        match candidate.kind {
            CandidateKind::Evasion { path, .. } => {
                let steps = retimed(baked, candidate.rate, baked.paths().edges(path));
                let edge = self.evasion_edge(path);
                let evasion = MotionStep { edge, rate: 1.0 };
                motion.restart(graph, request.playhead, steps.chain([evasion]));
            }
            CandidateKind::Move(path) => {
                motion.restart(graph, request.playhead, []);
                let mut push = |edge| motion.push(graph, MotionStep { edge, rate: 1.0 });
                state.moves.for_each_edge(path, &mut push);
            }
            CandidateKind::Entry(_) | CandidateKind::Layer(_) => {
                motion.restart(graph, request.playhead, []);
            }
        }
        motion.continue_blend(&request.blend, 0.0);
        if let CandidateKind::Evasion { path, start } = candidate.kind {
            motion.release_feet(&graph.first_lifts(self.evasion_edge(path), start));
        }
        if let CandidateKind::Entry(entry) = candidate.kind {
            let EntryCandidate { delay, entry, .. } = &state.candidates.entries[entry as usize];
            motion.enter(graph, *delay, entry);
        }
        if let CandidateKind::Layer(layer) = candidate.kind {
            let layer = state.candidates.layers[layer as usize].layer;
            motion.set_layer(Some(layer));
            motion.extend(graph, layer.end());
        }
        motion.extend(graph, request.attack.end() + 2.0 / SAMPLE_RATE);
    }
}

/// The clearance, or that of an obstacle hit if it is smaller.
fn worse(clearance: Clearance, hit: Option<ObstacleHit>) -> Clearance {
    match hit {
        Some(hit) if -hit.harm < clearance.metres => hit.as_clearance(),
        _ => clearance,
    }
}

/// Tests the candidates of a query, and keeps their results. Its memory is reused from one query to the next.
#[derive(Clone, Debug, Default)]
pub(super) struct Evaluator {
    /// Candidates, each with a bound of its score or clearance.
    pub order: Vec<Bound>,
    /// Result of each candidate, or `None` if it was not tested.
    pub evaluated: Vec<Option<Evaluated>>,
    workers: Workers,
    /// How hard the body pushes if it goes on as it is, in metres per second squared; `None` before it is known.
    natural_push: Option<f32>,
    natural: Motion,
    /// Results of moves that are hit, by prefix: moves that begin with the same edges have the same hits until the prefix ends.
    hits: FxHashMap<MoveId, Clearance>,
    /// Clearances of the shallowest hits, the largest first.
    depths: Vec<f32>,
    /// Hits with bounds of their clearance at every fourth sample, the largest last.
    tight: Vec<Bound>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Bound {
    pub value: f32,
    pub index: usize,
}

/// Maximum change of the difference of two clearances between the two samplings, in metres. Between two samples a limb leaves its chord by
/// less than 2 mm ([`BodyTrack::RATE`](crate::maps::BodyTrack::RATE)).
const NEAR_TIE: f32 = 0.004;

/// Clearance below which evasions are tested on their final motion, in metres, because the samples of a baked body track lie up to half a
/// sample away from those of the played motion.
const CLOSE_CALL: f32 = 0.005;

/// Number of candidates that one thread tests before several threads share the rest.
const ALONE: usize = 4;

/// Maximum time from the time of a test's result to the last sample that the test reads, in seconds: to the end of the next interval.
const AHEAD: f32 = (2 * BodyTrack::INTERVAL + 1) as f32 / SAMPLE_RATE;

impl Evaluator {
    /// Discards all results, except those of known hits.
    pub(super) fn start(&mut self, candidates: &CandidateList) {
        self.hits.clear();
        self.natural_push = None;
        let evaluated = &mut self.evaluated;
        evaluated.clear();
        evaluated.resize(candidates.counted, None);
        evaluated.extend(candidates.known.iter().map(|hit| hit.evaluated));
    }

    /// The memory of exact tests on the caller's thread.
    pub(super) fn body(&mut self) -> &mut MotionBody {
        self.workers.body()
    }

    pub(super) fn forget_poses(&mut self) {
        self.workers.forget();
    }

    pub(super) fn has_clean(&self) -> bool {
        self.best_score().is_finite()
    }

    /// Whether a move could score better than the tested candidates.
    pub(super) fn can_moves_win(&self, round: Round<'_>) -> bool {
        let least = Score::least_of_a_move(&round.query.settings.weights);
        !self.has_clean() || !round.is_bounded() || self.best_score() > least
    }

    /// Tests candidates without a result in the order of their bounds, as far as the choice depends on them.
    pub(super) fn evaluate(&mut self, round: Round<'_>, candidates: impl Iterator<Item = usize>) {
        self.evaluated
            .resize(round.state.candidates.list.len(), None);
        let mut order = std::mem::take(&mut self.order);
        order.clear();
        order.extend(
            candidates
                .filter(|&index| self.evaluated[index].is_none())
                .map(|index| Bound {
                    value: round.score(index, 0.0).total,
                    index,
                }),
        );
        if round.state.request.evaluation != Evaluation::Lazy {
            self.test_in_parallel(round, &order, true);
        } else {
            order.sort_unstable_by(|a, b| a.value.total_cmp(&b.value).then(a.index.cmp(&b.index)));
            // Usually one of the first few candidates is clean.
            let (first, rest) = order.split_at(order.len().min(ALONE));
            self.test_possible_winners(round, first);
            // Tests of moves share prefixes.
            let is_move = |bound: &Bound| round.state.move_of(bound.index).is_some();
            let is_alone = thread_count(round.query.settings.threads) == 1 || rest.len() <= ALONE;
            if !is_alone && !rest.iter().any(is_move) && !self.has_clean() {
                self.test_in_parallel(round, rest, false);
            }
        }
        loop {
            if round.state.request.evaluation == Evaluation::Lazy {
                self.test_possible_winners(round, &order);
                // A plan has one culling path.
                while !round.state.request.is_plan && self.settle_near_ties(round) {
                    self.test_possible_winners(round, &order);
                }
            }
            // What was skipped because of a candidate that is refused may win.
            if !self.has_clean() || !self.pushes_too_hard(round, self.best()) {
                break;
            }
            if self.body().is_late() {
                self.refuse_unmeasured();
                break;
            }
        }
        self.order = order;
    }

    /// Tests candidates on several threads: all of them over the whole attack, or, as the tests are independent until a candidate is clean,
    /// up to the first clean one.
    fn test_in_parallel(&mut self, round: Round<'_>, order: &[Bound], whole: bool) {
        let threads = thread_count(round.query.settings.threads);
        let test = |at: usize, body: &mut MotionBody| match whole {
            true => round.test_whole(order[at].index, body),
            false => round.test(order[at].index, Extent::UNTIL_HIT, body),
        };
        let ends = |clearance: &Clearance| !whole && clearance.is_clean();
        let found = self.workers.run(threads, order.len(), test, ends);
        for (bound, clearance) in order.iter().zip(found.iter().map_while(|found| *found)) {
            self.evaluated[bound.index] = Some(round.result(bound.index, clearance));
            if ends(&clearance) {
                break;
            }
        }
    }

    /// The lowest score so far; infinite if no candidate is clean.
    fn best_score(&self) -> f32 {
        let scores = self.evaluated.iter().flatten();
        scores
            .filter_map(|one| one.score)
            .map(|score| score.total)
            .fold(f32::INFINITY, f32::min)
    }

    fn test_possible_winners(&mut self, round: Round<'_>, order: &[Bound]) {
        let mut best = self.best_score();
        for &Bound { value, index } in order {
            if round.is_bounded() && value >= best + round.near_tie() {
                break;
            }
            if self.evaluated[index].is_some() {
                continue;
            }
            let extent = Extent {
                below: round.winning_clearance(value, best),
                ..Extent::UNTIL_HIT
            };
            let clearance = self.test_or_known(round, index, extent);
            if clearance.metres >= extent.below && best.is_finite() {
                continue;
            }
            let result = round.result(index, clearance);
            best = result.score.map_or(best, |score| best.min(score.total));
            self.evaluated[index] = Some(result);
        }
    }

    /// Tests a candidate, unless a prefix of it is known to be hit. A hit of a move is stored for the shortest prefix that decides it.
    fn test_or_known(&mut self, round: Round<'_>, index: usize, extent: Extent) -> Clearance {
        let path = round.state.move_of(index);
        let known = path.and_then(|path| {
            let mut prefixes = round.state.moves.prefixes(path);
            prefixes.find_map(|(prefix, _)| self.hits.get(&prefix).copied())
        });
        known.unwrap_or_else(|| {
            let result = round.test(index, extent, self.workers.body());
            if let Some(path) = path.filter(|_| !result.is_clean()) {
                let prefix = shortest_prefix(round, path, result.time + AHEAD);
                self.hits.insert(prefix, result);
            }
            result
        })
    }

    /// Tests the candidates that are nearly tied with the best score again, and those that are hit by less than the error. Returns whether
    /// the best score has become so much worse that skipped candidates may win.
    fn settle_near_ties(&mut self, round: Round<'_>) -> bool {
        let before = self.best_score();
        let most = before + round.near_tie();
        let is_near = |index: usize, one: &Evaluated| match one.score {
            Some(score) => score.total <= most,
            None => one.clearance.metres > -0.5 * NEAR_TIE && round.score(index, 0.0).total <= most,
        };
        let mut near = self.tested().filter(|(index, one)| is_near(*index, one));
        let is_clean = near.next().is_some_and(|(_, one)| one.score.is_some());
        if is_clean && near.next().is_none() {
            return false;
        }
        drop(near);
        self.settle_all(round, is_near);
        self.best_score() > most
    }

    /// Tests the hits that are nearly tied with the shallowest hit again.
    fn settle_hits(&mut self, round: Round<'_>) {
        let depths = self.tested().map(|(_, one)| one.clearance.metres);
        let least = depths.fold(f32::NEG_INFINITY, f32::max) - NEAR_TIE;
        if least < round.useful() - 2.0 * NEAR_TIE {
            return;
        }
        let is_near = |one: &Evaluated| one.clearance.metres >= least;
        if self.tested().filter(|(_, one)| is_near(one)).count() > 1 {
            self.settle_all(round, |_, one| is_near(one));
        }
    }

    /// Tests all candidates for which `is_near` holds on their final motion over the whole attack, unless that was done. No test changes
    /// the result of another candidate.
    fn settle_all(&mut self, round: Round<'_>, is_near: impl Fn(usize, &Evaluated) -> bool) {
        for index in 0..self.evaluated.len() {
            let one = self.evaluated[index].filter(|one| !one.is_too_hard() && is_near(index, one));
            if one.is_some_and(|one| !one.is_final) {
                let clearance = round.test_whole(index, self.workers.body());
                self.evaluated[index] = Some(round.final_result(index, clearance));
            }
        }
    }

    /// The results so far of candidates that do not push too hard, with their indices.
    fn tested(&self) -> impl Iterator<Item = (usize, Evaluated)> {
        let evaluated = self.evaluated.iter().enumerate();
        let tested = evaluated.filter_map(|(index, one)| Some((index, (*one)?)));
        tested.filter(|(_, one)| !one.is_too_hard())
    }

    /// Refuses a candidate whose motion, `motion`, asks the body to push harder than allowed. Returns whether it is refused, now or before.
    pub(super) fn refuse(&mut self, round: Round<'_>, chosen: usize, motion: &mut Motion) -> bool {
        let (baked, request) = (round.query.baked, &round.state.request);
        let Some(tested) = self.evaluated[chosen] else {
            return false;
        };
        if tested.push != Push::Unmeasured {
            return tested.is_too_hard();
        }
        let end = evasions_end(baked.graph(), motion, request.attack.end());
        motion.extend(baked.graph(), end);
        let allowed = round.allowed_push();
        let mut limit = allowed;
        let mut found = self.workers.body().push(baked, None, motion, end, limit);
        if found > allowed {
            limit = self.push_limit(round);
        }
        if limit > allowed {
            found = self.workers.body().push(baked, None, motion, end, limit);
        }
        let (score, push) = match found > limit {
            true => (None, Push::TooHard(found)),
            false => (tested.score, Push::Allowed),
        };
        self.evaluated[chosen] = Some(Evaluated {
            score,
            push,
            ..tested
        });
        found > limit
    }

    /// Refuses all clean candidates of which it is not known how hard they push: there is no time to measure it.
    pub(super) fn refuse_unmeasured(&mut self) {
        for one in self.evaluated.iter_mut().flatten() {
            if one.score.is_some() && one.push == Push::Unmeasured {
                (one.score, one.push) = (None, Push::TooHard(f32::INFINITY));
            }
        }
    }

    /// How hard the body may push: as the settings say, or as it does anyway in the next moments, whatever it does then.
    pub(super) fn push_limit(&mut self, round: Round<'_>) -> f32 {
        let (baked, request) = (round.query.baked, &round.state.request);
        /// The next moments, in seconds; longer while the body is in a blend.
        const SOON: f32 = 0.2;
        let found = self.natural_push.unwrap_or_else(|| {
            let natural = &mut self.natural;
            natural.restart(baked.graph(), request.playhead, []);
            natural.continue_blend(&request.blend, 0.0);
            let end = request.attack.end().min(natural.blends_until().max(SOON));
            natural.extend(baked.graph(), end);
            let body = self.workers.body();
            body.push(baked, None, natural, end, f32::INFINITY)
        });
        if found == f32::INFINITY {
            // There was no time to measure it.
            return round.allowed_push();
        }
        self.natural_push = Some(found);
        found.max(round.allowed_push())
    }

    /// Like [`Evaluator::refuse`], for a candidate that was not refused.
    fn pushes_too_hard(&mut self, round: Round<'_>, index: usize) -> bool {
        let mut motion = std::mem::take(&mut self.workers.body().motion);
        round.motion(index, &mut motion);
        let is_refused = self.refuse(round, index, &mut motion);
        self.workers.body().motion = motion;
        is_refused
    }

    /// The clean candidate with the lowest score, or if none is clean, the hit with the largest clearance, or if all push too hard, the one
    /// that pushes least. Ties are decided by the index.
    pub(super) fn best(&self) -> usize {
        let smallest = |value: fn(&Evaluated) -> Option<f32>| {
            let evaluated = self.evaluated.iter().enumerate();
            evaluated
                .filter_map(|(index, one)| Some((index, value(one.as_ref()?)?)))
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .map(|(index, _)| index)
        };
        smallest(|one| one.score.map(|score| score.total))
            .or_else(|| smallest(|one| (!one.is_too_hard()).then_some(-one.clearance.metres)))
            .or_else(|| {
                smallest(|one| match one.push {
                    Push::TooHard(push) => Some(push),
                    _ => None,
                })
            })
            .unwrap_or(0)
    }

    /// Writes the chosen candidate's motion to `motion` and tests it, unless the candidate is an evasion that is not a
    /// [close call](CLOSE_CALL). Returns `false` if the candidate seemed clean but is hit, or if it pushes too hard.
    pub(super) fn confirm(&mut self, round: Round<'_>, chosen: usize, motion: &mut Motion) -> bool {
        round.motion(chosen, motion);
        if let Some(refused) = self.evaluated[chosen].filter(Evaluated::is_too_hard) {
            // It is chosen although it was refused, as all were.
            self.evaluated[chosen] = Some(Evaluated {
                push: refused.push,
                ..round.result(chosen, refused.clearance)
            });
        } else if self.refuse(round, chosen, motion) {
            return false;
        }
        let Some(before) = self.evaluated[chosen] else {
            return true;
        };
        let kind = round.state.candidates.list[chosen].kind;
        let is_evasion = matches!(kind, CandidateKind::Evasion { .. });
        let is_close = before.clearance.metres.abs() <= CLOSE_CALL
            || (round.state.starts_in_blend(chosen) && !before.is_final);
        let is_exhaustive = round.state.request.evaluation != Evaluation::Lazy;
        if is_exhaustive || (is_evasion && !is_close) {
            return true;
        }
        let sampling = match round.state.request.is_plan {
            true => Sampling::CoarseFirst,
            false => Sampling::Each,
        };
        let test = round.exact_test(Extent::WHOLE, sampling);
        let clearance = test.on_motion(motion, self.workers.body());
        let entered = round.candidate_entered(chosen, f32::INFINITY, self.workers.body());
        let clearance = worse(clearance, entered);
        self.evaluated[chosen] = Some(Evaluated {
            push: before.push,
            ..round.final_result(chosen, clearance)
        });
        clearance.is_clean() || !before.clearance.is_clean()
    }

    /// Lists the tested candidates that do not push too hard in `order`, the one with the largest clearance first.
    pub(super) fn order_by_depth(&mut self) {
        let (order, evaluated) = (&mut self.order, &self.evaluated);
        order.clear();
        order.extend(evaluated.iter().enumerate().filter_map(|(index, one)| {
            let one = one.filter(|one| !one.is_too_hard())?;
            Some(Bound {
                value: one.clearance.metres,
                index,
            })
        }));
        order.sort_unstable_by(|a, b| b.value.total_cmp(&a.value).then(a.index.cmp(&b.index)));
    }

    /// Finds the hit with the largest clearance, for queries without a clean candidate. The known clearance of a hit is an upper bound,
    /// because over the whole attack it can only be smaller.
    pub(super) fn measure_shallowest_hit(&mut self, round: Round<'_>) {
        let is_among_obstacles = round.state.request.is_among_obstacles();
        let is_exhaustive = round.state.request.evaluation != Evaluation::Lazy;
        if is_exhaustive && !is_among_obstacles {
            return;
        }
        self.order_by_depth();
        let order = std::mem::take(&mut self.order);
        let count = round.query.settings.warp.candidates.max(1);
        if is_among_obstacles {
            self.measure_free(round, &order, count);
        } else {
            self.measure_shallowest(round, &order, count);
            if !is_exhaustive && !round.state.request.is_plan {
                self.settle_hits(round);
            }
        }
        self.order = order;
    }

    /// Tests hits over the whole attack until the `count` shallowest hits that do not push too hard are known. Each bound is first tightened at
    /// every fourth sample. Outside of a plan it is then tested at every sample, so that the same candidates are warped whatever the evaluation.
    fn measure_shallowest(&mut self, round: Round<'_>, order: &[Bound], count: usize) {
        let mut depths = std::mem::take(&mut self.depths);
        let mut tight = std::mem::take(&mut self.tight);
        depths.clear();
        tight.clear();
        let until = |enough: f32| Extent {
            enough,
            ..Extent::WHOLE
        };
        let mut loose = order.iter().copied().peekable();
        while !self.workers.body().is_late() {
            let enough = depths.get(count - 1).copied();
            let enough = enough.unwrap_or(f32::NEG_INFINITY).max(round.useful()) - NEAR_TIE;
            let best = tight.last().map_or(f32::NEG_INFINITY, |bound| bound.value);
            let next = loose.next_if(|bound| bound.value >= best.max(enough));
            if let Some(bound) = next {
                let Bound { mut value, index } = bound;
                if !self.is_final(index) {
                    // Fewer samples may overestimate the clearance, but the candidate stays a hit.
                    let coarse = Sampling::CoarseFirst;
                    let clearance =
                        round.test_posed(index, until(enough), coarse, self.workers.body());
                    if clearance.metres < value {
                        self.evaluated[index] = Some(round.result(index, clearance));
                        value = clearance.metres;
                    }
                }
                let at = tight.partition_point(|bound| bound.value <= value);
                tight.insert(at, Bound { value, index });
                continue;
            }
            let Some(Bound { value, index }) = tight.pop().filter(|one| one.value >= enough) else {
                break;
            };
            if self.pushes_too_hard(round, index) {
                continue;
            }
            let mut metres = value;
            if !round.state.request.is_plan && !self.is_final(index) {
                let each = Sampling::Each;
                let clearance = round.test_posed(index, until(enough), each, self.workers.body());
                metres = clearance.metres;
                // Below `enough` the exact clearance may be smaller.
                self.evaluated[index] = Some(Evaluated {
                    is_final: metres >= enough,
                    ..round.result(index, clearance)
                });
            }
            let at = depths.partition_point(|&depth| depth >= metres);
            if at < count {
                depths.insert(at, metres);
                depths.truncate(count);
            }
        }
        (self.depths, self.tight) = (depths, tight);
    }

    /// Finds the `count` shallowest hits that enter no obstacle and may be bent, and measures them. Hits that enter an obstacle keep a
    /// bound of their clearance.
    fn measure_free(&mut self, round: Round<'_>, order: &[Bound], count: usize) {
        /// Maximum number of hits that are examined.
        const MOST: usize = 16;
        let warp = &round.query.settings.warp;
        let deepest = warp.deepest + round.state.request.margin;
        let mut found = 0;
        for &Bound { value, index } in order.iter().take(MOST) {
            if found == count || -value > deepest || self.workers.body().is_late() {
                break;
            }
            let Some(before) = self.evaluated[index] else {
                continue;
            };
            if self.pushes_too_hard(round, index) {
                continue;
            }
            let body = self.workers.body();
            let entered = round.candidate_entered(index, 0.0, body);
            if entered.is_some() {
                let clearance = worse(before.clearance, entered);
                self.evaluated[index] = Some(round.result(index, clearance));
                continue;
            }
            // Whether a bend avoids the attack is tested at every sample.
            let clearance = round.test_posed(index, Extent::WHOLE, Sampling::CoarseFirst, body);
            self.evaluated[index] = Some(round.final_result(index, clearance));
            found += 1;
        }
    }

    /// Whether a candidate's final motion was tested over the whole attack.
    fn is_final(&self, index: usize) -> bool {
        self.evaluated[index].is_some_and(|one| one.is_final)
    }
}

/// The shortest prefix of a move that lasts until `time`, in seconds since the query, or the whole path if it ends earlier.
fn shortest_prefix(round: Round<'_>, path: MoveId, time: f32) -> MoveId {
    let frame_rate = round.query.baked.graph().frame_rate();
    let lasts = |frames: u32| {
        let seconds = f64::from(frames) / frame_rate;
        round.state.request.wait + seconds as f32 >= time
    };
    let prefixes = round.state.moves.prefixes(path);
    let shortest = prefixes.take_while(|&(_, frames)| lasts(frames)).last();
    // The motion after the end of a path belongs to that path alone.
    shortest.map_or(path, |(prefix, _)| prefix)
}

/// Time at which the attack, and all evasions that the motion begins before the attack's end, have ended, in seconds.
pub(crate) fn evasions_end(graph: &MotionGraph, motion: &Motion, attack_end: f32) -> f32 {
    let ends = motion.events(graph).filter_map(|(event, [start, end])| {
        let is_evasion = graph.event(event).kind == EventKind::Evasion;
        (is_evasion && start < attack_end).then_some(end)
    });
    ends.fold(attack_end, f32::max)
}
