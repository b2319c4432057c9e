//! How much the limits of plausible motion may change before the result of a test does.

/// The comparisons of some tests with their limits. A ratio is the square of a value divided by that of its limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slack {
    /// Largest ratio in the current test so far.
    current: f32,
    /// Largest ratio of the tests that were passed, at most 1.
    passed: f32,
    /// Smallest ratio by which a test failed.
    failed: f32,
}

impl Default for Slack {
    fn default() -> Self {
        Self {
            current: 0.0,
            passed: 0.0,
            failed: f32::INFINITY,
        }
    }
}

impl Slack {
    /// Steps of a code of a factor of two.
    const STEPS: f32 = 32.0;
    /// Relative error of a ratio, generously.
    const ROUNDING: f32 = 1e-4;

    /// Begins a test.
    pub(super) fn start(&mut self) {
        self.current = 0.0;
    }

    /// Ends a test that was passed.
    pub(super) fn pass(&mut self) {
        self.passed = self.passed.max(self.current);
    }

    /// Whether a value is within a limit.
    pub(super) fn fits(&mut self, value: f32, limit: f32) -> bool {
        let share = value / limit;
        self.note(value <= limit, share * share)
    }

    /// Whether a value is within a limit, from their squares.
    pub(super) fn square_fits(&mut self, square: f32, limit: f32) -> bool {
        self.note(square <= limit, square / limit)
    }

    /// Notes a comparison of another slack's test, which was passed or failed.
    pub(super) fn join(&mut self, fits: bool, other: &Self) -> bool {
        self.note(fits, if fits { other.current } else { other.failed })
    }

    fn note(&mut self, fits: bool, ratio: f32) -> bool {
        // What cannot be compared is as close to its limit as can be.
        let ratio = if ratio.is_nan() { 1.0 } else { ratio };
        match fits {
            true => self.current = self.current.max(ratio),
            false => self.failed = self.failed.min(ratio),
        }
        fits
    }

    /// Codes of the ratios of tests that were passed and failed: the larger a code, the farther from the limit.
    pub(super) fn codes(&self) -> [u8; 2] {
        [1.0 / self.passed, self.failed].map(|factor| (Self::STEPS * factor.log2()) as u8)
    }

    /// The least codes with which results stay the same if all limits change by factors from `least` to `most`.
    pub(super) fn codes_needed([least, most]: [f32; 2]) -> [u16; 2] {
        if least == 1.0 && most == 1.0 {
            return [0, 0];
        }
        [1.0 / least, most].map(|factor| {
            let ratio = factor * factor * (1.0 + Self::ROUNDING);
            (Self::STEPS * ratio.log2()).ceil() as u16
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A test with some values: whether all are within their limits.
    fn test(slack: &mut Slack, values: &[f32], limit: f32) -> bool {
        slack.start();
        let fits = values.iter().all(|&value| slack.fits(value, limit));
        if fits {
            slack.pass();
        }
        fits
    }

    #[test]
    fn results_stay_while_the_codes_suffice() {
        let values = [0.2, 0.7, 0.93, 0.99, 1.0, 1.01, 1.2, 3.0, f32::NAN];
        let mut kept = [0, 0];
        for (first, second) in values.iter().flat_map(|&a| values.map(|b| (a, b))) {
            let mut slack = Slack::default();
            let before = [[first].as_slice(), &[second, first]].map(|v| test(&mut slack, v, 1.0));
            for change in [0.5, 0.9, 0.97, 1.0, 1.02, 1.1, 2.0] {
                let needed = Slack::codes_needed([change, change]);
                let codes = slack.codes();
                let mut both = codes.iter().zip(needed);
                let suffices = both.all(|(&code, needed)| u16::from(code) >= needed);
                let after = [[first].as_slice(), &[second, first]]
                    .map(|v| test(&mut Slack::default(), v, change));
                kept[usize::from(suffices)] += 1;
                assert!(!suffices || before == after, "{first} {second} {change}");
            }
        }
        assert!(kept.iter().all(|&count| count > 100), "{kept:?}");
        assert_eq!(Slack::codes_needed([1.0, f32::INFINITY])[1], u16::MAX);
    }
}
