//! The exact test of candidates, as far as the choice needs it.
//!
//! Source: Masaoka & Oshita, section 5.4. Differs: V_d is never below 0, so that the other two terms bound the score, and a
//! candidate whose bound is no better than the best score so far need not be tested, and of others only whether they are hit or come
//! near enough to win.

use serde::{Deserialize, Serialize};

use super::beginnings::Beginnings;
use super::candidate::Way;
use super::case::Case;
use super::clearance::{Clearance, Extent, Sampling, on_one_motion};
use super::context::QueryContext;
use super::jury::Jury;
use super::score::Score;
use crate::graph::Motion;
use crate::math::thread_count;

/// How much is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Judging {
    /// What the choice needs: candidates that the maps remove are left out as long as there is a
    /// clean one among the others, and a candidate that could not win even with no distance at all
    /// is not tested (with a weight of distance below 0 every one is). Evasions are tested on what
    /// is known of them beforehand, what only moves at every fourth sample first; the winner once more,
    /// on its very motion.
    Needed,
    /// Every candidate, posed sample by sample over the whole attack, whatever the maps say: the
    /// culling path `exact`, which all others are held to.
    All,
}

/// An evasion is known beforehand by samples that lie elsewhere between those of the motion that is
/// played, at most half a sample away. A limb's arc leaves its chord by less than 2 mm between two
/// samples ([`BodyTrack::RATE`](crate::maps::BodyTrack::RATE)); metres.
const CLOSE_CALL: f32 = 0.005;

/// What a court works with; kept from one query to the next.
#[derive(Clone, Debug, Default)]
pub(super) struct CourtScratch {
    /// By candidate; `None` for those that were not tested.
    pub judged: Vec<Option<Judged>>,
    order: Vec<(f32, usize)>,
    jury: Jury,
    /// Of moves: where a hit was found, and where the whole attack was looked at.
    hits: Beginnings,
    wholes: Beginnings,
}

impl CourtScratch {
    /// Forgets how bodies stood, and what was judged but for the context's known hits.
    pub(super) fn clear(&mut self, context: &QueryContext) {
        self.jury.forget();
        self.hits.clear();
        self.wholes.clear();
        self.judged.clear();
        self.judged.resize(context.counted, None);
        self.judged
            .extend(context.known.iter().map(|hit| hit.judged));
    }
}

/// What the exact test says of a candidate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Judged {
    pub clearance: Clearance,
    /// `None` for a hit.
    pub score: Option<Score>,
    /// Whether its very motion was tested, over the whole attack: the last word.
    is_final: bool,
}

impl Judged {
    fn new(case: &Case<'_>, index: usize, clearance: Clearance) -> Self {
        let score = || case.score(index, clearance.metres);
        Self {
            clearance,
            score: clearance.is_clean().then(score),
            is_final: false,
        }
    }
}

/// The exact test of candidates, from the most promising on.
pub(super) struct Court<'s, 'a> {
    scratch: &'s mut CourtScratch,
    case: Case<'a>,
    judging: Judging,
}

impl<'s, 'a> Court<'s, 'a> {
    /// So many are tested alone before others are tested side by side, if they are more than that.
    const ALONE: usize = 4;

    /// What `scratch` says was judged stays so.
    pub(super) fn new(scratch: &'s mut CourtScratch, case: Case<'a>, judging: Judging) -> Self {
        scratch.judged.resize(case.candidates.len(), None);
        Self {
            scratch,
            case,
            judging,
        }
    }

    /// Whether a tested candidate is clean.
    pub(super) fn has_clean(&self) -> bool {
        self.best().is_finite()
    }

    /// The best score so far; infinite where nothing is clean.
    fn best(&self) -> f32 {
        let scores = self.scratch.judged.iter().flatten().filter_map(|j| j.score);
        scores
            .map(|score| score.total)
            .fold(f32::INFINITY, f32::min)
    }

    /// V_d is never below 0, so that V without it is a bound, unless its weight rewards distance.
    fn is_bounded(&self) -> bool {
        self.judging == Judging::Needed && self.case.query.settings.weights.distance >= 0.0
    }

    /// Whether a path that only moves could score better than what was judged so far.
    pub(super) fn can_moves_win(&self) -> bool {
        !self.is_bounded()
            || self.best() > Score::least_of_a_move(&self.case.query.settings.weights)
    }

    /// Judges those of `candidates` that were not, best bound first, as far as it is needed.
    pub(super) fn judge(&mut self, candidates: impl Iterator<Item = usize>) {
        let mut order = std::mem::take(&mut self.scratch.order);
        order.clear();
        order.extend(
            candidates
                .filter(|&index| self.scratch.judged[index].is_none())
                .map(|index| (self.case.score(index, 0.0).total, index)),
        );
        if self.judging == Judging::All {
            self.judge_all(&order);
        } else {
            order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            // As a rule one of the most promising ones is clean.
            let (first, rest) = order.split_at(order.len().min(Self::ALONE));
            self.judge_best(first);
            let judged = self.judge_until_clean(rest);
            self.judge_best(&rest[judged..]);
        }
        self.scratch.order = order;
    }

