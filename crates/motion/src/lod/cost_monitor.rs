//! Costs corrected by what frames really take.
//!
//! Source: Jacobson, "Congestion avoidance and control", 1988, appendix A: a running mean and a running mean deviation of what is
//! measured; the sum of the mean and a few deviations is seldom exceeded. Here of the ratio of measured to planned time.

use super::{Cost, Plan};

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
