//! Which threats may reach a character, by a test of their ways over the ground: a few nanoseconds for each pair.
//!
//! While a threat is as high as bodies are, it moves over the ground in a straight line, whether it falls or not. So each threat has at most
//! two lines on the ground, one on the way up and one on the way down; a character that is far from both cannot be reached.

use glam::Vec2;

use super::threat::{Threat, Window};
use super::watch::range_in_step;
use super::world::KnownThreat;

/// The ways of the threats of one step over the ground.
#[derive(Debug, Default)]
pub(super) struct Flights {
    ways: Vec<Way>,
}

/// A straight way over the ground.
#[derive(Clone, Copy, Debug)]
struct Way {
    /// Index of the threat.
    threat: u32,
    /// Start, and the way to the end, in metres.
    from: Vec2,
    along: Vec2,
    /// Inverse of the squared length.
    inverse: f32,
    /// Square of the distance within which a root may be reached.
    reach: f32,
}

impl Flights {
    /// Finds the ways of threats from `now` on, for a step of `dt` seconds. `heights` are those between which the characters' roots are, and a body
    /// reaches as far as `reach` from its root.
    pub(super) fn find(
        &mut self,
        threats: &[KnownThreat],
        [now, dt]: [f64; 2],
        heights: [f32; 2],
        reach: f32,
    ) {
        /// Added to all distances, in metres: numbers are rounded.
        const ROUNDING: f32 = 0.05;
        self.ways.clear();
        for (index, known) in (0..).zip(threats) {
            let threat = &known.threat;
            let apart = Window::FURTHEST.max(2.0 * range_in_step(threat, dt as f32));
            let reach = reach + threat.radius() + apart + ROUNDING;
            let low = f64::from(heights[0] - reach);
            let high = f64::from(heights[1] + reach);
            for [from, to] in between(threat, (now - threat.time).max(0.0), [low, high]) {
                let [from, to] = [from, to].map(|t| {
                    let t = t.clamp(0.0, f64::from(threat.seconds)) as f32;
                    let at = threat.position + threat.velocity * t;
                    Vec2::new(at.x, at.z)
                });
                let along = to - from;
                self.ways.push(Way {
                    threat: index,
                    from,
                    along,
                    inverse: 1.0 / along.length_squared().max(1e-12),
                    reach: reach * reach,
                });
            }
        }
    }

    /// Lists the indices of the threats that may reach a root at a place on the ground, in their order.
    pub(super) fn near(&self, place: Vec2, out: &mut Vec<u32>) {
        out.clear();
        for way in &self.ways {
            let to = place - way.from;
            let share = (to.dot(way.along) * way.inverse).clamp(0.0, 1.0);
            let is_near = (to - way.along * share).length_squared() <= way.reach;
            if is_near && out.last() != Some(&way.threat) {
                out.push(way.threat);
            }
        }
    }
}

/// The times from `first` to its end in which a threat is between two heights, counted from [`Threat::time`], in seconds. They are a
/// little longer where numbers are rounded.
fn between(threat: &Threat, first: f64, [low, high]: [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
    /// In seconds.
    const ROUNDING: f64 = 1e-3;
    /// What falls more slowly flies straight, in metres per second squared.
    const LIGHT: f64 = 1e-6;
    let last = f64::from(threat.seconds);
    let [start, speed, gravity] =
        [threat.position.y, threat.velocity.y, threat.gravity].map(f64::from);
    let gravity = if gravity.abs() < LIGHT { 0.0 } else { gravity };
    // The times at which it is at a height, in their order; `None` if never.
    let times = |height: f64| {
        if gravity == 0.0 {
            let time = (height - start) / speed;
            return Some(match speed < 0.0 {
                true => [f64::NEG_INFINITY, time],
                false => [time, f64::INFINITY],
            });
        }
        let middle = speed / gravity;
        let squared = middle * middle + 2.0 * (start - height) / gravity;
        (squared >= 0.0).then(|| [middle - squared.sqrt(), middle + squared.sqrt()])
    };
    let all = [f64::NEG_INFINITY, f64::INFINITY];
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let both = match (speed, gravity) {
        (0.0, 0.0) if (low..=high).contains(&start) => [all, none],
        (0.0, 0.0) => [none; 2],
        // Above the lower height between the outer times, and above the upper one between the inner ones; for one that rises faster and faster
        // it is the other way around.
        _ => {
            let (outer, inner) = match gravity < 0.0 {
                true => (times(high), times(low)),
                false => (times(low), times(high)),
            };
            match (outer, inner) {
                (None, _) => [none; 2],
                (Some(outer), None) => [outer, none],
                (Some(outer), Some(inner)) => [[outer[0], inner[0]], [inner[1], outer[1]]],
            }
        }
    };
    let cut = move |[from, to]: [f64; 2]| {
        let cut = [(from - ROUNDING).max(first), (to + ROUNDING).min(last)];
        (cut[0] <= cut[1]).then_some(cut)
    };
    both.into_iter().filter_map(cut)
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, Vec3Swizzles};
    use proptest::prelude::*;

    use super::*;
    use crate::character::event::ThreatId;

    const HEIGHTS: [f32; 2] = [0.5, 1.5];
    const REACH: f32 = 1.0;

    fn vector(most: f32) -> impl Strategy<Value = Vec3> {
        [-most..most, -most..most, -most..most].prop_map(Vec3::from)
    }

    proptest! {
        #[test]
        fn what_comes_near_is_listed_and_what_stays_far_is_not(
            place in vector(40.0),
            velocity in vector(25.0),
            gravity in prop_oneof![Just(0.0f32), Just(9.81), -30.0f32..30.0],
            (root, now) in (vector(10.0), 0.0..2.0f64),
        ) {
            let threat = Threat { gravity, seconds: 5.0, ..Threat::ball(0.0, place, velocity, 0.1) };
            let mut flights = Flights::default();
            let known = KnownThreat { id: ThreatId(0), version: 0, threat: threat.clone(), limb: None };
            flights.find(&[known], [now, 1.0 / 60.0], HEIGHTS, REACH);
            let mut near = Vec::new();
            flights.near(root.xz(), &mut near);
            let (mut apart, mut aside) = (f32::INFINITY, f32::INFINITY);
            for sample in 0..=2000 {
                let at = threat.at(now + (5.0 - now) * f64::from(sample) / 2000.0);
                let above = (at.y - HEIGHTS[1]).max(HEIGHTS[0] - at.y).max(0.0);
                let beside = at.xz().distance(root.xz());
                apart = apart.min(beside.hypot(above));
                if above < REACH + 3.0 {
                    aside = aside.min(beside);
                }
            }
            let range = REACH + 0.1 + Window::FURTHEST;
            prop_assert!(apart > range || near == [0], "{apart}");
            prop_assert!(aside < range + 0.4 || near.is_empty(), "{aside}");
        }
    }
}
