//! How much the limits of plausible motion may change before the result of a test does.

use serde::{Deserialize, Serialize};

/// A limit of [`MotionLimits`](super::limits::MotionLimits), by its place in [`MotionLimits::numbers`](super::limits::MotionLimits::numbers).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) struct LimitId(u8);

impl LimitId {
    /// One of several limits.
    const ANY: Self = Self(u8::MAX);

    /// The limit at a place. Those beyond the numbers of a byte share one.
    pub(super) fn new(place: usize) -> Self {
        u8::try_from(place).map_or(Self::ANY, Self)
    }
}

/// A limit, or what follows from it, by which a value is compared.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limit {
    pub(super) value: f32,
    pub(super) id: LimitId,
}

/// The square of a limit.
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

/// The comparisons of some tests with their limits. A ratio is the square of a value divided by that of its limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slack {
    /// Largest ratio in the current test so far.
    current: f32,
    /// Largest ratio of the tests that were passed, at most 1.
    passed: f32,
    /// Smallest ratio by which a test failed, and the limit by which all tests failed that did.
    failed: (f32, LimitId),
}

/// The result of comparisons as it is stored. The larger a code, the farther values are from their limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) struct SlackCode {
    passed: u8,
    failed: u8,
    limit: LimitId,
}

/// The least codes with which results stay the same after a change of limits.
#[derive(Clone, Debug)]
pub(super) struct NeededCodes {
    passed: u16,
    /// Of each limit.
    failed: Vec<u16>,
    /// Of all limits.
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

/// Steps of a code of a factor of two.
const STEPS: f32 = 32.0;
/// Relative error of a ratio, generously.
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
            // What cannot be compared is as close to its limit as can be: the lesser of 1 and no number is 1.
            self.current = self.current.max(ratio.min(1.0));
            return true;
        }
        self.note(false, ratio, limit.id)
    }

    /// Notes the comparisons of another test, which was passed or failed.
    pub(super) fn join(&mut self, fits: bool, other: &Self) -> bool {
        let (failed, limit) = other.failed;
        self.note(fits, if fits { other.current } else { failed }, limit)
    }

    fn note(&mut self, fits: bool, ratio: f32, limit: LimitId) -> bool {
        // What cannot be compared is as close to its limit as can be.
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
    /// The codes after a change of each limit by a factor.
    pub(super) fn new(factors: &[f32]) -> Self {
        let least = factors.iter().copied().fold(1.0, f32::min);
        let failed: Vec<u16> = factors.iter().map(|&factor| needed(factor)).collect();
        Self {
            passed: needed(1.0 / least),
            any: failed.iter().copied().max().unwrap_or(0),
            failed,
        }
    }

    /// The codes where nothing of the limits before is known: none suffices.
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

/// The least code with which a comparison with a limit that grows by a factor stays the same.
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
