//! The attack's spheres from sample to sample of the body.

use std::ops::RangeInclusive;

use super::balls::{LANES, Lanes};
use super::nearest::{Ball, Nearest, Spheres};
use super::{Clearance, Extent, SAMPLE_RATE};
use crate::maps::{BodyTrack, MovingSphere, SphereKey};
use crate::math::Rigid2;
use crate::query::attack::Attack;

/// Where the body's spheres are at the samples of some clock.
pub(super) trait Samples {
    /// How many samples there are from the start of a stretch to its end.
    fn stretch(&self) -> usize;
    /// For each of so many stretches, sixteen at most, that follow each other from a sample on: something that the distance of
    /// a sphere, on its way between two keys, from the whole body all through the stretch is not below.
    fn bounds(&self, keys: [SphereKey; 2], stretches: (usize, usize)) -> Lanes;
    /// Adds the blocks of the body's spheres that may come nearer than `limit` to a ball all through the stretch from a sample on.
    fn near(&self, tick: usize, ball: &Ball, limit: f32, blocks: &mut Vec<usize>);
    /// How samples are gone through.
    fn pace(&self) -> Pace;
    /// Makes the spheres of a sample known.
    fn prepare(&mut self, tick: usize);
    /// The spheres at two samples, which are prepared.
    fn spheres(&self, ticks: [usize; 2]) -> Spheres<'_>;
    /// How many spheres are not padding.
    fn count(&self) -> usize;
}

/// How the samples of a stretch are gone through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pace {
    /// One by one.
    Each,
    /// The stretch's ends first, as if it were straight.
    EndsFirst,
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

/// Stretches between two samples, each with a distance that it is not nearer than; kept from one
/// sweep to the next.
#[derive(Clone, Debug, Default)]
pub(super) struct Stretches {
    /// By the bounds of the whole body.
    bounded: Vec<(f32, usize)>,
    /// By what is half known of its spheres.
    coarse: Vec<(f32, usize)>,
    /// The blocks of the body's spheres that may come near in one of them.
    near: Vec<usize>,
}

/// By how much the body's spheres leave the straight lines between samples that are a whole stretch
/// apart, metres: 15 rad/s at 0.7 m from the joint make 0.7 (1 - cos(15 / 60)) m = 2.2 cm. What goes
/// further out may be taken for cleaner than it is, until its very motion is tested.
const STRAY: f32 = 0.025;

/// The smallest distance so far.
pub(super) struct Sweep<'a> {
    attack: &'a Attack,
    extent: Extent,
    best: Clearance,
    /// The nearest of what is half known: as if the body went straight from the start of a stretch to its end.
    half_known: Option<Nearest>,
    stretches: &'a mut Stretches,
}

impl<'a> Sweep<'a> {
    /// Looks for distances below the extent's limit.
    pub(super) fn new(attack: &'a Attack, extent: Extent, stretches: &'a mut Stretches) -> Self {
        let none = Clearance::none(attack.start());
        Self {
            attack,
            extent,
            best: Clearance {
                metres: extent.below,
                ..none
            },
            half_known: None,
            stretches,
        }
    }

    /// The smallest distance. Where the extent asks for no more than a hit, one that it is not above.
    pub(super) fn nearest(&self) -> Clearance {
        let half_known = { self.half_known }.filter(|_| self.is_over());
        let at_most = half_known.map_or(f32::INFINITY, |nearest| nearest.metres + STRAY);
        Clearance {
            metres: self.best.metres.min(at_most),
            ..self.best
        }
    }