    /// Judges those of `order` up to the first one that is clean, by as many threads as the settings say; how many. As long as
    /// nothing is clean, no test depends on another one, but for moves, of which one helps with the next.
    fn judge_until_clean(&mut self, order: &[(f32, usize)]) -> usize {
        let (case, threads) = (self.case, thread_count(self.case.query.settings.threads));
        let is_move = |&(_, index): &(f32, usize)| case.move_of(index).is_some();
        let is_short = order.len() <= Self::ALONE;
        if threads == 1 || is_short || order.iter().any(is_move) || self.has_clean() {
            return 0;
        }
        let scratch = &mut *self.scratch;
        let test = |at: usize, body: &mut _| case.test(order[at].1, Extent::UNTIL_HIT, body);
        let is_clean = Clearance::is_clean;
        let found = scratch.jury.test((threads, order.len()), test, is_clean);
        let mut judged = 0;
        for (&(_, index), clearance) in order.iter().zip(found.iter().map_while(|found| *found)) {
            scratch.judged[index] = Some(Judged::new(&case, index, clearance));
            judged += 1;
            if clearance.is_clean() {
                break;
            }
        }
        judged
    }

    /// Judges those of `order` that may still win.
    fn judge_best(&mut self, order: &[(f32, usize)]) {
        let mut best = self.best();
        for &(bound, index) in order {
            if self.is_bounded() && bound >= best {
                break;
            }
            let extent = Extent {
                below: self.winning_clearance(bound, best),
                ..Extent::UNTIL_HIT
            };
            let (case, scratch) = (&self.case, &mut *self.scratch);
            let test = || case.test(index, extent, scratch.jury.body());
            let until = |found: &Clearance| (!found.is_clean()).then_some(found.time);
            let clearance = scratch.hits.of_or(case, index, (test, until));
            if clearance.metres >= extent.below && best.is_finite() {
                continue;
            }
            let judged = Judged::new(&self.case, index, clearance);
            best = judged.score.map_or(best, |score| best.min(score.total));
            self.scratch.judged[index] = Some(judged);
        }
    }

    /// The clearance below which a clean candidate with this bound scores better than `best`, metres.
    fn winning_clearance(&self, bound: f32, best: f32) -> f32 {
        /// So that of candidates that score all but the same none is left out.
        const TIE: f32 = 1e-4;
        let weight = self.case.query.settings.weights.distance;
        match self.is_bounded() && weight > 0.0 {
            true => (best - bound) / weight + TIE,
            false => f32::INFINITY,
        }
    }

    /// Every one, by as many threads as the settings say.
    fn judge_all(&mut self, order: &[(f32, usize)]) {
        let (case, scratch) = (self.case, &mut *self.scratch);
        let threads = thread_count(case.query.settings.threads);
        let exactly = (Sampling::Each, Extent::WHOLE);
        let test = |at: usize, body: &mut _| case.test_posed(order[at].1, exactly, body);
        let found = scratch.jury.test((threads, order.len()), test, |_| false);
        for (&(_, index), found) in order.iter().zip(found) {
            scratch.judged[index] = found.map(|found| Judged::new(&case, index, found));
        }
    }

    /// Which hit is the least deep? Asked where there is nothing else. What was found of a hit so
    /// far is a bound: the whole attack can only show it to be deeper.
    pub(super) fn measure_least(&mut self) {
        if self.judging == Judging::All {
            return;
        }
        let mut order = std::mem::take(&mut self.scratch.order);
        order.clear();
        let judged = self.scratch.judged.iter().enumerate();
        order.extend(judged.filter_map(|(index, j)| Some((j.as_ref()?.clearance.metres, index))));
        order.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut least = f32::NEG_INFINITY;
        for &(bound, index) in &order {
            if bound < least {
                break;
            }
            if self.scratch.judged[index].is_some_and(|judged| judged.is_final) {
                least = least.max(bound);
                continue;
            }
            let extent = Extent {
                enough: least,
                ..Extent::WHOLE
            };
            let (case, scratch) = (&self.case, &mut *self.scratch);
            let test = || case.test(index, extent, scratch.jury.body());
            let until = |_: &Clearance| Some(case.situation.attack.end());
            let clearance = scratch.wholes.of_or(case, index, (test, until));
            least = least.max(clearance.metres);
            self.scratch.judged[index] = Some(Judged::new(&self.case, index, clearance));
        }
        self.scratch.order = order;
    }

    /// The clean candidate with the smallest score, or where none is clean, the one that is hit
    /// least deep. Of equal ones the first.
    pub(super) fn choose(&self) -> usize {
        let of = |value: fn(&Judged) -> Option<f32>| {
            let judged = self.scratch.judged.iter().enumerate();
            let values = judged.filter_map(move |(i, j)| Some((i, value(j.as_ref()?)?)));
            values.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
        };
        of(|judged| judged.score.map(|score| score.total))
            .or_else(|| of(|judged| Some(-judged.clearance.metres)))
            .unwrap_or(0)
    }

    /// Leaves the chosen candidate's motion in `motion`, and tests that very motion, unless it is
    /// an evasion that was not close, within [`CLOSE_CALL`]: false where it looked clean and is not
    /// after all.
    pub(super) fn confirms(&mut self, chosen: usize, motion: &mut Motion) -> bool {
        self.case.motion(chosen, motion);
        let Some(looks) = self.scratch.judged[chosen] else {
            return true;
        };
        let is_evasion = matches!(self.case.candidates[chosen].way, Way::Evasion { .. });
        let is_close = looks.clearance.metres.abs() <= CLOSE_CALL;
        if self.judging == Judging::All || (is_evasion && !is_close) {
            return true;
        }
        let clearance = on_one_motion(
            self.case.query.baked,
            (motion, Sampling::Each),
            (self.case.situation.attack, Extent::WHOLE),
            self.scratch.jury.body(),
        );
        self.scratch.judged[chosen] = Some(Judged {
            is_final: true,
            ..Judged::new(&self.case, chosen, clearance)
        });
        clearance.is_clean() || !looks.clearance.is_clean()
    }
}
