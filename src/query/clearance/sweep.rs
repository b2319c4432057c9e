//! The sweep of the attack's spheres along the samples of the body.
//!
//! Source: branch and bound (Land & Doig, "An automatic method of solving discrete programming problems", 1960), with the best bound first.
//! A straight segment of a sphere is divided into intervals of samples, and an interval into samples. Both are tested in the order of a lower
//! bound of their distances, until the next bound is not below the smallest distance so far. Differs: if an attack has many segments, those that
//! stay away from a cylinder around all poses of the body are excluded first.

use std::ops::RangeInclusive;
use std::time::Instant;

use glam::Vec3;

use super::bodies::{BodySamples, Intervals};
use super::distances::{LANES, Nearest, SphereSegment, closest};
use super::extent::{Clearance, Extent, SAMPLE_RATE, Sampling};
use crate::maps::{BodyTrack, BoundingCylinder, MovingSphere, SphereKey};
use crate::math::Rigid2;
use crate::query::attack::Attack;

/// The time in which samples are tested, and the clock and frame of the samples.
#[derive(Clone, Copy)]
pub(super) struct TimeWindow {
    /// Start of the window on the attack's clock, in seconds.
    pub from: f32,
    /// End of the window on the attack's clock, in seconds.
    pub to: f32,
    /// Time of sample 0 on the attack's clock, in seconds.
    pub origin: f32,
    /// Rate of the samples' clock relative to the attack's clock.
    pub rate: f32,
    /// Transform from the attack's world to the frame of the samples.
    pub placement: Rigid2,
}

impl TimeWindow {
    /// Time since sample 0 on the samples' clock, in seconds; 0 before sample 0.
    pub(super) fn clock(&self, t: f32) -> f32 {
        ((t - self.origin) * self.rate).max(0.0)
    }

    /// Time of a sample on the attack's clock, in seconds.
    fn time(&self, tick: f32) -> f32 {
        self.origin + tick / SAMPLE_RATE / self.rate
    }

    /// A window of a motion with the attack's clock and world.
    pub(super) fn on_motion(from: f32, to: f32) -> Self {
        Self {
            from,
            to,
            origin: 0.0,
            rate: 1.0,
            placement: Rigid2::IDENTITY,
        }
    }
}

#[derive(Clone, Debug, Default)]
pub(super) struct SweepScratch {
    /// Intervals with a bound from the whole body.
    bounded: Vec<BoundedInterval>,
    /// Intervals with a bound from the body at their two ends.
    coarse: Vec<BoundedInterval>,
    /// Blocks of body spheres that may be near in one interval.
    blocks: Vec<usize>,
}

/// An interval, and a lower bound of its distances.
#[derive(Clone, Copy, Debug)]
struct BoundedInterval {
    /// Lower bound, in metres.
    bound: f32,
    /// First sample.
    tick: usize,
}

/// Maximum deviation of the body's spheres from the straight line between samples a whole interval apart, in metres.
///
/// A rotation of 15 rad/s at 0.7 m from the joint causes 0.7 (1 - cos(15 / 60)) m = 2.2 cm. The clearance of a sphere that deviates more may be
/// overestimated, until the final motion is tested.
const DEVIATION: f32 = 0.025;

/// Number of an attack's straight lines for each sample of the body, above which all samples are computed in advance.
const MANY_LINES: usize = 32;

/// A test of one attack, in parts.
pub(super) struct Sweep<'a> {
    attack: &'a Attack,
    search: Search,
    /// Cylinder that contains the body during the tested part; `None` if it was not computed.
    envelope: Option<BoundingCylinder>,
    scratch: &'a mut SweepScratch,
}

/// The smallest distance so far.
struct Search {
    extent: Extent,
    window: TimeWindow,
    /// Time from which on nothing is tested, and what is not tested is a hit; `None`: never.
    deadline: Option<Instant>,
    is_late: bool,
    best: Clearance,
    /// Smallest distance for a body that moves straight from the start of an interval to its end.
    straight: Option<Nearest>,
}

