//! The body's spheres sample by sample, from one of two sources: posed on any motion, or from the baked track of an evasion.

use glam::{Vec2, Vec3};

use super::distances::{LANES, Lanes, SegmentLanes, SphereSegment, Spheres};
use super::extent::{SAMPLE_RATE, Sampling};
use super::pose_cache::PoseCache;
use super::sweep::TimeWindow;
use crate::graph::Motion;
use crate::maps::{BakedGraph, BodyTrack, BoundingCylinder, PART, SphereKey};
use crate::math::{Isa, Rigid2};

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
    /// Adds the blocks of the body's spheres that may be nearer to the segment than `limit` metres, in the interval from sample `tick` on.
    fn near_blocks(
        &self,
        tick: usize,
        segment: &SphereSegment,
        limit: f32,
        blocks: &mut Vec<usize>,
    );
    /// Computes the spheres of a sample.
    fn prepare(&mut self, tick: usize);
    /// The spheres at two prepared samples.
    fn spheres(&self, ticks: [usize; 2]) -> Spheres<'_>;
}

/// Up to sixteen consecutive intervals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Intervals {
    /// First sample of the first interval.
    pub tick: usize,
    pub count: usize,
}

/// The baked track of an evasion, as it is played in the world.
#[derive(Clone, Copy, Debug)]
pub struct PlayedTrack<'a> {
    /// Body track of the evasion.
    pub track: &'a BodyTrack,
    /// Transform from the track's frame to the world.
    pub placement: Rigid2,
    /// Time from the query to the track's first sample, in seconds.
    pub origin: f32,
    /// Playback rate.
    pub rate: f32,
    /// Start and end of the part in which the body follows the track, in seconds since the query.
    pub seconds: (f32, f32),
}

impl<'a> PlayedTrack<'a> {
    /// An evasion at rate 1 whose character has the frame `placement` when it starts, `start` seconds from the query.
    #[must_use]
    pub fn new(track: &'a BodyTrack, placement: Rigid2, start: f32) -> Self {
        Self {
            track,
            placement,
            origin: start - track.lead_in(),
            rate: 1.0,
            seconds: (start, start + track.seconds()),
        }
    }

    /// The part that is played, with its clock and frame.
    pub(super) fn window(&self) -> TimeWindow {
        TimeWindow {
            from: self.seconds.0,
            to: self.seconds.1,
            origin: self.origin,
            rate: self.rate,
            placement: self.placement.inverse(),
        }
    }
}

/// The body from an evasion's start on, from its baked track.
pub(super) struct TrackedBody<'a> {
    pub baked: &'a BakedGraph,
    pub track: &'a BodyTrack,
    /// Radii of the spheres, padded.
    pub radii: &'a [f32],
    /// How much the radii are larger than those of the track, at most, in metres.
    pub wider: f32,
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
        let mut bounds = self.track.bounds(tick / BodyTrack::INTERVAL);
        bounds[3] = bounds[3].map(|radius| radius + self.wider);
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
        let (track, wider) = (self.track, self.wider);
        BoundingCylinder::around(intervals.step_by(LANES).flat_map(|interval| {
            let bounds = track.bounds(interval);
            (0..LANES).map(move |lane| {
                let [x, y, z, radius] = bounds.map(|row| row[lane]);
                (Vec3::new(x, y, z), radius + wider)
            })
        }))
    }

    fn near_blocks(
        &self,
        tick: usize,
        segment: &SphereSegment,
        limit: f32,
        blocks: &mut Vec<usize>,
    ) {
        /// Number of parts of a block.
        const PARTS: usize = BodyTrack::LANES / PART;
        let bounds = self.track.part_bounds(tick / BodyTrack::INTERVAL);
        let limit = limit + self.wider;
        Isa::best().run(
            #[inline(always)]
            || {
                for (first, bounds) in (0..).step_by(LANES / PARTS).zip(bounds) {
                    let distances = segment.distances_to_bounds(bounds);
                    for (at, parts) in distances.chunks_exact(PARTS).enumerate() {
                        if parts.iter().any(|&distance| distance < limit) {
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
            count: self.baked.body().spheres.len(),
        }
    }
}

#[derive(Clone, Debug, Default)]
pub(super) struct PosedSamples {
    /// Number of each sample's pose in the cache, from `first_tick` on.
    slots: Vec<Option<usize>>,
    first_tick: Option<usize>,
    /// Bounding spheres of the tested motion, because the next sphere of the attack is often tested at the same samples.
    bounding_spheres: Vec<Ends<4>>,
    bounding_cylinders: Vec<Ends<5>>,
    /// Cylinders around the body at the ends of intervals, if all were posed in advance, and the number of the first such interval.
    posed_cylinders: Vec<BoundingCylinder>,
    first_posed: usize,
}

/// Values at the start and at the end of each of several intervals.
#[derive(Clone, Debug)]
struct Ends<const ROWS: usize> {
    intervals: Intervals,
    lanes: [[Lanes; ROWS]; 2],
}

/// Number of bounds that are kept.
const MOST_ENDS: usize = 4;

impl PosedSamples {
    pub(super) fn on<'a>(
        &'a mut self,
        poses: &'a mut PoseCache,
        baked: &'a BakedGraph,
        motion: &'a Motion,
        sampling: Sampling,
    ) -> PosedBody<'a> {
        poses.start(baked, motion);
        self.slots.clear();
        self.first_tick = None;
        self.bounding_spheres.clear();
        self.bounding_cylinders.clear();
        self.posed_cylinders.clear();
        PosedBody {
            baked,
            motion,
            sampling,
            scratch: self,
            poses,
        }
    }
}

/// The body along a motion. Samples are posed on demand.
pub(super) struct PosedBody<'a> {
    baked: &'a BakedGraph,
    motion: &'a Motion,
    sampling: Sampling,
    scratch: &'a mut PosedSamples,
    poses: &'a mut PoseCache,
}

