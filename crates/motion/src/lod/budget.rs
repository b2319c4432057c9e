//! Levels of detail that keep a crowd within a time budget.
//!
//! Beyond the paper. All characters share one screen error. The planner finds the smallest error at which all of them together cost no
//! more than the budget, which also makes the largest error of any character as small as possible.
//!
//! Distances are counted once, in buckets a 128th of an octave wide. A bucket counts at its near or its far edge, whichever costs more.
//! The search bisects the error; each step costs as much as there are levels, whatever the number of characters.

use serde::{Deserialize, Serialize};

use super::{Levels, LodError, Measure, Rule, SwitchSettings, Switching};

/// Time that the poses of a frame may take, and the costs by which it is planned.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Budget {
    /// Time for all characters together, in milliseconds.
    pub milliseconds: f32,
    /// Measured costs of posing.
    pub cost: Cost,
    /// Settings of the switching of levels. The rule is ignored.
    pub switching: SwitchSettings,
    /// Error that is minimized.
    pub measure: Measure,
}

/// Costs of posing, summed over all threads. The caller measures them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Cost of a character at any level, in nanoseconds.
    pub character: f32,
    /// Cost of each kept joint, in nanoseconds.
    pub joint: f32,
    /// Additional cost of a character between two levels, in nanoseconds.
    pub blend: f32,
}

/// The screen error that a budget allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Screen error for [`Rule::ScreenError`], in pixels, at most [`Plan::MOST_PIXELS`].
    pub pixels: f32,
    /// Upper bound of the characters' cost at this error, in milliseconds.
    pub milliseconds: f32,
    /// Whether this cost is within the budget.
    pub is_met: bool,
}

impl Plan {
    /// The screen error of a plan whose budget does not suffice for the coarsest levels, in pixels. It stands for no limit: all characters
    /// are on the coarsest level.
    pub const MOST_PIXELS: f32 = 1e6;
}

/// Finds the screen error for a [`Budget`] in each frame. It allocates nothing after the first one.
#[derive(Clone, Debug, Default)]
pub struct Planner {
    /// Number of characters in each bucket or a nearer one, for those from the nearest character's to the furthest one's.
    counts: Vec<u32>,
    /// The bucket of the nearest character.
    first: usize,
    switching: Switching,
}

/// Number of buckets: positive numbers by their exponent and the upper seven bits of the mantissa.
const BUCKETS: usize = 1 << 15;

/// Range of the search, in pixels.
const PIXELS: (f32, f32) = (1e-3, Plan::MOST_PIXELS);

fn bucket(distance: f32) -> usize {
    if distance > 0.0 {
        (distance.to_bits() >> 16) as usize
    } else {
        // Behind the camera, or NaN: the finest level.
        0
    }
}

/// The geometric mean of two errors; `None` where they are about the same. The mean of two neighbouring floats is one of them.
fn between(low: f32, high: f32) -> Option<f32> {
    let middle = (low * high).sqrt();
    (low < middle && middle < high && high / low >= 1.0001).then_some(middle)
}

impl Planner {
    /// Finds the smallest screen error within the budget for characters at `distances` from the camera, in metres.
    /// [`Planner::switching`] then has the bands of this error. Other bands than in the frame before make levels change at once: to avoid
    /// this, let [`Plan::pixels`] approach the plan over some frames with a [`Switching`] of your own.
    ///
    /// # Errors
    /// Settings out of range.
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
        if price(low)? <= budget.milliseconds {
            high = low;
        } else if price(high)? <= budget.milliseconds {
            while let Some(middle) = between(low, high) {
                match price(middle)? <= budget.milliseconds {
                    true => high = middle,
                    false => low = middle,
                }
            }
        }
        let pixels = high;
        let milliseconds = price(pixels)?;
        Ok(Plan {
            pixels,
            milliseconds,
            is_met: milliseconds <= budget.milliseconds,
        })
    }

    /// Bands of the last plan.
    pub fn switching(&self) -> &Switching {
        &self.switching
    }

    fn count(&mut self, distances: &[f32]) {
        let (mut first, mut last) = (BUCKETS, 0);
        for &distance in distances {
            let bucket = bucket(distance);
            first = first.min(bucket);
            last = last.max(bucket);
        }
        self.first = first;
        self.counts.clear();
        self.counts.reserve(BUCKETS);
        self.counts.resize((last + 1).saturating_sub(first), 0);
        for &distance in distances {
            self.counts[bucket(distance) - first] += 1;
        }
        let mut sum = 0;
        for count in &mut self.counts {
            sum += *count;
            *count = sum;
        }
    }

    /// Number of characters in a bucket or a nearer one.
    fn up_to(&self, bucket: usize) -> u32 {
        match bucket.checked_sub(self.first) {
            None => 0,
            Some(index) => {
                let last = self.counts.last().copied().unwrap_or_default();
                self.counts.get(index).copied().unwrap_or(last)
            }
        }
    }

    /// Upper bound of the cost at a screen error, for every state of the hysteresis, in milliseconds.
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
        let all = f64::from(self.up_to(BUCKETS - 1));
        let mut nanoseconds = all * (f64::from(character) + f64::from(joint) * coarsest as f64);
        for band in self.switching.bands() {
            // Each level keeps one joint less than the one before.
            // No fewer than are nearer, and no more than those that are surely nearer.
            let finer = self.up_to(bucket(band.end));
            let surely = bucket(band.start).checked_sub(1);
            nanoseconds += f64::from(finer) * f64::from(joint);
            if settings.blend_step.is_some() {
                let within = finer - surely.map_or(0, |last| self.up_to(last)).min(finer);
                nanoseconds += f64::from(within) * f64::from(blend);
            }
        }
        Ok((nanoseconds * 1e-6) as f32)
    }
}

impl Budget {
    fn check(&self) -> Result<(), LodError> {
        let values = [
            ("milliseconds", self.milliseconds),
            ("character", self.cost.character),
            ("joint", self.cost.joint),
            ("blend", self.cost.blend),
        ];
        let is_wrong = |value: f32| !(value.is_finite() && value >= 0.0);
        match values.into_iter().find(|&(_, value)| is_wrong(value)) {
            Some((setting, value)) => Err(LodError::setting(setting, value, "at least 0")),
            None => Ok(()),
        }
    }
}