impl<'a> Sweep<'a> {
    pub(super) fn new(
        attack: &'a Attack,
        extent: Extent,
        deadline: Option<Instant>,
        scratch: &'a mut SweepScratch,
    ) -> Self {
        let best = Clearance {
            metres: extent.below,
            ..Clearance::none(attack.start())
        };
        Self {
            attack,
            search: Search {
                extent,
                window: TimeWindow::on_motion(0.0, f32::INFINITY),
                deadline,
                is_late: false,
                best,
                straight: None,
            },
            envelope: None,
            scratch,
        }
    }

    /// The smallest distance, or an upper bound of it if the search ended early.
    pub(super) fn nearest(&self) -> Clearance {
        let Search { best, straight, .. } = &self.search;
        let straight = straight.filter(|_| self.is_over());
        let at_most = match straight {
            _ if self.search.is_late => -f32::MIN_POSITIVE,
            None => f32::INFINITY,
            Some(nearest) => nearest.metres + DEVIATION,
        };
        Clearance {
            metres: best.metres.min(at_most),
            ..*best
        }
    }

    /// Whether the search has found a distance below [`Extent::enough`].
    pub(super) fn is_over(&self) -> bool {
        self.search.is_over()
    }

    /// Tests the part of the attack in a time window.
    pub(super) fn run(&mut self, samples: &mut impl BodySamples, window: TimeWindow) {
        self.search.window = window;
        self.envelope = self.find_envelope(samples, window);
        for sphere in self.attack.spheres() {
            if self.search.passes_deadline() {
                return;
            }
            if let [only] = sphere.keys() {
                if (window.from..=window.to).contains(&only.t) {
                    self.test([*only; 2], samples);
                }
                continue;
            }
            for pair in sphere.keys().windows(2) {
                if self.is_over() {
                    return;
                }
                let (from, to) = (pair[0].t.max(window.from), pair[1].t.min(window.to));
                if from < to {
                    let cut = [from, to].map(|t| MovingSphere::between(pair[0], pair[1], t));
                    self.test(cut, samples);
                }
            }
        }
    }

    /// Cylinder that contains the body during a time window, in the frame of its samples. `None` if computing it would take longer than it saves.
    fn find_envelope(
        &self,
        samples: &mut impl BodySamples,
        window: TimeWindow,
    ) -> Option<BoundingCylinder> {
        let spheres = self.attack.spheres();
        let keys: usize = spheres.iter().map(|sphere| sphere.keys().len()).sum();
        let from = self.attack.start().max(window.from);
        let to = self.attack.end().min(window.to);
        let [first, last] = [from, to].map(|t| tick_at(window.clock(t)));
        let is_worth_it = (keys - spheres.len()) / MANY_LINES > last.saturating_sub(first);
        (from < to && is_worth_it).then(|| samples.prepare_all(first, last))
    }

    fn test(&mut self, keys: [SphereKey; 2], samples: &mut impl BodySamples) {
        let window = &self.search.window;
        let keys = keys.map(|key| SphereKey {
            t: window.clock(key.t),
            center: window.placement.point(key.center),
            ..key
        });
        let limit = self.search.best.metres + deviation(samples.sampling()) + rounding(keys);
        let envelope = self
            .envelope
            .filter(|&envelope| distance_from(envelope, keys) > limit);
        if envelope.is_some() {
            return;
        }
        self.search.test_line(samples, keys, self.scratch);
    }
}

impl Search {
    fn is_over(&self) -> bool {
        self.best.metres < self.extent.enough
    }

    fn passes_deadline(&mut self) -> bool {
        let is_late = |deadline| Instant::now() >= deadline;
        self.is_late = self.is_late || self.deadline.is_some_and(is_late);
        self.is_late
    }

    /// Tests a sphere on one straight line, on the clock and in the frame of the samples.
    fn test_line(
        &mut self,
        samples: &mut impl BodySamples,
        keys: [SphereKey; 2],
        scratch: &mut SweepScratch,
    ) {
        let (bounded, coarse) = (&mut scratch.bounded, &mut scratch.coarse);
        self.find_intervals(samples, keys, bounded);
        coarse.clear();
        // The interval in which the attack is nearest to the middle of the body comes first. A hit is found there at once, near its
        // deepest point.
        for &BoundedInterval { bound, tick } in bounded.iter() {
            if self.is_over() || bound >= self.best.metres || self.passes_deadline() {
                break;
            }
            if samples.sampling() == Sampling::Each {
                self.test_each(samples, keys, tick, &mut scratch.blocks);
                continue;
            }
            let metres = self.test_straight(samples, keys, tick);
            if self.is_over() {
                self.deepen(samples, keys, tick);
                break;
            }
            if metres < 0.0 && self.best.metres >= 0.0 {
                self.refine(samples, keys, tick);
            } else {
                coarse.push(BoundedInterval {
                    bound: metres - DEVIATION,
                    tick,
                });
            }
        }
        sort(coarse);
        for &BoundedInterval { bound, tick } in coarse.iter() {
            if self.is_over() || bound >= self.best.metres || self.passes_deadline() {
                break;
            }
            self.refine(samples, keys, tick);
        }
    }

