//! Finds the nearest points of attack and body between the samples around a moment, and the conditions that keep them apart.

use glam::Vec3;

use super::linear::{Gradient, Linearization, Row, dot};
use super::ticks::{SphereDirection, Tick};
use crate::maps::{BakedGraph, Body, MovingSphere};
use crate::query::Attack;
use crate::query::clearance::{SAMPLE_RATE, closest};

/// A body sphere that the attack comes near to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact {
    /// Index of the sample before the contact.
    tick: usize,
    /// Position between the samples: 0 at sample `tick`, 1 at the next sample.
    share: f32,
    sphere: usize,
    /// Distance of the surfaces, in metres.
    pub metres: f32,
    /// Direction from the attack to the body.
    away: Vec3,
}

/// Spheres up to this distance beyond the margin get conditions too, in metres.
const NEAR: f32 = 0.04;
/// Maximum number of contacts between two samples.
const MOST: usize = 6;

/// Search for contacts of an attack with a body.
pub(super) struct ContactSearch<'a> {
    pub body: &'a Body,
    pub attack: &'a Attack,
    /// Distance that the attack should keep, in metres.
    pub margin: f32,
}

impl ContactSearch<'_> {
    /// Finds the contacts between consecutive samples, the nearest first for each pair.
    pub(super) fn run(&self, ticks: &[Tick], contacts: &mut Vec<Contact>) {
        contacts.clear();
        for (tick, pair) in ticks.windows(2).enumerate() {
            if pair[1].number != pair[0].number + 1 {
                continue;
            }
            let interval = Interval {
                tick,
                ticks: [&pair[0], &pair[1]],
            };
            let first = contacts.len();
            for sphere in self.attack.spheres() {
                contacts.extend(interval.contacts(self.body, sphere, self.margin + NEAR));
            }
            contacts[first..].sort_unstable_by(|a, b| {
                a.metres.total_cmp(&b.metres).then(a.sphere.cmp(&b.sphere))
            });
            contacts.truncate(first + MOST);
        }
    }
}

/// Two consecutive samples.
struct Interval<'a> {
    /// Index of the first sample.
    tick: usize,
    ticks: [&'a Tick; 2],
}

impl Interval<'_> {
    /// The nearest points of body spheres and a sphere of the attack during its flight. Only distances below `least` metres are reported.
    fn contacts(
        &self,
        body: &Body,
        attack: &MovingSphere,
        least: f32,
    ) -> impl Iterator<Item = Contact> {
        let &Self {
            tick,
            ticks: [from, to],
        } = self;
        let times = [from, to].map(|tick| tick.seconds().clamp(attack.start(), attack.end()));
        let balls = times.map(|t| attack.at(t));
        let shares = times.map(|t| t * SAMPLE_RATE - from.number as f32);
        let spheres = match times[0] < times[1] {
            true => body.spheres.as_slice(),
            false => &[],
        };
        spheres.iter().enumerate().filter_map(move |(sphere, own)| {
            let (start, end) = (from.centres[sphere], to.centres[sphere]);
            let apart = [0, 1].map(|at| start.lerp(end, shares[at]) - balls[at].center);
            let radii = balls.map(|ball| ball.radius + own.radius);
            // Most spheres are farther away at the start than both can move.
            let reach = least + radii[0].max(radii[1]) + (apart[1] - apart[0]).length();
            if reach > 0.0 && apart[0].length_squared() > reach * reach {
                return None;
            }
            let (share, metres) = closest(apart, radii);
            (metres < least).then(|| Contact {
                tick,
                share: shares[0] + (shares[1] - shares[0]) * share,
                sphere,
                metres,
                away: apart[0].lerp(apart[1], share).normalize_or(Vec3::Y),
            })
        })
    }
}

impl Contact {
    /// Gradient of the distance of the surfaces with respect to the bend.
    pub(super) fn gradient(&self, baked: &BakedGraph, ticks: &mut [Tick]) -> Gradient {
        let places = [self.tick, self.tick + 1].map(|tick| ticks[tick].centres[self.sphere]);
        let velocity = (places[1] - places[0]) * SAMPLE_RATE;
        let nearest = self.tick + usize::from(self.share > 0.5);
        let direction = SphereDirection {
            sphere: self.sphere,
            away: self.away,
        };
        ticks[nearest].gradient(baked, direction, velocity)
    }

    /// Condition that changes the bend `now` to one that keeps the attack at the margin.
    pub(super) fn row(&self, gradient: &Gradient, now: Linearization<'_>, margin: f32) -> Row {
        let slope = gradient.scaled(now.scales);
        Row {
            slope,
            least: margin - self.metres + dot(&slope, now.numbers),
        }
    }
}
