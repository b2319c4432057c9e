use super::extent::Sampling;
use super::nearest::Spheres;
use super::segment::{Lanes, SphereSegment};
use crate::maps::{BoundingCylinder, SphereKey};
use crate::math::Rigid2;

/// The positions of the body's spheres at the samples of some clock.
pub(super) trait BodySamples {
    /// Number of samples from the start of an interval to its end.
    fn interval(&self) -> usize;
    /// How the samples of an interval are visited: one by one, or the two ends first, as if the body moved straight between them.
    fn sampling(&self) -> Sampling;
    /// Lower bounds of the distance between the whole body and a sphere that moves between two keys, for each of several
    /// intervals.
    fn bounds(&mut self, keys: [SphereKey; 2], intervals: Intervals) -> Lanes;
    /// Computes the spheres of all intervals from sample `first` to sample `last`, so that [`BodySamples::bounds`] are close, and
    /// returns what holds them all.
    fn prepare_all(&mut self, first: usize, last: usize) -> BoundingCylinder;
    /// Adds the blocks of the body's spheres that may be nearer than `near.limit` during the interval from sample `tick` on.
    fn near_blocks(&self, tick: usize, near: Near<'_>, blocks: &mut Vec<usize>);
    /// Computes the spheres of a sample.
    fn prepare(&mut self, tick: usize);
    /// The spheres at two samples, which are prepared.
    fn spheres(&self, ticks: [usize; 2]) -> Spheres<'_>;
    /// Number of spheres without padding.
    fn count(&self) -> usize;
}

/// Up to sixteen intervals that follow each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Intervals {
    /// First sample.
    pub tick: usize,
    /// Number of intervals.
    pub count: usize,
}

/// A sphere, and the distance within which body spheres count as near, metres.
#[derive(Clone, Copy)]
pub(super) struct Near<'a> {
    pub segment: &'a SphereSegment,
    pub limit: f32,
}

/// The time in which samples are tested, and the frame of the samples.
#[derive(Clone, Copy)]
pub(super) struct TimeWindow {
    /// First time, by the attack's clock, seconds.
    pub from: f32,
    /// Last time, by the attack's clock, seconds.
    pub to: f32,
    /// The attack's time at sample 0, seconds.
    pub origin: f32,
    /// Rate of the samples' clock by the attack's.
    pub rate: f32,
    /// Transform from the attack's world to that of the samples.
    pub placement: Rigid2,
}

impl TimeWindow {
    /// Time since sample 0 by the samples' clock, seconds; 0 before it.
    pub(super) fn clock(&self, t: f32) -> f32 {
        ((t - self.origin) * self.rate).max(0.0)
    }

    /// A window of a motion, which has the attack's clock and world.
    pub(super) fn of_motion(from: f32, to: f32) -> Self {
        Self {
            from,
            to,
            origin: 0.0,
            rate: 1.0,
            placement: Rigid2::IDENTITY,
        }
    }
}
