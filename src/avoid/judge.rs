//! The exact test of candidates, as far as the choice needs it.
//!
//! Source: Masaoka & Oshita, section 5.4. Differs: V_d is never below 0, so that the other two terms bound the score, and a
//! candidate whose bound is no better than the best score so far need not be tested.

use super::Prepared;
use super::clearance::{Clearance, Extent, clearance};
use super::cull::Overlap;
use super::score::Score;

/// How much is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Judging {
    /// What the choice needs: candidates that the maps remove are left out as long as there is a
    /// clean one among the others, and a candidate that could not win even with no distance at all
    /// is not tested (with a weight of distance below 0 every one is).
    Needed,
    /// Every candidate, exactly, whatever the maps say: the culling path `exact`.
    All,
}

/// The exact test of candidates, from the most promising on.
pub(super) struct Court<'a, 'b> {
    case: &'b Prepared<'a>,
    overlaps: &'b [Overlap],
    judging: Judging,
    /// By candidate; `None` for those that were not tested.
    pub(super) judged: Vec<Option<Judged>>,
}

impl<'a, 'b> Court<'a, 'b> {
    pub(super) fn new(case: &'b Prepared<'a>, overlaps: &'b [Overlap], judging: Judging) -> Self {
        let judged = vec![None; case.candidates.len()];
        Self {
            case,
            overlaps,
            judging,
            judged,
        }
    }

    /// Whether a tested candidate is clean.
    pub(super) fn has_clean(&self) -> bool {
        self.judged
            .iter()
            .flatten()
            .any(|judged| judged.score.is_some())
    }

    /// Judges candidates, best bound first, as far as it is needed: V_d is never below 0, so that V
    /// without it is a bound, unless its weight rewards distance.
    pub(super) fn judge(&mut self, candidates: Vec<usize>) {
        let bound = |&index: &usize| {
            (
                self.case.score(index, self.overlaps.get(index), 0.0).total,
                index,
            )
        };
        let mut bounds: Vec<(f32, usize)> = candidates.iter().map(bound).collect();
        bounds.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let extent = if self.judging == Judging::All {
            Extent::Whole
        } else {
            Extent::UntilHit
        };
        let is_bounded =
            self.judging == Judging::Needed && self.case.query.settings.weights.distance >= 0.0;
        let mut best = f32::INFINITY;
        for (bound, index) in bounds {
            if is_bounded && bound >= best {
                break;
            }
            let judged = self.test(index, extent);
            best = judged.score.map_or(best, |score| best.min(score.total));
            self.judged[index] = Some(judged);
        }
    }

    /// Which hit is the least deep? Asked where there is nothing else. What was found of a hit so
    /// far is a bound: the whole attack can only show it to be deeper.
    pub(super) fn measure_least(&mut self) {
        let bound = |(index, judged): (usize, &Option<Judged>)| {
            Some((index, judged.as_ref()?.clearance.metres))
        };
        let mut bounds: Vec<(usize, f32)> =
            self.judged.iter().enumerate().filter_map(bound).collect();
        bounds.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mut least = f32::NEG_INFINITY;
        for (index, bound) in bounds {
            if bound < least {
                break;
            }
            let judged = self.test(index, Extent::Whole);
            least = least.max(judged.clearance.metres);
            self.judged[index] = Some(judged);
        }
    }

    fn test(&self, index: usize, extent: Extent) -> Judged {
        let clearance = clearance(
            self.case.query.baked,
            &self.case.motion(index),
            &self.case.attack,
            extent,
        );
        let clean = clearance.metres >= 0.0;
        Judged {
            clearance,
            score: clean.then(|| {
                self.case
                    .score(index, self.overlaps.get(index), clearance.metres)
            }),
        }
    }
}

/// What the exact test says of a candidate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Judged {
    pub(super) clearance: Clearance,
    /// `None` for a hit.
    pub(super) score: Option<Score>,
}

/// The clean candidate with the smallest score, or where none is clean, the one that is hit least
/// deep.
pub(super) fn choose(judged: &[Option<Judged>]) -> usize {
    let of = |value: fn(&Judged) -> Option<f32>| {
        let values = judged
            .iter()
            .enumerate()
            .filter_map(move |(index, j)| Some((index, value(j.as_ref()?)?)));
        values
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(index, _)| index)
    };
    let best = of(|judged| judged.score.map(|score| score.total));
    best.or_else(|| of(|judged| Some(-judged.clearance.metres)))
        .unwrap_or(0)
}
