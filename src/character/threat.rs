use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::error::{CharacterError, FURTHEST, shorter, within};
use super::event::CharacterId;
use crate::maps::SphereKey;
use crate::math::Sphere;
use crate::query::Attack;

/// A moving object that characters avoid.
///
/// It exists from [`Threat::time`] on. A time in the future announces a threat, for example a throw before the ball flies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Threat {
    /// Time of the game ([`Characters::now`](super::Characters::now)) to which position and velocity refer, in seconds. At most an hour from
    /// now.
    pub time: f64,
    /// Position then, in metres; at most 5 km from the origin.
    pub position: Vec3,
    /// Velocity then, in metres per second; at most 1,000.
    pub velocity: Vec3,
    /// Acceleration downwards, in metres per second squared; -100 to 100. Default 0.
    pub gravity: f32,
    /// Spheres that move together, 1 to 64, each with its centre relative to the position, at most 100 m away, and a radius of at most 50 m.
    pub spheres: Vec<Sphere>,
    /// Time for which it exists, in seconds; at most 60. Default 10.
    pub seconds: f32,
    /// The character that avoids it; `None`: all characters.
    pub target: Option<CharacterId>,
}

/// The time in which a threat may reach a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Window {
    /// Time of the game from which the other times count, in seconds.
    pub from: f64,
    /// First time at which the threat may reach the body; 0 or more.
    pub start: f32,
    /// Time at which the threat is nearest to the middle of the body.
    pub nearest: f32,
    pub end: f32,
    /// Distance from the body's middle then, to the surface of the largest sphere, in metres.
    pub metres: f32,
}

impl Window {
    /// A body moves this far to meet or to avoid a threat, in metres.
    pub(super) const ROOM: f32 = 1.0;
    /// A threat that flies by further than this from what a body reaches now has no window, in metres.
    pub(super) const FURTHEST: f32 = 2.0 * Self::ROOM;
}

impl Threat {
    /// A ball that flies straight.
    #[must_use]
    pub fn ball(time: f64, position: Vec3, velocity: Vec3, radius: f32) -> Self {
        Self {
            time,
            position,
            velocity,
            gravity: 0.0,
            spheres: vec![Sphere::new(Vec3::ZERO, radius)],
            seconds: 10.0,
            target: None,
        }
    }

    /// Refuses numbers that are not finite, or outside the ranges of the fields. `now` is the characters' time.
    pub(super) fn check(&self, now: f64) -> Result<(), CharacterError> {
        const AN_HOUR: f32 = 3_600.0;
        let from_now = (self.time - now) as f32;
        within("the threat's time from now", from_now, -AN_HOUR..=AN_HOUR)?;
        let place = "the threat's distance from the origin";
        shorter(place, self.position, FURTHEST)?;
        shorter("the threat's speed", self.velocity, 1_000.0)?;
        within("the threat's gravity", self.gravity, -100.0..=100.0)?;
        within("the threat's duration", self.seconds, 0.0..=60.0)?;
        let count = self.spheres.len() as f32;
        within("the threat's number of spheres", count, 1.0..=64.0)?;
        self.spheres.iter().try_for_each(|sphere| {
            let place = "the distance of a sphere from the threat's position";
            shorter(place, sphere.centre, 100.0)?;
            within(
                "the radius of a threat's sphere",
                sphere.radius,
                1e-6..=50.0,
            )
        })
    }

    /// Whether a character has to avoid it.
    pub(super) fn is_for(&self, id: CharacterId) -> bool {
        self.target.is_none_or(|target| target == id)
    }

    /// Position at a time of the game.
    pub fn at(&self, time: f64) -> Vec3 {
        let t = (time - self.time) as f32;
        self.position + self.velocity * t - Vec3::Y * (0.5 * self.gravity * t * t)
    }

    /// Whether the threat has ended, or moves away from a point.
    pub(super) fn has_passed(&self, time: f64, point: Vec3) -> bool {
        let fallen = Vec3::Y * (self.gravity * (time - self.time) as f32);
        let goes_away = (self.at(time) - point).dot(self.velocity - fallen) >= 0.0;
        time >= self.time + f64::from(self.seconds) || goes_away
    }

    /// Largest distance of a point of its spheres from its position, in metres.
    pub(super) fn radius(&self) -> f32 {
        let reach = |s: &Sphere| s.centre.length() + s.radius;
        self.spheres.iter().map(reach).fold(0.0, f32::max)
    }

    /// When it may reach a body within a sphere, counted from `from`; `None` if it is past or passes too far away.
    pub(super) fn window(&self, from: f64, body: Sphere) -> Option<Window> {
        /// A body needs this long to move away, in seconds.
        const REACTION: f32 = 0.45;
        let first = (self.time - from).max(0.0) as f32;
        let last = (self.time + f64::from(self.seconds) - from) as f32;
        if last <= first {
            return None;
        }
        let nearest = self.nearest(from, [first, last], body.centre);
        let apart = (self.at(from + f64::from(nearest)) - body.centre).length();
        let metres = apart - self.radius();
        if metres > body.radius + Window::ROOM {
            return None;
        }
        let speed = self.velocity.length().max(0.1);
        let around = body.radius + self.radius() + 0.5;
        let before = (around / speed).clamp(REACTION, 2.0);
        let after = ((around + Window::ROOM) / speed).clamp(0.1, 2.0);
        Some(Window {
            from,
            start: (nearest - before).max(first),
            nearest,
            end: (nearest + after).min(last).max(first + 1e-3),
            metres,
        })
    }