    /// Finds the intervals in which the body may be near, nearest first. Often there are none.
    fn find_intervals(
        &mut self,
        samples: &mut impl BodySamples,
        keys: [SphereKey; 2],
        bounded: &mut Vec<BoundedInterval>,
    ) {
        let interval = samples.interval();
        let [first, last] = keys.map(tick_of);
        let deviation = deviation(samples.sampling());
        bounded.clear();
        let all = first - first % interval..last + 1;
        for tick in all.clone().step_by(LANES * interval) {
            if self.passes_deadline() {
                return;
            }
            let ticks = (tick..all.end).step_by(interval).take(LANES);
            let intervals = Intervals {
                tick,
                count: ticks.len(),
            };
            let bounds = samples.bounds(keys, intervals);
            bounded.extend(
                bounds
                    .iter()
                    .zip(ticks)
                    .map(|(bound, tick)| BoundedInterval {
                        bound: bound - deviation,
                        tick,
                    })
                    .filter(|interval| interval.bound < self.best.metres),
            );
        }
        sort(bounded);
    }

    /// Tests every sample of an interval with the blocks of body spheres that may be near.
    fn test_each(
        &mut self,
        samples: &mut impl BodySamples,
        keys: [SphereKey; 2],
        tick: usize,
        blocks: &mut Vec<usize>,
    ) {
        let ends = [tick, tick + samples.interval()];
        let segment = SphereSegment::between(keys, ends);
        let limit = self.best.metres + rounding(keys);
        blocks.clear();
        samples.near_blocks(tick, &segment, limit, blocks);
        if blocks.is_empty() {
            return;
        }
        for tick in ticks_within(keys, samples.interval(), tick) {
            self.test_sample(samples, keys, tick, Some(blocks));
        }
    }

    /// The distance in an interval for a body that moves straight from its start to its end.
    ///
    /// A hit of this body is often a hit at one of the ends too, where the body's position is exact. That may be enough.
    fn test_straight(
        &mut self,
        samples: &mut impl BodySamples,
        keys: [SphereKey; 2],
        tick: usize,
    ) -> f32 {
        let ends = [tick, tick + samples.interval()];
        ends.iter().for_each(|&tick| samples.prepare(tick));
        let segment = SphereSegment::between(keys, ends);
        let spheres = samples.spheres(ends);
        let limit = self.best.metres + DEVIATION;
        let Some(nearest) = spheres.nearest(&segment, limit) else {
            return limit;
        };
        let is_nearer = |known: Nearest| nearest.metres < known.metres;
        if self.straight.is_none_or(is_nearer) {
            self.straight = Some(nearest);
        }
        if nearest.metres < self.extent.enough {
            for (at_end, tick) in segment.at_ends().zip(ends) {
                let found = at_end.and_then(|segment| spheres.nearest(&segment, self.best.metres));
                if let Some(found) = found {
                    self.best = Clearance {
                        metres: found.metres,
                        time: self.window.time(tick as f32),
                        body_sphere: found.sphere,
                    };
                }
            }
        }
        nearest.metres
    }

    /// Follows a hit that is deepest at an end of its interval into the next interval.
    fn deepen(&mut self, samples: &mut impl BodySamples, keys: [SphereKey; 2], tick: usize) {
        let Some(known) = self.straight else {
            return;
        };
        let (interval, [first, last]) = (samples.interval(), keys.map(tick_of));
        let next = match known.share {
            late if late > 0.99 && tick + interval <= last => tick + interval,
            early if early < 0.01 && tick > first => tick - interval,
            _ => return,
        };
        let ends = [next, next + interval];
        ends.iter().for_each(|&tick| samples.prepare(tick));
        let segment = SphereSegment::between(keys, ends);
        let nearest = samples.spheres(ends).nearest(&segment, known.metres);
        self.straight = nearest.or(self.straight);
    }

