//! The attack's spheres from sample to sample of the body.

use glam::Vec3;

use super::nearest::{Ball, Spheres};
use super::{Clearance, Extent, SAMPLE_RATE};
use crate::avoid::Attack;
use crate::math::Rigid2;
use crate::region::{MovingSphere, SphereKey};

/// Where the body's spheres are at the samples of some clock.
pub(super) trait Samples {
    /// A sphere that holds the whole body at a sample.
    fn bound(&mut self, tick: usize) -> (Vec3, f32);
    /// Makes the spheres of a sample and of the next one known.
    fn prepare(&mut self, tick: usize);
    /// The spheres at a sample and at the next one, which are prepared.
    fn spheres(&self, tick: usize) -> Spheres<'_>;
    /// How many spheres are not padding.
    fn count(&self) -> usize;
}

/// From which time to which the samples are asked, and how they lie in the attack's world.
#[derive(Clone, Copy)]
pub(super) struct Course {
    /// Seconds of the attack's clock.
    pub known: (f32, f32),
    /// The attack's time at sample 0.
    pub origin: f32,
    /// Takes the attack's world to that of the samples.
    pub placement: Rigid2,
}

impl Course {
    /// On a motion the clock and the world are the attack's own.
    pub(super) fn of_motion(known: (f32, f32)) -> Self {
        Self {
            known,
            origin: 0.0,
            placement: Rigid2::IDENTITY,
        }
    }
}

/// The smallest distance so far.
pub(super) struct Sweep<'a> {
    attack: &'a Attack,
    extent: Extent,
    best: Clearance,
}

impl<'a> Sweep<'a> {
    pub(super) fn new(attack: &'a Attack, extent: Extent) -> Self {
        Self {
            attack,
            extent,
            best: Clearance::none(attack.start()),
        }
    }

    pub(super) fn nearest(&self) -> Clearance {
        self.best
    }

    fn is_over(&self) -> bool {
        self.extent == Extent::UntilHit && !self.best.is_clean()
    }

    /// Goes through the part of the attack that lies in the course's time.
    pub(super) fn part(&mut self, samples: &mut impl Samples, course: Course) {
        for sphere in self.attack.spheres() {
            if let [only] = sphere.keys() {
                if (course.known.0..=course.known.1).contains(&only.t) {
                    self.pair([*only; 2], samples, course);
                }
                continue;
            }
            for pair in sphere.keys().windows(2) {
                if self.is_over() {
                    return;
                }
                let (from, to) = (pair[0].t.max(course.known.0), pair[1].t.min(course.known.1));
                if from < to {
                    let cut = [from, to].map(|t| MovingSphere::between(pair[0], pair[1], t));
                    self.pair(cut, samples, course);
                }
            }
        }
    }

    /// A sphere on one straight way.
    fn pair(&mut self, keys: [SphereKey; 2], samples: &mut impl Samples, course: Course) {
        let keys = keys.map(|key| SphereKey {
            t: (key.t - course.origin).max(0.0),
            center: course.placement.point(key.center),
            ..key
        });
        let tick_of = |t: f32| (t * SAMPLE_RATE).floor() as usize;
        let ticks = tick_of(keys[0].t)..=tick_of(keys[1].t);
        // Where the attack comes nearest to the middle of the body it is looked at first: there
        // a hit is found at once, and nearly at its deepest.
        let mut first = (f32::INFINITY, *ticks.start());
        let mut before = samples.bound(*ticks.start());
        for tick in ticks.clone() {
            let after = samples.bound(tick + 1);
            let bound = ball(keys, tick).distance_to([before, after]);
            if bound < first.0 {
                first = (bound, tick);
            }
            before = after;
        }
        if first.0 < self.best.metres {
            self.meet(first.1, &ball(keys, first.1), samples, course.origin);
        }
        let mut before = samples.bound(*ticks.start());
        for tick in ticks {
            if self.is_over() {
                return;
            }
            let (ball, after) = (ball(keys, tick), samples.bound(tick + 1));
            // The whole body lies within a bound: often that is proof enough.
            if tick != first.1 && ball.distance_to([before, after]) < self.best.metres {
                self.meet(tick, &ball, samples, course.origin);
            }
            before = after;
        }
    }

    fn meet(&mut self, tick: usize, ball: &Ball, samples: &mut impl Samples, origin: f32) {
        samples.prepare(tick);
        let spheres = samples.spheres(tick);
        if let Some(nearest) = spheres.nearest(ball, samples.count(), self.best.metres) {
            let share = ball.shares[0] + (ball.shares[1] - ball.shares[0]) * nearest.share;
            self.best = Clearance {
                metres: nearest.metres,
                time: origin + (tick as f32 + share) / SAMPLE_RATE,
                body_sphere: nearest.sphere,
            };
        }
    }
}

/// A sphere on its way between two keys, during a sample and up to the next one.
fn ball(keys: [SphereKey; 2], tick: usize) -> Ball {
    let within = |tick: usize| (tick as f32 / SAMPLE_RATE).clamp(keys[0].t, keys[1].t);
    let ends = [tick, tick + 1].map(|tick| MovingSphere::between(keys[0], keys[1], within(tick)));
    Ball {
        centres: ends.map(|end| end.center),
        radii: ends.map(|end| end.radius),
        shares: ends.map(|end| (end.t * SAMPLE_RATE - tick as f32).clamp(0.0, 1.0)),
    }
}
