//! The exact test of candidates, as far as the choice needs it.
//!
//! Source: Masaoka & Oshita, section 5.4. Differs: V_d is never below 0, so that the other two terms bound the score, and a
//! candidate whose bound is no better than the best score so far need not be tested, and of others only whether they are hit or come
//! near enough to win.

use serde::{Deserialize, Serialize};

use super::candidate::Way;
use super::case::Case;
use super::clearance::{Clearance, Extent, MotionBody, Sampling, on_one_motion};
use super::context::QueryContext;
use super::score::Score;
use crate::graph::Motion;
use crate::math::{in_parallel, thread_count};

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
/// samples ([`BodyTrack::RATE`](crate::region::BodyTrack::RATE)); metres.
const CLOSE_CALL: f32 = 0.005;

/// What a court works with; kept from one query to the next.
#[derive(Clone, Debug, Default)]
pub(super) struct CourtScratch {
    /// By candidate; `None` for those that were not tested.
    pub judged: Vec<Option<Judged>>,
    order: Vec<(f32, usize)>,
    body: MotionBody,
}

impl CourtScratch {
    /// Forgets how bodies stood, and what was judged but for the context's known hits.
    pub(super) fn clear(&mut self, context: &QueryContext) {
        self.body.forget();
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

/// The exact test of candidates, from the most promising on.
pub(super) struct Court<'s, 'a> {
    scratch: &'s mut CourtScratch,
    case: Case<'a>,
    judging: Judging,
}

impl<'s, 'a> Court<'s, 'a> {
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
            let mut best = self.best();
            for &(bound, index) in &order {
                if self.is_bounded() && bound >= best {
                    break;
                }
                let extent = Extent {
                    below: self.winning_clearance(bound, best),
                    ..Extent::UNTIL_HIT
                };
                let clearance = self.case.test(index, extent, &mut self.scratch.body);
                if clearance.metres >= extent.below && best.is_finite() {
                    continue;
                }
                let judged = self.judged(index, clearance);
                best = judged.score.map_or(best, |score| best.min(score.total));
                self.scratch.judged[index] = Some(judged);
            }
        }
        self.scratch.order = order;
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
        let threads = thread_count(self.case.query.settings.threads);
        let exactly = (Sampling::Each, Extent::WHOLE);
        if threads == 1 {
            for &(_, index) in order {
                let body = &mut self.scratch.body;
                let clearance = self.case.test_posed(index, exactly, body);
                self.scratch.judged[index] = Some(self.judged(index, clearance));
            }
            return;
        }
        let (part, case) = (order.len().div_ceil(threads).max(1), &self.case);
        let parts = in_parallel(threads, order.len().div_ceil(part), |number| {
            let mut body = MotionBody::default();
            let part = &order[number * part..order.len().min((number + 1) * part)];
            let test =
                |&(_, index): &(f32, usize)| (index, case.test_posed(index, exactly, &mut body));
            part.iter().map(test).collect::<Vec<_>>()
        });
        for (index, clearance) in parts.into_iter().flatten() {
            self.scratch.judged[index] = Some(self.judged(index, clearance));
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
            let clearance = self.case.test(index, extent, &mut self.scratch.body);
            least = least.max(clearance.metres);
            self.scratch.judged[index] = Some(self.judged(index, clearance));
        }
        self.scratch.order = order;
    }

    fn judged(&self, index: usize, clearance: Clearance) -> Judged {
        let score = || self.case.score(index, clearance.metres);
        Judged {
            clearance,
            score: clearance.is_clean().then(score),
            is_final: false,
        }
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
            &mut self.scratch.body,
        );
        self.scratch.judged[chosen] = Some(Judged {
            is_final: true,
            ..self.judged(chosen, clearance)
        });
        clearance.is_clean() || !looks.clearance.is_clean()
    }
}
