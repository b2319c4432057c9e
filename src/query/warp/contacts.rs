//! The nearest points of attack and body between the samples around a moment, and the conditions that keep them apart.

use glam::Vec3;

use super::linear::{Numbers, Row, Scales, dot};
use super::ticks::Tick;
use crate::maps::{BakedGraph, MovingSphere};
use crate::query::Attack;
use crate::query::clearance::{SAMPLE_RATE, closest};

/// A body sphere that the attack comes near to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact {
    /// Index of the sample before the contact.
    tick: usize,
    /// Position between the samples: 0 at that sample, 1 at the next.
    share: f32,
    sphere: usize,
    /// Distance of the surfaces.
    pub metres: f32,
    /// Direction from the attack to the body.
    away: Vec3,
}

/// Spheres up to this distance beyond the margin get conditions too, in metres.
const NEAR: f32 = 0.04;
/// Maximum number of contacts between two samples.
const MOST: usize = 6;

/// Finds the contacts between consecutive samples, the nearest first for each pair.
pub(super) fn find(
    baked: &BakedGraph,
    (attack, margin): (&Attack, f32),
    ticks: &[Tick],
    contacts: &mut Vec<Contact>,
) {
    contacts.clear();
    for (tick, pair) in ticks.windows(2).enumerate() {
        if pair[1].number != pair[0].number + 1 {
            continue;
        }
        let first = contacts.len();
        for sphere in attack.spheres() {
            between(baked, (sphere, tick), [&pair[0], &pair[1]], |contact| {
                if contact.metres < margin + NEAR {
                    contacts.push(contact);
                }
            });
        }
        contacts[first..]
            .sort_unstable_by(|a, b| a.metres.total_cmp(&b.metres).then(a.sphere.cmp(&b.sphere)));
        contacts.truncate(first + MOST);
    }
}

fn between(
    baked: &BakedGraph,
    (attack, tick): (&MovingSphere, usize),
    [from, to]: [&Tick; 2],
    mut found: impl FnMut(Contact),
) {
    let times = [from, to].map(|tick| tick.seconds().clamp(attack.start(), attack.end()));
    if times[0] >= times[1] {
        return;
    }
    let balls = times.map(|t| attack.at(t));
    let shares = times.map(|t| t * SAMPLE_RATE - from.number as f32);
    for (sphere, own) in baked.body().spheres.iter().enumerate() {
        let (start, end) = (from.centres[sphere], to.centres[sphere]);
        let apart = [0, 1].map(|at| start.lerp(end, shares[at]) - balls[at].center);
        let radii = balls.map(|ball| ball.radius + own.radius);
        let (share, metres) = closest(apart, radii);
        found(Contact {
            tick,
            share: shares[0] + (shares[1] - shares[0]) * share,
            sphere,
            metres,
            away: apart[0].lerp(apart[1], share).normalize_or(Vec3::Y),
        });
    }
}

impl Contact {
    /// Condition that changes the bend with the numbers `now` to one that keeps the attack at the margin.
    pub(super) fn row(
        &self,
        baked: &BakedGraph,
        ticks: &mut [Tick],
        (scales, margin): (&Scales, f32),
        now: &Numbers,
    ) -> Row {
        let places = [self.tick, self.tick + 1].map(|tick| ticks[tick].centres[self.sphere]);
        let velocity = (places[1] - places[0]) * SAMPLE_RATE;
        let nearest = self.tick + usize::from(self.share > 0.5);
        let gradient = ticks[nearest].gradient(baked, (self.sphere, self.away), velocity);
        let slope = gradient.scaled(scales);
        Row {
            slope,
            least: margin - self.metres + dot(&slope, now),
        }
    }
}