    /// Tests the samples of an interval that may be nearer than the smallest distance so far.
    fn refine(&mut self, samples: &mut impl BodySamples, keys: [SphereKey; 2], tick: usize) {
        let ends = [tick, tick + samples.interval()];
        let mut parts = [BoundedInterval {
            bound: f32::INFINITY,
            tick: 0,
        }; BodyTrack::INTERVAL];
        let mut count = 0;
        let spheres = samples.spheres(ends);
        for part in ticks_within(keys, samples.interval(), tick) {
            let segment = SphereSegment::part(keys, [part, part + 1], ends);
            let nearest = spheres.nearest(&segment, self.best.metres + DEVIATION);
            if let Some(nearest) = nearest {
                parts[count] = BoundedInterval {
                    bound: nearest.metres - DEVIATION,
                    tick: part,
                };
                count += 1;
            }
        }
        let parts = &mut parts[..count];
        sort(parts);
        for &BoundedInterval { bound, tick } in parts.iter() {
            if self.is_over() || bound >= self.best.metres {
                break;
            }
            self.test_sample(samples, keys, tick, None);
        }
    }

    /// Tests the time between a sample and the next one, with some blocks of body spheres or with all.
    fn test_sample(
        &mut self,
        samples: &mut impl BodySamples,
        keys: [SphereKey; 2],
        tick: usize,
        blocks: Option<&[usize]>,
    ) {
        let ends = [tick, tick + 1];
        ends.iter().for_each(|&tick| samples.prepare(tick));
        let segment = SphereSegment::between(keys, ends);
        let spheres = samples.spheres(ends);
        let limit = self.best.metres;
        let nearest = match blocks {
            Some(blocks) => spheres.nearest_of(&segment, limit, || blocks.iter().copied()),
            None => spheres.nearest(&segment, limit),
        };
        if let Some(nearest) = nearest {
            self.best = Clearance {
                metres: nearest.metres,
                time: self.window.time(segment.tick(ends, nearest.share)),
                body_sphere: nearest.sphere,
            };
        }
    }
}

/// The samples of an interval that lie on the line between two keys.
fn ticks_within(keys: [SphereKey; 2], interval: usize, tick: usize) -> RangeInclusive<usize> {
    let [first, last] = keys.map(tick_of);
    tick.max(first)..=(tick + interval - 1).min(last)
}

/// An upper bound of the rounding error of a distance from a sphere between these keys, in metres.
fn rounding(keys: [SphereKey; 2]) -> f32 {
    let furthest = |key: SphereKey| key.center.abs().max_element();
    1e-4 + 1e-6 * furthest(keys[0]).max(furthest(keys[1]))
}

/// A lower bound of the distance between a cylinder and a sphere that moves between two keys, in metres.
fn distance_from(cylinder: BoundingCylinder, keys: [SphereKey; 2]) -> f32 {
    let axis = Vec3::new(cylinder.axis.x, 0.0, cylinder.axis.y);
    let apart = keys.map(|key| key.center.with_y(0.0) - axis);
    let radius = keys[0].radius.max(keys[1].radius);
    let (_, beside) = closest(apart, [cylinder.radius + radius; 2]);
    let [from, to] = keys.map(|key| key.center.y);
    let above = from.min(to) - radius - cylinder.high;
    let below = cylinder.low - radius - from.max(to);
    beside.max(above).max(below)
}

fn deviation(sampling: Sampling) -> f32 {
    match sampling {
        Sampling::Each => 0.0,
        Sampling::CoarseFirst => DEVIATION,
    }
}

fn tick_of(key: SphereKey) -> usize {
    tick_at(key.t)
}

fn tick_at(seconds: f32) -> usize {
    (seconds * SAMPLE_RATE) as usize
}

fn sort(intervals: &mut [BoundedInterval]) {
    intervals.sort_unstable_by(|a, b| a.bound.total_cmp(&b.bound).then(a.tick.cmp(&b.tick)));
}
