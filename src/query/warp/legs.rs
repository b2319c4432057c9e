//! Legs that must reach the ground, and knees that fold no further than they can.

use super::linear::{Gradient, Numbers, Row, Scales, dot};
use super::ticks::Tick;
use crate::anim::Rig;

/// Distances this near to the limit are held to it, metres.
const NEAR: f32 = 0.12;

/// The conditions of one sample that no ankle comes further from its hip, or nearer to it, than the leg's bones let it.
/// `now` are the numbers that the sample is warped by.
pub(super) fn rows(
    rig: &Rig,
    tick: &Tick,
    (scales, now): (&Scales, &Numbers),
    rows: &mut Vec<Row>,
) {
    for (limb, range) in tick.legs.iter().enumerate() {
        let Some(leg) = rig.limbs()[limb] else {
            continue;
        };
        let [hip, foot] = [leg.hip, leg.foot].map(|joint| tick.joints[joint.index()].translation);
        let distance = hip.distance(foot);
        let Some(along) = (hip - foot).try_normalize() else {
            continue;
        };
        let mut gradient = Gradient {
            pelvis: along * tick.weight,
            ..Gradient::default()
        };
        gradient.ends[limb] = -along * tick.weight;
        let slope = gradient.scaled(scales);
        let at_now = dot(&slope, now);
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

/// A foot that moves away from where it stands is lifted by half as much at least.
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
