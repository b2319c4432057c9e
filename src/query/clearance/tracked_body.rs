use glam::Vec3;

use super::body_samples::{BodySamples, Intervals, Near};
use super::extent::Sampling;
use super::nearest::Spheres;
use super::segment::{LANES, Lanes};
use super::segment_lanes::SegmentLanes;
use crate::maps::{BakedGraph, BodyTrack, BoundingCylinder, PART, SphereKey};
use crate::math::Isa;

/// The body from an evasion's start on, from its baked track.
pub(super) struct TrackedBody<'a> {
    track: &'a BodyTrack,
    radii: &'a [f32],
    count: usize,
}

impl<'a> TrackedBody<'a> {
    pub(super) fn new(baked: &'a BakedGraph, track: &'a BodyTrack) -> Self {
        Self {
            track,
            radii: baked.body_rows().radii(),
            count: baked.body().spheres.len(),
        }
    }
}

impl BodySamples for TrackedBody<'_> {
    fn interval(&self) -> usize {
        BodyTrack::INTERVAL
    }

    fn sampling(&self) -> Sampling {
        Sampling::Each
    }

    fn bounds(&mut self, keys: [SphereKey; 2], intervals: Intervals) -> Lanes {
        let tick = intervals.tick;
        let bounds = self.track.bounds(tick / BodyTrack::INTERVAL);
        Isa::best().run(
            #[inline(always)]
            || {
                SegmentLanes::new(keys, tick, BodyTrack::INTERVAL)
                    .distances_to_spheres([&bounds; 2])
            },
        )
    }

    fn prepare_all(&mut self, first: usize, last: usize) -> BoundingCylinder {
        let intervals = first / BodyTrack::INTERVAL..=last / BodyTrack::INTERVAL;
        BoundingCylinder::around(intervals.step_by(LANES).flat_map(|interval| {
            let bounds = self.track.bounds(interval);
            (0..LANES).map(move |lane| {
                let [x, y, z, radius] = bounds.map(|row| row[lane]);
                (Vec3::new(x, y, z), radius)
            })
        }))
    }

    fn near_blocks(&self, tick: usize, near: Near<'_>, blocks: &mut Vec<usize>) {
        /// Number of parts of a block.
        const PARTS: usize = BodyTrack::LANES / PART;
        let bounds = self.track.part_bounds(tick / BodyTrack::INTERVAL);
        Isa::best().run(
            #[inline(always)]
            || {
                for (first, bounds) in (0..).step_by(LANES / PARTS).zip(bounds) {
                    let distances = near.segment.distances_to_bounds(bounds);
                    for (at, parts) in distances.chunks_exact(PARTS).enumerate() {
                        if parts.iter().any(|&distance| distance < near.limit) {
                            blocks.push(first + at);
                        }
                    }
                }
            },
        );
    }

    fn prepare(&mut self, _: usize) {}

    fn spheres(&self, ticks: [usize; 2]) -> Spheres<'_> {
        // The last sample has no next sample. The body is still there.
        let last = self.track.ticks() - 1;
        Spheres {
            from: self.track.axes(ticks[0].min(last)),
            to: self.track.axes(ticks[1].min(last)),
            radii: self.radii,
        }
    }

    fn count(&self) -> usize {
        self.count
    }
}
