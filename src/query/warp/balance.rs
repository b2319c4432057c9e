//! Balance of a standing body: the centre of mass must lie over the feet.
//!
//! Source: the support polygon for standing, and the inverted pendulum while a foot is lifted: a body at a distance d from its support
//! moves by d (cosh(t √(g / h)) - 1) within t seconds (Hof, Gazendam & Sinke 2005, equation 2).

use glam::{Vec2, Vec3};

use super::linear::{Gradient, Linearization, Row, dot};
use super::ticks::Tick;
use crate::anim::Rig;
use crate::maps::BakedGraph;

/// Distance from the bones of a foot to its edge, in metres.
const HALF_FOOT: f32 = 0.05;

/// Support of a body that stands still.
#[derive(Clone, Copy, Debug)]
pub(super) struct Support {
    /// Whether each foot is planted.
    pub feet: [bool; Rig::LEGS],
    /// Maximum distance of the centre of mass from the support, in metres.
    pub allowed: f32,
}

impl Support {
    /// Support while the foot of a limb is lifted for `seconds`.
    pub(super) fn without(self, limb: usize, seconds: f32) -> Self {
        /// √(g / h) in 1/s, and the maximum sway in metres.
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

/// Centre of mass of the whole body, and of trunk, arms and head, and their share of the mass. Masses are the volumes of the spheres.
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

/// A body that stands still on its feet, at one sample.
#[derive(Clone, Copy)]
pub(super) struct StandingBody<'a> {
    pub baked: &'a BakedGraph,
    pub tick: &'a Tick,
    pub support: Support,
}

impl StandingBody<'_> {
    /// Condition that keeps the centre of mass over the feet, if the bend `now` does not. `beside` is its distance from the support
    /// without a warp.
    pub(super) fn row(&self, now: Linearization<'_>, beside: f32) -> Option<Row> {
        let &Self {
            baked,
            tick,
            support,
        } = self;
        let rig = baked.graph().rig();
        let masses = Masses::of(baked, &tick.centres);
        let (distance, out) = self.outside(masses.centre)?;
        let excess = distance - beside.max(support.allowed);
        if excess <= 0.0 {
            return None;
        }
        let out = Vec3::new(out.x, 0.0, out.y);
        let lever = tick.lever(rig, rig.spine().len(), masses.upper);
        let gradient = Gradient {
            // About half of the mass of the legs, whose feet stay in place, follows the pelvis.
            pelvis: out * (0.5 + 0.5 * masses.upper_share) * tick.weight,
            spine: lever.cross(out) * masses.upper_share * tick.weight,
            ..Gradient::default()
        };
        let slope = gradient.scaled(now.scales).map(|number| -number);
        Some(Row {
            slope,
            least: excess + dot(&slope, now.numbers),
        })
    }

    /// Distance of the centre of mass from the support, or `None` if it lies over the support or no foot is planted.
    pub(super) fn beside(&self) -> Option<f32> {
        let masses = Masses::of(self.baked, &self.tick.centres);
        self.outside(masses.centre).map(|(distance, _)| distance)
    }

    /// Distance and direction of a point from the support.
    fn outside(&self, place: Vec3) -> Option<(f32, Vec2)> {
        let rig = self.baked.graph().rig();
        let place = Vec2::new(place.x, place.z);
        let mut points = [Vec2::ZERO; 2 * Rig::LEGS];
        let mut count = 0;
        for limb in (0..Rig::LEGS).filter(|&limb| self.support.feet[limb]) {
            let leg = rig.limbs()[limb]?;
            for joint in [leg.foot, leg.toe_or_foot()] {
                let at = self.tick.joints[joint.index()].translation;
                points[count] = Vec2::new(at.x, at.z);
                count += 1;
            }
        }
        let points = &points[..count];
        if points.is_empty() {
            return None;
        }
        // The nearest point of a convex hull of so few points lies on a line between two of them, unless the position lies inside a triangle of
        // three.
        let is_within = |a: Vec2, b: Vec2, c: Vec2| {
            let turns =
                [(a, b), (b, c), (c, a)].map(|(from, to)| (to - from).perp_dot(place - from));
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
}
