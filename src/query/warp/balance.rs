//! Whether a body that stands still would fall: its centre of mass must lie over its feet.
//!
//! Source: the support polygon of standing, and for a foot that is lifted for a moment the inverted pendulum: what stands
//! `d` beside its support has moved by d (cosh(t √(g / h)) - 1) after t seconds (Hof, Gazendam & Sinke 2005, equation 2).

use glam::{Vec2, Vec3};

use super::linear::{Gradient, Numbers, Row, Scales, dot};
use super::ticks::Tick;
use crate::anim::Rig;
use crate::maps::BakedGraph;

/// From the bones of a foot to its edge, metres.
const HALF_FOOT: f32 = 0.05;

/// What carries a body that stands still.
#[derive(Clone, Copy, Debug)]
pub(super) struct Support {
    /// Which feet stand on the ground.
    pub feet: [bool; Rig::LEGS],
    /// How far the centre of mass may lie beside them, metres.
    pub allowed: f32,
}

impl Support {
    /// With the foot of a limb in the air for so long.
    pub(super) fn without(self, limb: usize, seconds: f32) -> Self {
        /// √(g / h), 1/s, and how far a body may sway, metres.
        const RATE: f32 = 3.2;
        const SWAY: f32 = 0.05;
        let mut feet = self.feet;
        feet[limb] = false;
        let fallen = (0.5 * seconds * RATE).cosh() - 1.0;
        Self {
            feet,
            allowed: self.allowed + SWAY / fallen.max(0.05),
        }
    }
}

/// The centre of mass by the volumes of the body's spheres; of the trunk, arms and head alone with their share of the mass.
struct Masses {
    centre: Vec3,
    upper: Vec3,
    upper_share: f32,
}

impl Masses {
    fn of(baked: &BakedGraph, centres: &[Vec3]) -> Self {
        let rig = baked.graph().rig();
        let (mut all, mut upper) = ((Vec3::ZERO, 0.0), (Vec3::ZERO, 0.0));
        for (sphere, &centre) in baked.body().spheres.iter().zip(centres) {
            let volume = sphere.radius.powi(3);
            all = (all.0 + centre * volume, all.1 + volume);
            if rig.part(sphere.joint).spine == rig.spine().len() {
                upper = (upper.0 + centre * volume, upper.1 + volume);
            }
        }
        Self {
            centre: all.0 / all.1,
            upper: if upper.1 > 0.0 {
                upper.0 / upper.1
            } else {
                Vec3::ZERO
            },
            upper_share: upper.1 / all.1,
        }
    }
}

/// The condition that keeps the centre of mass over the feet, where the bend whose numbers are `now` does not. `beside` is how
/// far it lies beside them anyway.
pub(super) fn row(
    baked: &BakedGraph,
    (tick, support): (&Tick, &Support),
    (scales, now): (&Scales, &Numbers),
    beside: f32,
) -> Option<Row> {
    let rig = baked.graph().rig();
    let masses = Masses::of(baked, &tick.centres);
    let (distance, out) = outside(rig, tick, (support, masses.centre))?;
    let excess = distance - beside.max(support.allowed);
    if excess <= 0.0 {
        return None;
    }
    let out = Vec3::new(out.x, 0.0, out.y);
    let lever = tick.lever(rig, rig.spine().len(), masses.upper);
    let gradient = Gradient {
        // Of the legs, whose feet stay, about half goes along.
        pelvis: out * (0.5 + 0.5 * masses.upper_share) * tick.weight,
        spine: lever.cross(out) * masses.upper_share * tick.weight,
        ..Gradient::default()
    };
    let slope = gradient.scaled(scales).map(|number| -number);
    Some(Row {
        slope,
        least: excess + dot(&slope, now),
    })
}

/// How far the centre of mass lies beside the feet; `None` where it lies over them, or none stands.
pub(super) fn beside(baked: &BakedGraph, tick: &Tick, support: &Support) -> Option<f32> {
    let masses = Masses::of(baked, &tick.centres);
    outside(baked.graph().rig(), tick, (support, masses.centre)).map(|(distance, _)| distance)
}

/// How far a place lies beside the feet, and in which direction.
fn outside(rig: &Rig, tick: &Tick, (support, place): (&Support, Vec3)) -> Option<(f32, Vec2)> {
    let place = Vec2::new(place.x, place.z);
    let mut points = [Vec2::ZERO; 2 * Rig::LEGS];
    let mut count = 0;
    for limb in (0..Rig::LEGS).filter(|&limb| support.feet[limb]) {
        let leg = rig.limbs()[limb]?;
        for joint in [leg.foot, leg.toe_or_foot()] {
            let at = tick.joints[joint.index()].translation;
            points[count] = Vec2::new(at.x, at.z);
            count += 1;
        }
    }
    let points = &points[..count];
    if points.is_empty() {
        return None;
    }
    // The nearest point of a hull of so few points lies on a line between two of them, unless the place lies within three.
    let is_within = |a: Vec2, b: Vec2, c: Vec2| {
        let turns = [(a, b), (b, c), (c, a)].map(|(from, to)| (to - from).perp_dot(place - from));
        turns.iter().all(|&turn| turn >= 0.0) || turns.iter().all(|&turn| turn <= 0.0)
    };
    for (i, &a) in points.iter().enumerate() {
        for (j, &b) in points.iter().enumerate().skip(i + 1) {
            if points[j + 1..].iter().any(|&c| is_within(a, b, c)) {
                return None;
            }
        }
    }
    let mut nearest = points[0];
    for (i, &a) in points.iter().enumerate() {
        for &b in &points[i..] {
            let line = b - a;
            let share = (place - a).dot(line) / line.length_squared().max(f32::MIN_POSITIVE);
            let on_line = a + line * share.clamp(0.0, 1.0);
            if on_line.distance_squared(place) < nearest.distance_squared(place) {
                nearest = on_line;
            }
        }
    }
    let away = place - nearest;
    let distance = away.length() - HALF_FOOT;
    (distance > 0.0).then(|| (distance, away.normalize_or(Vec2::X)))
}