impl PosedBody<'_> {
    /// Number of spheres without padding.
    fn count(&self) -> usize {
        self.baked.body().spheres.len()
    }

    fn slot(&self, tick: usize) -> Option<usize> {
        let index = tick.checked_sub(self.scratch.first_tick?)?;
        self.scratch.slots.get(index).copied().flatten()
    }

    fn pose(&mut self, tick: usize) {
        let first = *self.scratch.first_tick.get_or_insert(tick);
        if tick < first {
            let earlier = std::iter::repeat_n(None, first - tick);
            self.scratch.slots.splice(0..0, earlier);
            self.scratch.first_tick = Some(tick);
        }
        let index = tick.saturating_sub(first);
        if self.scratch.slots.len() <= index {
            self.scratch.slots.resize(index + 1, None);
        }
        if self.scratch.slots[index].is_none() {
            let moment = self.motion.moment_at(tick as f32 / SAMPLE_RATE);
            let number = self.poses.number(self.baked, moment);
            self.scratch.slots[index] = Some(number);
        }
    }

    /// A sphere around the root that contains every pose of the body: x, y, z and radius.
    fn bounding_sphere(&self, tick: usize) -> [f32; 4] {
        let seconds = tick as f32 / SAMPLE_RATE;
        let [x, y, z] = self.motion.root(self.baked.graph(), seconds).to_array();
        [x, y, z, self.baked.reach() + self.poses.additive.moves()]
    }

    /// A vertical cylinder around the body. A posed sample has a tight one.
    fn bounding_cylinder(&self, tick: usize) -> BoundingCylinder {
        if let Some(cylinder) = self.posed_cylinder(tick / self.interval()) {
            return cylinder;
        }
        let seconds = tick as f32 / SAMPLE_RATE;
        let is_composed = self.motion.is_blending(seconds) || self.motion.is_layered(seconds);
        if is_composed || !self.poses.additive.is_empty() {
            let [x, y, z, reach] = self.bounding_sphere(tick);
            return BoundingCylinder {
                axis: Vec2::new(x, z),
                radius: reach,
                low: y - reach,
                high: y + reach,
            };
        }
        let playhead = self.motion.playhead(self.baked.graph(), seconds);
        let cylinder = self.baked.bounding_cylinder(playhead.edge, playhead.frame);
        cylinder.placed(playhead.clip_to_world)
    }

    /// The cylinder at the start of an interval; `None` unless all intervals were posed in advance.
    fn posed_cylinder(&self, interval: usize) -> Option<BoundingCylinder> {
        let at = interval.checked_sub(self.scratch.first_posed)?;
        self.scratch.posed_cylinders.get(at).copied()
    }

    /// Centre and radius of each sphere at a prepared sample.
    fn placed(&self, tick: usize) -> impl Iterator<Item = (Vec3, f32)> + Clone + '_ {
        let [x, y, z] = self.axes(tick);
        let radii = self.baked.body_rows().radii();
        (0..self.count()).map(move |at| (Vec3::new(x[at], y[at], z[at]), radii[at]))
    }

    fn axes(&self, tick: usize) -> [&[f32]; 3] {
        self.poses.axes(self.baked, self.slot(tick).unwrap_or(0))
    }
}

