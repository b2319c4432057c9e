use super::extent::Sampling;
use super::nearest::Spheres;
use super::segment::{Lanes, SphereSegment};
use crate::maps::{BoundingCylinder, SphereKey};
use crate::math::Rigid2;

/// Positions of the body's spheres at the samples of a clock.
pub(super) trait BodySamples {
    /// Number of samples from the start of an interval to its end.
    fn interval(&self) -> usize;
    /// Order in which the samples of an interval are tested: one by one, or the two ends first, as if the body moved straight between them.
    fn sampling(&self) -> Sampling;
    /// Lower bounds of the distance between the whole body and a sphere that moves between two keys, for each of several
    /// intervals.
    fn bounds(&mut self, keys: [SphereKey; 2], intervals: Intervals) -> Lanes;
    /// Computes the spheres of all intervals from sample `first` to sample `last`, so that [`BodySamples::bounds`] are
    /// tight, and returns a cylinder that contains them all.
    fn prepare_all(&mut self, first: usize, last: usize) -> BoundingCylinder;
    /// Adds the blocks of the body's spheres that may be nearer than `near.limit` during the interval from sample `tick` on.
    fn near_blocks(&self, tick: usize, near: Near<'_>, blocks: &mut Vec<usize>);
    /// Computes the spheres of a sample.
    fn prepare(&mut self, tick: usize);
    /// The spheres at two prepared samples.
    fn spheres(&self, ticks: [usize; 2]) -> Spheres<'_>;
    /// Number of spheres without padding.
    fn count(&self) -> usize;
}

/// Up to sixteen consecutive intervals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Intervals {
    /// First sample of the first interval.
    pub tick: usize,
    /// Number of intervals.
    pub count: usize,
}

/// A sphere, and the distance within which body spheres count as near, in metres.
#[derive(Clone, Copy)]
pub(super) struct Near<'a> {
    pub segment: &'a SphereSegment,
    pub limit: f32,
}

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

    /// A window of a motion with the attack's clock and world.
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
