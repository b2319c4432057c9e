use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::error::{CharacterError, FURTHEST, shorter, within};
use super::event::CharacterId;
use crate::maps::SphereKey;
use crate::math::Sphere;

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

    /// Position at a time of the game.
    #[must_use]
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
        /// A body moves this far to meet or to avoid a threat, in metres.
        const ROOM: f32 = 1.0;
        /// A body needs this long to move away, in seconds.
        const REACTION: f32 = 0.45;
        let first = (self.time - from).max(0.0) as f32;
        let last = (self.time + f64::from(self.seconds) - from) as f32;
        if last <= first {
            return None;
        }
        let apart = |t: f32| (self.at(from + f64::from(t)) - body.centre).length();
        let nearest = self.nearest([first, last], &apart);
        let metres = apart(nearest) - self.radius();
        if metres > body.radius + ROOM {
            return None;
        }
        let speed = self.velocity.length().max(0.1);
        let around = body.radius + self.radius() + 0.5;
        let before = (around / speed).clamp(REACTION, 2.0);
        let after = ((around + ROOM) / speed).clamp(0.1, 2.0);
        Some(Window {
            from,
            start: (nearest - before).max(first),
            nearest,
            end: (nearest + after).min(last).max(first + 1e-3),
            metres,
        })
    }

    /// Time at which it is nearest, by a search over a grid and its halving: flights are short.
    fn nearest(&self, [first, last]: [f32; 2], apart: &impl Fn(f32) -> f32) -> f32 {
        const STEPS: usize = 64;
        let (mut from, mut to) = (first, last);
        for _ in 0..3 {
            let step = (to - from) / STEPS as f32;
            let at = |index: usize| from + step * index as f32;
            let least = (0..=STEPS)
                .map(at)
                .min_by(|a, b| apart(*a).total_cmp(&apart(*b)));
            let least = least.unwrap_or(from);
            (from, to) = ((least - step).max(first), (least + step).min(last));
        }
        0.5 * (from + to)
    }

    /// Adds the keys of its spheres in a window, with radii that are larger by `margin` metres.
    pub(super) fn keys(&self, window: &Window, margin: f32, out: &mut Vec<Vec<SphereKey>>) {
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
                    center: self.at(window.from + f64::from(t)) + sphere.centre,
                    radius: sphere.radius + margin,
                }
            };
            out.push((0..=steps).map(key).collect());
        }
    }
}
