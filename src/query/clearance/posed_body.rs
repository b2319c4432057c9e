//! The body along a motion, posed sample by sample.

use std::time::Instant;

use glam::{Vec2, Vec3};

use super::body_samples::{BodySamples, Intervals, Near};
use super::extent::{SAMPLE_RATE, Sampling};
use super::nearest::Spheres;
use super::pose_cache::PoseCache;
use super::segment::{LANES, Lanes};
use super::segment_lanes::SegmentLanes;
use super::sweep::SweepScratch;
use crate::graph::Motion;
use crate::maps::{BakedGraph, BodyTrack, BoundingCylinder, SphereKey};
use crate::math::Isa;
use crate::query::obstacle::ObstacleScratch;

/// Scratch of tests, with the poses that several motions have in common. Keep it from one test to the next.
#[derive(Clone, Debug, Default)]
pub struct MotionBody {
    poses: PoseCache,
    posed: PosedSamples,
    sweep: SweepScratch,
    /// A motion that is built for one test.
    motion: Motion,
    pub(in crate::query) obstacles: ObstacleScratch,
    /// Time from which on nothing is tested any more.
    deadline: Option<Instant>,
}

/// A motion and its samples.
pub(super) struct SampledMotion<'a> {
    pub baked: &'a BakedGraph,
    pub motion: &'a Motion,
    pub sampling: Sampling,
}

/// The parts of a [`MotionBody`].
pub(super) struct MotionBodyParts<'a> {
    pub poses: &'a mut PoseCache,
    pub posed: &'a mut PosedSamples,
    pub sweep: &'a mut SweepScratch,
    pub motion: &'a mut Motion,
}

/// The posed samples of one motion.
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
    from: [Lanes; ROWS],
    to: [Lanes; ROWS],
}

/// Number of bounds that are kept.
const MOST_ENDS: usize = 4;

impl PosedSamples {
    /// The body along a motion.
    pub(super) fn on<'a>(
        &'a mut self,
        poses: &'a mut PoseCache,
        SampledMotion {
            baked,
            motion,
            sampling,
        }: SampledMotion<'a>,
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

impl MotionBody {
    /// Borrows all parts; `None` after the deadline.
    pub(super) fn parts(&mut self) -> Option<MotionBodyParts<'_>> {
        (!self.is_late()).then_some(MotionBodyParts {
            poses: &mut self.poses,
            posed: &mut self.posed,
            sweep: &mut self.sweep,
            motion: &mut self.motion,
        })
    }

    /// Sets the deadline. After it, tests end at once with a result that means nothing: whoever set it discards them.
    pub(crate) fn set_deadline(&mut self, deadline: Option<Instant>) {
        self.deadline = deadline;
    }

    /// Whether the deadline has passed.
    pub(crate) fn is_late(&self) -> bool {
        self.deadline
            .is_some_and(|deadline| Instant::now() >= deadline)
    }

    /// Removes the poses of earlier motions, so that they take no memory.
    pub(crate) fn forget(&mut self) {
        self.poses.forget();
    }

    /// Borrows what the test of obstacles needs; `None` after the deadline.
    pub(in crate::query) fn for_obstacles(
        &mut self,
    ) -> Option<(&mut PoseCache, &mut ObstacleScratch)> {
        (!self.is_late()).then_some((&mut self.poses, &mut self.obstacles))
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
        [x, y, z, self.baked.reach()]
    }

    /// A vertical cylinder around the body. It is that of the pose if the sample is posed.
    fn bounding_cylinder(&self, tick: usize) -> BoundingCylinder {
        if let Some(cylinder) = self.posed_cylinder(tick / self.interval()) {
            return cylinder;
        }
        let seconds = tick as f32 / SAMPLE_RATE;
        if self.motion.is_blending(seconds) || self.motion.is_layered(seconds) {
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

    /// Values at the start and the end of each interval.
    fn ends<const ROWS: usize>(
        &self,
        intervals: Intervals,
        of: impl Fn(usize) -> [f32; ROWS],
    ) -> Ends<ROWS> {
        let (mut from, mut to) = ([[0.0; LANES]; ROWS], [[0.0; LANES]; ROWS]);
        for at in 0..=intervals.count {
            let values = of(intervals.tick + at * self.sampling.interval());
            if at < intervals.count {
                put(&mut from, at, values);
            }
            if let Some(before) = at.checked_sub(1) {
                put(&mut to, before, values);
            }
        }
        Ends {
            intervals,
            from,
            to,
        }
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
        match self.sampling {
            Sampling::Each if !are_posed => {
                let mut known = std::mem::take(&mut self.scratch.bounding_spheres);
                let ends = find_or_add(&mut known, intervals, || {
                    self.ends(intervals, |tick| self.bounding_sphere(tick))
                });
                let lanes = Isa::best().run(
                    #[inline(always)]
                    || {
                        SegmentLanes::new(keys, first, interval)
                            .distances_to_spheres([&ends.from, &ends.to])
                    },
                );
                self.scratch.bounding_spheres = known;
                lanes
            }
            _ => {
                let mut known = std::mem::take(&mut self.scratch.bounding_cylinders);
                let ends = find_or_add(&mut known, intervals, || {
                    self.ends(intervals, |tick| self.bounding_cylinder(tick).to_array())
                });
                let lanes = Isa::best().run(
                    #[inline(always)]
                    || {
                        SegmentLanes::new(keys, first, interval)
                            .distances_to_cylinders([&ends.from, &ends.to])
                    },
                );
                self.scratch.bounding_cylinders = known;
                lanes
            }
        }
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

    fn near_blocks(&self, _: usize, _: Near<'_>, blocks: &mut Vec<usize>) {
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
        }
    }

    fn count(&self) -> usize {
        self.baked.body().spheres.len()
    }
}

fn put<const ROWS: usize>(rows: &mut [Lanes; ROWS], lane: usize, values: [f32; ROWS]) {
    for (row, value) in rows.iter_mut().zip(values) {
        row[lane] = value;
    }
}

/// The bounds of some intervals. They are computed if they are not stored.
fn find_or_add<const ROWS: usize>(
    known: &mut Vec<Ends<ROWS>>,
    intervals: Intervals,
    compute: impl FnOnce() -> Ends<ROWS>,
) -> &Ends<ROWS> {
    let at = known.iter().position(|ends| ends.intervals == intervals);
    let at = at.unwrap_or_else(|| {
        if known.len() == MOST_ENDS {
            known.remove(0);
        }
        known.push(compute());
        known.len() - 1
    });
    &known[at]
}
