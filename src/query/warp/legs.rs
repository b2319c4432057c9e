//! Conditions of legs: planted feet stay within reach, and knees do not fold beyond their limit.

use super::linear::{Gradient, Linearization, Row, Scales, dot};
use super::ticks::Tick;
use crate::anim::Rig;

/// Distance from a limit, in metres. Below it the condition is added.
const NEAR: f32 = 0.12;

impl Tick {
    /// Adds the conditions that keep each ankle's distance from its hip within the range of the leg's bones. `now` is the current
    /// bend at this sample.
    pub(super) fn add_leg_rows(&self, rig: &Rig, now: Linearization<'_>, rows: &mut Vec<Row>) {
        for (limb, range) in self.legs.iter().enumerate() {
            let Some(leg) = rig.limbs()[limb] else {
                continue;
            };
            let [hip, foot] =
                [leg.hip, leg.foot].map(|joint| self.joints[joint.index()].translation);
            let distance = hip.distance(foot);
            let Some(along) = (hip - foot).try_normalize() else {
                continue;
            };
            let mut gradient = Gradient {
                pelvis: along * self.weight,
                ..Gradient::default()
            };
            gradient.ends[limb] = -along * self.weight;
            let slope = gradient.scaled(now.scales);
            let at_now = dot(&slope, now.numbers);
            if distance > range.furthest - NEAR {
                rows.push(Row {
                    slope: slope.map(|number| -number),
                    least: distance - range.furthest - at_now,
                });
            }
            if distance < range.nearest + NEAR {
                rows.push(Row {
                    slope,
                    least: range.nearest - distance + at_now,
                });
            }
        }
    }
}

/// Conditions that lift a displaced foot by at least half of its displacement.
pub(super) fn lift_rows(limb: usize, scales: &Scales, rows: &mut Vec<Row>) {
    for (x, z) in [(0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5)] {
        let mut gradient = Gradient::default();
        gradient.ends[limb] = glam::Vec3::new(x, 1.0, z);
        rows.push(Row {
            slope: gradient.scaled(scales),
            least: 0.0,
        });
    }
}