    pub(super) fn is_over(&self) -> bool {
        self.best.metres < self.extent.enough
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
        let mut stretches = std::mem::take(self.stretches);
        self.bound(keys, samples, &mut stretches.bounded);
        stretches.coarse.clear();
        // Where the attack comes nearest to the middle of the body it is looked at first: there
        // a hit is found at once, and nearly at its deepest.
        for &(bound, tick) in &stretches.bounded {
            if self.is_over() || bound >= self.best.metres {
                break;
            }
            if samples.pace() == Pace::Each {
                let ends = [tick, tick + samples.stretch()];
                let limit = self.best.metres + rounding(keys);
                stretches.near.clear();
                samples.near(tick, &ball(keys, ends), limit, &mut stretches.near);
                if stretches.near.is_empty() {
                    continue;
                }
                for tick in within(tick, keys, samples.stretch()) {
                    let near = Some(&stretches.near[..]);
                    self.meet((tick, near), keys, samples, course.origin);
                }
                continue;
            }
            let metres = self.approach(tick, keys, samples, course.origin);
            if self.is_over() {
                self.follow(tick, keys, samples);
                break;
            }
            if metres < 0.0 && self.best.metres >= 0.0 {
                self.refine(tick, keys, samples, course.origin);
            } else {
                stretches.coarse.push((metres - STRAY, tick));
            }
        }
        sort(&mut stretches.coarse);
        for &(bound, tick) in &stretches.coarse {
            if self.is_over() || bound >= self.best.metres {
                break;
            }
            self.refine(tick, keys, samples, course.origin);
        }
        *self.stretches = stretches;
    }

    /// The stretches of a way on which the body may come near, nearest first. Often that is proof
    /// enough that none does.
    fn bound(&self, keys: [SphereKey; 2], samples: &impl Samples, bounded: &mut Vec<(f32, usize)>) {
        let stretch = samples.stretch();
        let [first, last] = keys.map(tick_of);
        let stray = match samples.pace() {
            Pace::Each => 0.0,
            Pace::EndsFirst => STRAY,
        };
        bounded.clear();
        let all = first - first % stretch..last + 1;
        for tick in all.clone().step_by(LANES * stretch) {
            let ticks = (tick..all.end).step_by(stretch).take(LANES);
            let bounds = samples.bounds(keys, (tick, ticks.len()));
            let bounds = bounds.iter().map(|bound| bound - stray).zip(ticks);
            bounded.extend(bounds.filter(|&(bound, _)| bound < self.best.metres));
        }
        sort(bounded);
    }

    /// The distance on a stretch as if the body went straight from its start to its end. Where that
    /// is a hit, it often is one at either end as well, where the body truly is: then no more is asked.
    fn approach(
        &mut self,
        tick: usize,
        keys: [SphereKey; 2],
        samples: &mut impl Samples,
        origin: f32,
    ) -> f32 {
        let ends = [tick, tick + samples.stretch()];
        ends.iter().for_each(|&tick| samples.prepare(tick));
        let (limit, ball) = (self.best.metres + STRAY, ball(keys, ends));
        let spheres = samples.spheres(ends);
        let Some(nearest) = spheres.nearest(&ball, samples.count(), limit) else {
            return limit;
        };
        if self
            .half_known
            .is_none_or(|known| nearest.metres < known.metres)
        {
            self.half_known = Some(nearest);
        }
        if nearest.metres < self.extent.enough {
            for (still, tick) in ball.at_ends().zip(ends) {
                let met = still
                    .and_then(|still| spheres.nearest(&still, samples.count(), self.best.metres));
                if let Some(met) = met {
                    self.best = Clearance {
                        metres: met.metres,
                        time: origin + tick as f32 / SAMPLE_RATE,
                        body_sphere: met.sphere,
                    };
                }
            }
        }
        nearest.metres
    }

    /// Where a hit goes on to get deeper beside the stretch in which it was found, looks there too, by half.
    fn follow(&mut self, tick: usize, keys: [SphereKey; 2], samples: &mut impl Samples) {
        let Some(known) = self.half_known else {
            return;
        };
        let (stretch, [first, last]) = (samples.stretch(), keys.map(tick_of));
        let beside = match known.share {
            late if late > 0.99 && tick + stretch <= last => tick + stretch,
            early if early < 0.01 && tick > first => tick - stretch,
            _ => return,
        };
        let ends = [beside, beside + stretch];
        ends.iter().for_each(|&tick| samples.prepare(tick));
        let spheres = samples.spheres(ends);
        let nearest = spheres.nearest(&ball(keys, ends), samples.count(), known.metres);
        self.half_known = nearest.or(self.half_known);
    }

