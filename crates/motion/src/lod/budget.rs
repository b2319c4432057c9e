//! Levels of detail that keep a crowd within a time budget.
//!
//! Beyond the paper. All characters share one screen error. The planner finds the smallest error at which all of them together cost no
//! more than the budget, which also makes the largest error of any character as small as possible.
//!
//! Distances are counted once, in buckets a 128th of an octave wide. A bucket counts at its near or its far edge, whichever costs more.
//! The search bisects the error; each step costs as much as there are levels, whatever the number of characters.
//!
//! [`CostMonitor`] corrects the costs. Source: Jacobson, "Congestion avoidance and control", 1988, appendix A: a running mean and a
//! running mean deviation of what is measured; the sum of the mean and a few deviations is seldom exceeded. Here of the ratio of
//! measured to planned time.

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
    /// Screen error of the previous frame, in pixels. The bands then move per frame at most as far as the camera of
    /// [`SwitchSettings::camera_speed`] or by 1% of their distance, whichever is more, so that a suddenly smaller budget is met some frames later.
    /// Bands beyond all characters come no further than they must, so that they are back soon. `None`: the bands move at once, and the error
    /// is the smallest one.
    pub before: Option<f32>,
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
    /// [`Planner::switching`] then has the bands of this error.
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
        let (least, most) = budget.range(levels);
        let finest = price(least)?;
        let pixels = if finest <= budget.milliseconds {
            if budget.before.is_none() || finest != price(PIXELS.0)? {
                least
            } else {
                // No smaller than what makes no character finer: the bands can then come nearer as soon as they must.
                let (mut low, mut high) = (least, most);
                while let Some(middle) = between(low, high) {
                    if price(middle)? == finest {
                        low = middle;
                    } else {
                        high = middle;
                    }
                }
                low
            }
        } else if price(most)? > budget.milliseconds {
            most
        } else {
            // The same steps whatever the range, so that the same error is found.
            let (mut low, mut high) = PIXELS;
            while let Some(middle) = between(low, high) {
                if middle >= most || middle > least && price(middle)? <= budget.milliseconds {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            high.min(most)
        };
        let milliseconds = price(pixels)?;
        Ok(Plan {
            pixels,
            milliseconds,
            is_met: milliseconds <= budget.milliseconds,
        })
    }

    /// Bands of the last plan.
    #[must_use]
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

    /// Upper bound of the number of characters nearer than `distance`.
    fn nearer(&self, distance: f32) -> u32 {
        self.up_to(bucket(distance))
    }

    /// Lower bound of the number of characters nearer than `distance`.
    fn surely_nearer(&self, distance: f32) -> u32 {
        match bucket(distance) {
            0 => 0,
            bucket => self.up_to(bucket - 1),
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
            let finer = self.nearer(band.end);
            nanoseconds += f64::from(finer) * f64::from(joint);
            if settings.blend_step.is_some() {
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

    /// The errors that may be chosen, from the smallest to the largest: the bands move only so far from the previous frame's. Their
    /// distances are linear in the inverse of the error.
    ///
    /// A point moves by at most the error, a few pixels, while a band passes it. At the camera's speed alone the furthest band would
    /// take minutes to arrive.
    fn range(&self, levels: &Levels) -> (f32, f32) {
        let Some(before) = self.before.filter(|&before| before > 0.0) else {
            return PIXELS;
        };
        let errors = levels
            .levels
            .iter()
            .map(|level| self.measure.of(&level.error));
        let worst = self.switching.view.pixels_at_one_metre() * errors.fold(0.0, f32::max);
        let most = (self.switching.travel() / worst).max(Self::SHARE / before);
        let least_inverse = 1.0 / before - most;
        let high = match least_inverse > 1.0 / PIXELS.1 {
            true => 1.0 / least_inverse,
            false => PIXELS.1,
        };
        let low = 1.0 / (1.0 / before + most);
        (low.clamp(PIXELS.0, PIXELS.1), high.max(PIXELS.0))
    }
}

/// Learns from each frame by how much frames take longer than planned, and scales the costs of the next plan accordingly.
///
/// The scale is the mean ratio of measured to planned time plus a reserve of some mean deviations. A frame that takes longer than planned
/// raises the number of deviations at once, and each other frame lowers it a little, so that about one frame in 150 takes longer, however
/// times are distributed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CostMonitor {
    mean: f32,
    deviation: f32,
    /// Number of mean deviations above the mean that the costs allow for.
    reserve: f32,
}

impl Default for CostMonitor {
    /// Costs are taken as they are.
    fn default() -> Self {
        Self {
            mean: 1.0,
            deviation: 0.0,
            reserve: Self::DEVIATIONS,
        }
    }
}

impl CostMonitor {
    /// Smallest number of mean deviations above the mean that the costs allow for.
    pub const DEVIATIONS: f32 = 2.0;
    /// Largest number of mean deviations above the mean that the costs allow for.
    const MOST_DEVIATIONS: f32 = 5.0;
    /// Number of frames of which one may take longer than its plan.
    const ONE_OVER_IN: f32 = 150.0;
    /// By how much a frame that takes longer than its plan raises the reserve, in mean deviations.
    const RAISE: f32 = 0.5;
    /// Share of a new frame in the mean.
    const MEAN_SHARE: f32 = 1.0 / 16.0;
    /// Share of a new frame in the mean deviation.
    const DEVIATION_SHARE: f32 = 1.0 / 64.0;
    /// Largest ratio that one frame counts with: a frame during which another program ran says little about the next.
    const MOST: f32 = 2.0;

    /// The costs, scaled by what was learned.
    #[must_use]
    pub fn corrected(&self, cost: &Cost) -> Cost {
        let scale = self.scale();
        Cost {
            character: scale * cost.character,
            joint: scale * cost.joint,
            blend: scale * cost.blend,
        }
    }

    /// Learns from a frame that was planned with [corrected](Self::corrected) costs and took `milliseconds`. Values that are
    /// not positive and finite are ignored.
    pub fn observe(&mut self, plan: &Plan, milliseconds: f32) {
        let ratio = milliseconds * self.scale() / plan.milliseconds;
        if !(ratio.is_finite() && ratio > 0.0) {
            return;
        }
        let change = match ratio > self.scale() {
            true => Self::RAISE,
            false => -Self::RAISE / (Self::ONE_OVER_IN - 1.0),
        };
        self.reserve = (self.reserve + change).clamp(Self::DEVIATIONS, Self::MOST_DEVIATIONS);
        let ratio = ratio.min(Self::MOST * self.mean);
        let off = ratio - self.mean;
        self.mean += Self::MEAN_SHARE * off;
        self.deviation += Self::DEVIATION_SHARE * (off.abs() - self.deviation);
    }

    fn scale(&self) -> f32 {
        self.mean + self.reserve * self.deviation
    }
}
