//! As much detail as a time allows.
//!
//! Beyond the paper. All characters have the same error on the screen; the smallest one is sought with which they cost no more
//! than the budget. So the greatest error of all is as small as it can be.
//!
//! Distances are counted once in buckets a 128th of an octave wide, each taken for its near edge or for its far one, whichever costs
//! more; then an error is tried in as many steps as there are levels, however many characters there are.

use serde::{Deserialize, Serialize};

use super::{Levels, LodError, Measure, Rule, SwitchSettings, Switching};

/// What a frame may cost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Budget {
    /// For all characters together.
    pub milliseconds: f32,
    /// What they cost.
    pub cost: Cost,
    /// How levels are switched; its rule is not used.
    pub switching: SwitchSettings,
    /// Which error is made small.
    pub measure: Measure,
    /// The error of the frame before, in pixels. The bands then move no faster than the camera of
    /// [`super::BlendSettings`], or than 1% of their distance a frame where that is more, and a budget that shrinks suddenly is met
    /// some frames later. `None`: at once.
    pub before: Option<f32>,
}

/// What posing costs, on all threads together: measured by whoever poses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Nanoseconds for a character, whatever its level.
    pub character: f32,
    /// Nanoseconds for each joint that is kept.
    pub joint: f32,
    /// Nanoseconds for a character that is between two levels.
    pub blend: f32,
}

/// What the budget allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// The error of [`Rule::ScreenError`].
    pub pixels: f32,
    /// What the characters cost with it at most, by the costs that were given.
    pub milliseconds: f32,
    /// Whether that is within the budget.
    pub is_met: bool,
}

/// Plans frame after frame without allocating.
#[derive(Clone, Debug, Default)]
pub struct Planner {
    /// Of each bucket, how many characters are in it or nearer.
    counts: Vec<u32>,
    switching: Switching,
}

/// Of positive numbers, by exponent and seven bits of the mantissa.
const BUCKETS: usize = 1 << 15;

/// No error that is smaller is sought, and none that is greater, pixels.
const PIXELS: (f32, f32) = (1e-3, 1e6);

fn bucket(distance: f32) -> usize {
    if distance > 0.0 {
        (distance.to_bits() >> 16) as usize
    } else {
        // Behind the camera, or not a number: at the finest level.
        0
    }
}

impl Planner {
    /// Finds the error, for characters so far away, metres. [`Planner::switching`] then has its bands.
    ///
    /// # Errors
    /// Settings that make no sense.
    pub fn plan(
        &mut self,
        levels: &Levels,
        distances: &[f32],
        budget: &Budget,
    ) -> Result<Plan, LodError> {
        budget.check()?;
        self.count(distances);
        let mut price = |pixels: f32| self.price(levels, budget, pixels);
        let (mut low, mut high) = PIXELS;
        let pixels = if price(low)? <= budget.milliseconds {
            low
        } else {
            // The middle of an interval of floats that are neighbours is one of its ends.
            loop {
                let middle = (low * high).sqrt();
                if !(low < middle && middle < high) || high / low < 1.0001 {
                    break high;
                }
                if price(middle)? <= budget.milliseconds {
                    high = middle;
                } else {
                    low = middle;
                }
            }
        };
        let pixels = budget.slowed(pixels, levels);
        let milliseconds = price(pixels)?;
        Ok(Plan {
            pixels,
            milliseconds,
            is_met: milliseconds <= budget.milliseconds,
        })
    }

    /// The bands of the last plan.
    #[must_use]
    pub fn switching(&self) -> &Switching {
        &self.switching
    }

    fn count(&mut self, distances: &[f32]) {
        self.counts.clear();
        self.counts.resize(BUCKETS, 0);
        for &distance in distances {
            self.counts[bucket(distance)] += 1;
        }
        let mut sum = 0;
        for count in &mut self.counts {
            sum += *count;
            *count = sum;
        }
    }

    /// At most so many characters are nearer.
    fn nearer(&self, distance: f32) -> u32 {
        self.counts[bucket(distance)]
    }

    /// At least so many characters are nearer.
    fn surely_nearer(&self, distance: f32) -> u32 {
        match bucket(distance) {
            0 => 0,
            bucket => self.counts[bucket - 1],
        }
    }

    /// Milliseconds at most, wherever hysteresis leaves the characters.
    fn price(&mut self, levels: &Levels, budget: &Budget, pixels: f32) -> Result<f32, LodError> {
        let settings = SwitchSettings {
            rule: Rule::ScreenError {
                pixels,
                measure: budget.measure,
            },
            ..budget.switching
        };
        self.switching.update(levels, &settings)?;
        let Cost {
            character,
            joint,
            blend,
        } = budget.cost;
        let coarsest = levels.levels.last().map_or(0, |level| level.kept.len());
        let all = f64::from(self.counts[BUCKETS - 1]);
        let mut nanoseconds = all * (f64::from(character) + f64::from(joint) * coarsest as f64);
        for band in self.switching.bands() {
            // Each level has one joint less.
            let finer = self.nearer(band.end);
            nanoseconds += f64::from(finer) * f64::from(joint);
            if settings.blend.is_some() {
                let within = finer - self.surely_nearer(band.start).min(finer);
                nanoseconds += f64::from(within) * f64::from(blend);
            }
        }
        Ok((nanoseconds * 1e-6) as f32)
    }
}

impl Budget {
    /// Share of its distance that a band may move in a frame.
    const SHARE: f32 = 0.01;

    fn check(&self) -> Result<(), LodError> {
        let values = [
            ("milliseconds", self.milliseconds),
            ("character", self.cost.character),
            ("joint", self.cost.joint),
            ("blend", self.cost.blend),
            ("before", self.before.unwrap_or(0.0)),
        ];
        match values
            .into_iter()
            .find(|(_, value)| !(value.is_finite() && *value >= 0.0))
        {
            Some((setting, value)) => Err(LodError::Setting {
                setting,
                value,
                must: "at least 0",
            }),
            None => Ok(()),
        }
    }

    /// Distances are linear in the inverse of the error: that is what must not jump.
    ///
    /// Where a band is far away, what moves as it passes is at most the error, a few pixels. At the camera's speed alone, the furthest
    /// band would need minutes.
    fn slowed(&self, wanted: f32, levels: &Levels) -> f32 {
        let Some(before) = self.before.filter(|&before| before > 0.0) else {
            return wanted;
        };
        let blend = self.switching.blend.unwrap_or_default();
        let errors = levels
            .levels
            .iter()
            .map(|level| self.measure.of(&level.error));
        let worst = self.switching.view.pixels_at_one_metre() * errors.fold(0.0, f32::max);
        let most = (blend.speed / blend.frame_rate / worst).max(Self::SHARE / before);
        let inverse = (1.0 / wanted).clamp(1.0 / before - most, 1.0 / before + most);
        if inverse > 1.0 / PIXELS.1 {
            1.0 / inverse
        } else {
            PIXELS.1
        }
    }
}