    /// Looks at the samples of a stretch that may be nearer than what is known.
    fn refine(
        &mut self,
        tick: usize,
        keys: [SphereKey; 2],
        samples: &mut impl Samples,
        origin: f32,
    ) {
        let ends = [tick, tick + samples.stretch()];
        let mut parts = [(f32::INFINITY, 0); BodyTrack::STRETCH];
        let mut count = 0;
        for part in within(tick, keys, samples.stretch()) {
            let spheres = samples.spheres(ends);
            let ball = part_of_ball(keys, [part, part + 1], ends);
            let limit = self.best.metres + STRAY;
            if let Some(nearest) = spheres.nearest(&ball, samples.count(), limit) {
                parts[count] = (nearest.metres - STRAY, part);
                count += 1;
            }
        }
        let parts = &mut parts[..count];
        sort(parts);
        for &(bound, part) in parts.iter() {
            if self.is_over() || bound >= self.best.metres {
                break;
            }
            self.meet((part, None), keys, samples, origin);
        }
    }

    /// Between a sample and the next one, where only some blocks of the body's spheres may be near, if it is known which.
    fn meet(
        &mut self,
        (tick, near): (usize, Option<&[usize]>),
        keys: [SphereKey; 2],
        samples: &mut impl Samples,
        origin: f32,
    ) {
        let ends = [tick, tick + 1];
        ends.iter().for_each(|&tick| samples.prepare(tick));
        let (ball, spheres) = (ball(keys, ends), samples.spheres(ends));
        let limit = (samples.count(), self.best.metres);
        let nearest = match near {
            Some(blocks) => spheres.nearest_of(|| blocks.iter().copied(), &ball, limit),
            None => spheres.nearest(&ball, limit.0, limit.1),
        };
        if let Some(nearest) = nearest {
            self.best = Clearance {
                metres: nearest.metres,
                time: origin + ball.tick(ends, nearest.share) / SAMPLE_RATE,
                body_sphere: nearest.sphere,
            };
        }
    }
}

/// What rounding adds at most to a distance from a sphere on its way between these keys, and more.
fn rounding(keys: [SphereKey; 2]) -> f32 {
    let furthest = |key: SphereKey| key.center.abs().max_element();
    1e-4 + 1e-6 * furthest(keys[0]).max(furthest(keys[1]))
}

/// The samples of a stretch that lie on a way.
fn within(tick: usize, keys: [SphereKey; 2], stretch: usize) -> RangeInclusive<usize> {
    let [first, last] = keys.map(tick_of);
    tick.max(first)..=(tick + stretch - 1).min(last)
}

fn tick_of(key: SphereKey) -> usize {
    (key.t * SAMPLE_RATE) as usize
}

fn sort(stretches: &mut [(f32, usize)]) {
    stretches.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
}

/// A sphere on its way between two keys, from one sample to another.
pub(super) fn ball(keys: [SphereKey; 2], ticks: [usize; 2]) -> Ball {
    part_of_ball(keys, ticks, ticks)
}

/// The same during `part` alone; its shares are those of the way between `ticks`.
fn part_of_ball(keys: [SphereKey; 2], part: [usize; 2], ticks: [usize; 2]) -> Ball {
    let at = |tick: usize| {
        let t = (tick as f32 / SAMPLE_RATE).clamp(keys[0].t, keys[1].t);
        MovingSphere::between(keys[0], keys[1], t)
    };
    let (from, to) = (at(part[0]), at(part[1]));
    let whole = (ticks[1] - ticks[0]) as f32;
    let share = |t: f32| ((t * SAMPLE_RATE - ticks[0] as f32) / whole).clamp(0.0, 1.0);
    Ball {
        centres: [from.center, to.center],
        radii: [from.radius, to.radius],
        shares: [share(from.t), share(to.t)],
    }
}