impl BodySamples for PosedBody<'_> {
    fn interval(&self) -> usize {
        self.sampling.interval()
    }

    fn sampling(&self) -> Sampling {
        self.sampling
    }

    fn bounds(&mut self, keys: [SphereKey; 2], intervals: Intervals) -> Lanes {
        let (first, interval) = (intervals.tick, self.interval());
        let ends = [first / interval, first / interval + intervals.count];
        let are_posed = ends.iter().all(|&end| self.posed_cylinder(end).is_some());
        if self.sampling == Sampling::Each && !are_posed {
            let mut known = std::mem::take(&mut self.scratch.bounding_spheres);
            let sphere = |tick: usize| self.bounding_sphere(tick);
            let ends = find_or_add(&mut known, intervals, interval, sphere);
            let lanes = Isa::best().run(
                #[inline(always)]
                || SegmentLanes::new(keys, first, interval).distances_to_spheres(ends),
            );
            self.scratch.bounding_spheres = known;
            return lanes;
        }
        let mut known = std::mem::take(&mut self.scratch.bounding_cylinders);
        let cylinder = |tick: usize| self.bounding_cylinder(tick).to_array();
        let ends = find_or_add(&mut known, intervals, interval, cylinder);
        let lanes = Isa::best().run(
            #[inline(always)]
            || SegmentLanes::new(keys, first, interval).distances_to_cylinders(ends),
        );
        self.scratch.bounding_cylinders = known;
        lanes
    }

    fn prepare_all(&mut self, first: usize, last: usize) -> BoundingCylinder {
        let interval = self.interval();
        // The last interval ends after the last sample.
        let ticks = (first / interval..=last / interval + 1).map(|at| at * interval);
        ticks.clone().for_each(|tick| self.pose(tick));
        let mut cylinders = std::mem::take(&mut self.scratch.posed_cylinders);
        cylinders.clear();
        let around = ticks
            .clone()
            .map(|tick| BoundingCylinder::around(self.placed(tick)));
        cylinders.extend(around);
        self.scratch.posed_cylinders = cylinders;
        self.scratch.first_posed = first / interval;
        self.scratch.bounding_cylinders.clear();
        BoundingCylinder::around(ticks.flat_map(|tick| self.placed(tick)))
    }

    fn near_blocks(&self, _: usize, _: &SphereSegment, _: f32, blocks: &mut Vec<usize>) {
        blocks.extend(0..self.baked.body_rows().radii().len() / BodyTrack::LANES);
    }

    fn prepare(&mut self, tick: usize) {
        self.pose(tick);
    }

    fn spheres(&self, ticks: [usize; 2]) -> Spheres<'_> {
        Spheres {
            from: self.axes(ticks[0]),
            to: self.axes(ticks[1]),
            radii: self.baked.body_rows().radii(),
            count: self.count(),
        }
    }
}

/// The bounds at the start and at the end of each of some intervals. They are computed if they are not stored.
fn find_or_add<const ROWS: usize>(
    known: &mut Vec<Ends<ROWS>>,
    intervals: Intervals,
    interval: usize,
    bound: impl Fn(usize) -> [f32; ROWS],
) -> [&[Lanes; ROWS]; 2] {
    let at = known.iter().position(|ends| ends.intervals == intervals);
    let at = at.unwrap_or_else(|| {
        if known.len() == MOST_ENDS {
            known.remove(0);
        }
        let mut lanes = [[[0.0; LANES]; ROWS]; 2];
        for at in 0..=intervals.count {
            let bound = bound(intervals.tick + at * interval);
            // The end of an interval is the start of the next one.
            let (start, end) = (at < intervals.count, at.checked_sub(1));
            for (side, lane) in [start.then_some(at), end].into_iter().enumerate() {
                let Some(lane) = lane else { continue };
                for (row, value) in lanes[side].iter_mut().zip(bound) {
                    row[lane] = value;
                }
            }
        }
        known.push(Ends { intervals, lanes });
        known.len() - 1
    });
    let [from, to] = &known[at].lanes;
    [from, to]
}
