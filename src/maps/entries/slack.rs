//! Tells how much the limits of plausible motion may change before the result of a test may change.

use serde::{Deserialize, Serialize};

/// Index of a limit in [`MotionLimits::numbers`](super::limits::MotionLimits::numbers).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) struct LimitId(u8);

impl LimitId {
    /// Stands for any limit.
    const ANY: Self = Self(u8::MAX);

    /// The id of the limit at an index. Indices from 255 on share [`LimitId::ANY`].
    pub(super) fn new(place: usize) -> Self {
        u8::try_from(place).map_or(Self::ANY, Self)
    }
}

/// A limit, or a bound that is derived from it, that a value is compared with.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limit {
    pub(super) value: f32,
    pub(super) id: LimitId,
}

/// A limit for values that are compared by their squares.
#[derive(Clone, Copy, Debug)]
pub(super) struct SquareLimit {
    square: f32,
    inverse: f32,
    id: LimitId,
}

impl SquareLimit {
    pub(super) fn new(limit: f32, id: LimitId) -> Self {
        let square = limit * limit;
        Self {
            square,
            inverse: 1.0 / square,
            id,
        }
    }
}

/// Summary of the comparisons of some tests with their limits. A ratio is the square of a value divided by the square of its limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slack {
    /// Largest ratio in the current test so far.
    current: f32,
    /// Largest ratio of the passed tests, at most 1.
    passed: f32,
    /// Smallest ratio of the failed tests, and the limit that all of them failed, or [`LimitId::ANY`] if they failed different ones.
    failed: (f32, LimitId),
}

/// A [`Slack`] as it is stored. Larger codes mean that values are farther from their limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) struct SlackCode {
    passed: u8,
    failed: u8,
    limit: LimitId,
}

/// The minimum codes of results that stay the same after a change of limits.
#[derive(Clone, Debug)]
pub(super) struct NeededCodes {
    /// Minimum code of passed tests.
    passed: u16,
    /// Minimum code of tests that failed one limit, for each limit.
    failed: Vec<u16>,
    /// Minimum code of tests that failed different limits: the maximum of `failed`.
    any: u16,
}

impl Default for Slack {
    fn default() -> Self {
        Self {
            current: 0.0,
            passed: 0.0,
            failed: (f32::INFINITY, LimitId::ANY),
        }
    }
}

/// Number of code steps for a factor of two.
const STEPS: f32 = 32.0;
/// Upper bound of the relative error of a ratio.
const ROUNDING: f32 = 1e-4;

impl Slack {
    /// Begins a test.
    pub(super) fn start(&mut self) {
        self.current = 0.0;
    }

    /// Ends a test that was passed.
    pub(super) fn pass(&mut self) {
        self.passed = self.passed.max(self.current);
    }

    /// Whether a value is within a limit.
    pub(super) fn fits(&mut self, value: f32, limit: Limit) -> bool {
        let share = value / limit.value;
        self.note(value <= limit.value, share * share, limit.id)
    }

    /// Whether a value is within a limit, from their squares.
    #[inline]
    pub(super) fn square_fits(&mut self, square: f32, limit: SquareLimit) -> bool {
        let ratio = square * limit.inverse;
        if square <= limit.square {
            // A NaN counts as equal to its limit: `min` returns 1 for it.
            self.current = self.current.max(ratio.min(1.0));
            return true;
        }
        self.note(false, ratio, limit.id)
    }

    /// Adds the comparisons of another test. `fits` is whether it was passed.
    pub(super) fn join(&mut self, fits: bool, other: &Self) -> bool {
        let (failed, limit) = other.failed;
        self.note(fits, if fits { other.current } else { failed }, limit)
    }

    fn note(&mut self, fits: bool, ratio: f32, limit: LimitId) -> bool {
        // A NaN counts as equal to its limit.
        let ratio = if ratio.is_nan() {
            1.0
        } else {
            ratio.min(f32::MAX)
        };
        if fits {
            self.current = self.current.max(ratio);
            return true;
        }
        let (failed, by) = self.failed;
        let is_first = failed == f32::INFINITY;
        let by = if is_first || by == limit {
            limit
        } else {
            LimitId::ANY
        };
        self.failed = (failed.min(ratio), by);
        false
    }