    /// Time from `first` to `last` at which it is nearest to a point, the first of several; all counted from `from`. The derivative of the squared
    /// distance is linear for a straight flight, and cubic for a parabola: between two of its extremes it has at most one zero.
    fn nearest(&self, from: f64, [first, last]: [f32; 2], point: Vec3) -> f32 {
        let since = from + f64::from(first) - self.time;
        let fall = DVec3::NEG_Y * f64::from(self.gravity);
        let (place, velocity) = (self.position.as_dvec3(), self.velocity.as_dvec3());
        // Position, velocity and half of the acceleration at `first`.
        let place = place + since * (velocity + 0.5 * since * fall) - point.as_dvec3();
        let (velocity, fall) = (velocity + since * fall, 0.5 * fall);
        let most = f64::from(last - first);
        let squared = |t: f64| (place + t * (velocity + t * fall)).length_squared();
        // Half of the derivative, of degree 0 to 3.
        let slope = [
            place.dot(velocity),
            velocity.length_squared() + 2.0 * place.dot(fall),
            3.0 * velocity.dot(fall),
            2.0 * fall.length_squared(),
        ];
        let mut best = (squared(0.0), 0.0);
        let mut consider = |t: f64| {
            if squared(t) < best.0 {
                best = (squared(t), t);
            }
        };
        if self.gravity == 0.0 {
            let straight = -slope[0] / slope[1].max(f64::MIN_POSITIVE);
            consider(straight.clamp(0.0, most));
        } else {
            let middle = -slope[2] / (3.0 * slope[3]);
            let aside = (middle * middle - slope[1] / (3.0 * slope[3]))
                .max(0.0)
                .sqrt();
            let ends = [0.0, middle - aside, middle + aside, most];
            let ends = ends.map(|end| end.clamp(0.0, most));
            for pair in ends.windows(2) {
                consider(rising_zero(&slope, [pair[0], pair[1]]));
            }
        }
        first + best.1 as f32
    }

    /// Adds its spheres in a window, above a ground at a height, with radii that are larger by `margin` metres.
    pub(super) fn add_to(&self, out: &mut Attack, window: &Window, height: f32, margin: f32) {
        /// Time between keys of a curved flight, in seconds.
        const CURVED: f32 = 0.05;
        let steps = match self.gravity {
            0.0 => 1,
            _ => ((window.end - window.start) / CURVED).ceil().max(1.0) as usize,
        };
        for sphere in &self.spheres {
            let key = |step: usize| {
                let share = step as f32 / steps as f32;
                let t = window.start + (window.end - window.start) * share;
                SphereKey {
                    t,
                    center: self.at(window.from + f64::from(t)) + sphere.centre - Vec3::Y * height,
                    radius: sphere.radius + margin,
                }
            };
            out.push((0..=steps).map(key));
        }
    }
}

/// Where a cubic that is monotone between two ends rises through 0; otherwise the end at which it is nearer to doing so. Newton's method, and bisection
/// where that leaves the ends.
fn rising_zero(cubic: &[f64; 4], [mut from, mut to]: [f64; 2]) -> f64 {
    const MOST_STEPS: usize = 60;
    /// In seconds.
    const EXACT: f64 = 1e-8;
    let [a, b, c, d] = *cubic;
    let value = |t: f64| a + t * (b + t * (c + t * d));
    if value(from) >= 0.0 || value(to) <= 0.0 {
        return if value(from) >= 0.0 { from } else { to };
    }
    let mut t = 0.5 * (from + to);
    for _ in 0..MOST_STEPS {
        let now = value(t);
        match now < 0.0 {
            true => from = t,
            false => to = t,
        }
        let next = t - now / (b + t * (2.0 * c + t * 3.0 * d));
        let next = if next > from && next < to {
            next
        } else {
            0.5 * (from + to)
        };
        if (next - t).abs() < EXACT {
            return next;
        }
        t = next;
    }
    t
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn vector(most: f32) -> impl Strategy<Value = Vec3> {
        [-most..most, -most..most, -most..most].prop_map(Vec3::from)
    }

    proptest! {
        #[test]
        fn the_nearest_moment_is_that_of_dense_samples(
            place in vector(30.0),
            velocity in vector(20.0),
            gravity in prop_oneof![Just(0.0f32), Just(9.81), -100.0f32..100.0],
            point in vector(5.0),
            (from, first, seconds) in (-2.0..2.0f64, 0.0..1.0f32, 0.0..6.0f32),
        ) {
            const SAMPLES: usize = 4000;
            let threat = Threat { gravity, ..Threat::ball(0.5, place, velocity, 0.1) };
            let last = first + seconds;
            let apart = |t: f32| threat.at(from + f64::from(t)).distance(point);
            let found = threat.nearest(from, [first, last], point);
            prop_assert!((first..=last).contains(&found));
            let sampled = |index: usize| apart(first + seconds * index as f32 / SAMPLES as f32);
            let least = (0..=SAMPLES).map(sampled).fold(f32::INFINITY, f32::min);
            prop_assert!(apart(found) <= least + 1e-3, "{} {least}", apart(found));
        }
    }

    #[test]
    fn what_rests_is_nearest_at_once() {
        let threat = Threat::ball(0.0, Vec3::ONE, Vec3::ZERO, 0.1);
        assert_eq!(threat.nearest(0.0, [0.25, 9.0], Vec3::ZERO), 0.25);
    }
}
