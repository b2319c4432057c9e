//! Costs corrected by what frames really take.
//!
//! Source: Jacobson, "Congestion avoidance and control", 1988, appendix A: a running mean and a running mean deviation of what is
//! measured; the sum of the mean and a few deviations is seldom exceeded. Here of the ratio of measured to planned time.

use super::{Cost, Plan};

/// Learns from each frame by how much frames take longer than planned, and scales the costs of the next plan accordingly.
///
/// The scale is the mean ratio of measured to planned time plus [`CostMonitor::DEVIATIONS`] mean deviations, so that few frames
/// exceed their budget although times vary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CostMonitor {
    mean: f32,
    deviation: f32,
}

impl Default for CostMonitor {
    /// Costs are taken as they are.
    fn default() -> Self {
        Self {
            mean: 1.0,
            deviation: 0.0,
        }
    }
}

impl CostMonitor {
    /// Number of mean deviations above the mean that the costs allow for.
    pub const DEVIATIONS: f32 = 2.0;
    /// Share of a new frame in the mean and in the deviation.
    const SHARE: f32 = 1.0 / 16.0;
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

    /// Learns from a frame that was planned with [corrected](Self::corrected) costs and took so many milliseconds. Values that are
    /// not positive and finite are ignored.
    pub fn observe(&mut self, plan: &Plan, milliseconds: f32) {
        let ratio = milliseconds * self.scale() / plan.milliseconds;
        if !(ratio.is_finite() && ratio > 0.0) {
            return;
        }
        let ratio = ratio.min(Self::MOST * self.mean);
        let off = ratio - self.mean;
        self.mean += Self::SHARE * off;
        self.deviation += Self::SHARE * (off.abs() - self.deviation);
    }

    fn scale(&self) -> f32 {
        self.mean + Self::DEVIATIONS * self.deviation
    }
}