    pub(super) fn code(&self) -> SlackCode {
        let (failed, limit) = self.failed;
        let code = |factor: f32| (STEPS * factor.log2()) as u8;
        SlackCode {
            passed: code(1.0 / self.passed),
            failed: code(failed),
            limit,
        }
    }
}

impl NeededCodes {
    /// The minimum codes after a change of each limit by a factor.
    pub(super) fn new(factors: &[f32]) -> Self {
        let least = factors.iter().copied().fold(1.0, f32::min);
        let failed: Vec<u16> = factors.iter().map(|&factor| needed(factor)).collect();
        Self {
            passed: needed(1.0 / least),
            any: failed.iter().copied().max().unwrap_or(0),
            failed,
        }
    }

    /// The minimum codes if the earlier limits are unknown. No code suffices.
    pub(super) fn unknown() -> Self {
        Self {
            passed: u16::MAX,
            failed: Vec::new(),
            any: u16::MAX,
        }
    }

    /// Whether a result stays the same.
    pub(super) fn suffices(&self, code: SlackCode) -> bool {
        let failed = self.failed.get(usize::from(code.limit.0));
        let failed = failed.filter(|_| code.limit != LimitId::ANY);
        u16::from(code.passed) >= self.passed
            && u16::from(code.failed) >= *failed.unwrap_or(&self.any)
    }
}

/// The minimum code of a comparison whose result stays the same if its limit grows by a factor.
fn needed(factor: f32) -> u16 {
    match factor {
        1.0 => 0,
        _ => (STEPS * (factor * factor * (1.0 + ROUNDING)).log2()).ceil() as u16,
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg32;

    use super::*;

    const LIMITS: usize = 3;

    /// Two tests, each with one value for each limit in turn.
    fn results(slack: &mut Slack, values: [[f32; LIMITS]; 2], limits: [f32; LIMITS]) -> [bool; 2] {
        values.map(|values| {
            slack.start();
            let mut places = (0..LIMITS).zip(values);
            let fits = places.all(|(place, value)| {
                let (limit, id) = (limits[place], LimitId::new(place));
                match place {
                    0 => slack.square_fits(value * value, SquareLimit::new(limit, id)),
                    _ => slack.fits(value, Limit { value: limit, id }),
                }
            });
            if fits {
                slack.pass();
            }
            fits
        })
    }

    #[test]
    fn results_stay_while_the_codes_suffice() {
        let values = [0.2, 0.7, 0.93, 0.99, 1.0, 1.01, 1.2, 3.0, f32::NAN];
        let changes = [0.5, 0.9, 0.97, 1.0, 1.02, 1.1, 2.0];
        let mut random = Pcg32::seed_from_u64(1);
        let mut draw = |count: usize| random.random_range(0..count);
        let (mut kept, mut changed) = ([0, 0], 0);
        for _ in 0..50_000 {
            let tests = [0; 2].map(|_| [0; LIMITS].map(|_| values[draw(values.len())]));
            let factors = [0; LIMITS].map(|_| changes[draw(changes.len())]);
            let mut slack = Slack::default();
            let before = results(&mut slack, tests, [1.0; LIMITS]);
            let after = results(&mut Slack::default(), tests, factors);
            let suffices = NeededCodes::new(&factors).suffices(slack.code());
            kept[usize::from(suffices)] += 1;
            changed += usize::from(before != after);
            assert!(!suffices || before == after, "{tests:?} {factors:?}");
            assert!(!NeededCodes::unknown().suffices(slack.code()));
        }
        assert!(
            kept.iter().all(|&count| count > 5000) && changed > 5000,
            "{kept:?} {changed}"
        );
        assert_eq!(needed(f32::INFINITY), u16::MAX);
    }
}
