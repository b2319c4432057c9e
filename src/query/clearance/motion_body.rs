//! The body's spheres where they are known beforehand, and where they are posed.

use rustc_hash::FxHashMap;

use super::balls::{Balls, LANES, Lanes};
use super::nearest::{Ball, Spheres};
use super::sweep::{Pace, Samples, Stretches};
use super::{SAMPLE_RATE, Sampling};
use crate::anim::{JointTransform, Pose, forward_kinematics};
use crate::graph::{Motion, Playhead};
use crate::maps::{BakedGraph, BodyTrack, PART, SphereKey};
use crate::math::Isa;

/// What posing the body along a motion needs; kept from one motion to the next, with the poses that motions
/// have in common.
#[derive(Clone, Debug, Default)]
pub struct MotionBody {
    posed: PosedRows,
    stretches: Stretches,
    /// For those who build a motion only to have it tested.
    motion: Motion,
}

/// The samples that were posed.
#[derive(Clone, Debug, Default)]
pub(super) struct PosedRows {
    pose: Pose,
    joints: Vec<JointTransform>,
    /// For each sample from the first one asked for, where its rows begin.
    slots: Vec<Option<usize>>,
    first_tick: Option<usize>,
    /// Where the rows begin of what was posed, for whatever motion, since poses were forgotten.
    known: FxHashMap<PoseKey, usize>,
    /// `[slot][x, y, z][sphere]`, padded.
    rows: Vec<f32>,
}

/// Equal for moments that have the very same pose: edge, frame, and where in the world.
type PoseKey = [u32; 6];

/// Poses of so many are remembered: those of a query's moves, and not of all candidates there can be.
const MOST_KNOWN: usize = 4096;

impl PosedRows {
    /// The body along `motion`.
    pub(super) fn on<'a>(
        &'a mut self,
        baked: &'a BakedGraph,
        motion: &'a Motion,
        sampling: Sampling,
    ) -> Posed<'a> {
        if self.known.len() > MOST_KNOWN {
            self.forget();
        }
        self.slots.clear();
        self.first_tick = None;
        Posed {
            baked,
            motion,
            sampling,
            scratch: self,
        }
    }

    fn forget(&mut self) {
        self.known.clear();
        self.rows.clear();
    }

    /// Where the rows of a pose begin.
    fn rows_of(&mut self, baked: &BakedGraph, playhead: Playhead) -> usize {
        let start = *self.known.entry(key(playhead)).or_insert(self.rows.len());
        if start == self.rows.len() {
            playhead.pose(baked.graph(), &mut self.pose);
            self.push(baked);
        }
        start
    }

    /// Where the rows begin of a motion that is bent then: nothing else has them.
    fn rows_of_bent(&mut self, baked: &BakedGraph, (motion, seconds): (&Motion, f32)) -> usize {
        let start = self.rows.len();
        motion.sample(baked.graph(), seconds, &mut self.pose);
        self.push(baked);
        start
    }

    /// Appends the rows of the pose.
    fn push(&mut self, baked: &BakedGraph) {
        forward_kinematics(baked.graph().skeleton(), &self.pose, &mut self.joints);
        baked.body_rows().push(&self.joints, &mut self.rows);
    }
}

fn key(playhead: Playhead) -> PoseKey {
    let place = playhead.clip_to_world;
    let [frame, cos, sin, x, z] =
        [playhead.frame, place.cos(), place.sin(), place.x, place.z].map(f32::to_bits);
    [playhead.edge.0, frame, cos, sin, x, z]
}

impl MotionBody {
    /// What poses, what sweeps, and a motion's memory.
    pub(super) fn parts(&mut self) -> (&mut PosedRows, &mut Stretches, &mut Motion) {
        (&mut self.posed, &mut self.stretches, &mut self.motion)
    }

    /// Must be called before it is used for another graph.
    pub(in crate::query) fn forget(&mut self) {
        self.posed.forget();
    }
}

/// The body along a motion, posed at the samples that are asked for.
pub(super) struct Posed<'a> {
    baked: &'a BakedGraph,
    motion: &'a Motion,
    sampling: Sampling,
    scratch: &'a mut PosedRows,
}

impl Posed<'_> {
    fn slot(&self, tick: usize) -> Option<usize> {
        let index = tick.checked_sub(self.scratch.first_tick?)?;
        self.scratch.slots.get(index).copied().flatten()
    }

    fn make(&mut self, tick: usize) {
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
            let graph = self.baked.graph();
            let seconds = tick as f32 / SAMPLE_RATE;
            let is_bent = { self.motion.warp() }.is_some_and(|warp| warp.acts_at(seconds));
            let rows = match is_bent {
                true => self
                    .scratch
                    .rows_of_bent(self.baked, (self.motion, seconds)),
                false => {
                    let playhead = self.motion.playhead(graph, seconds);
                    self.scratch.rows_of(self.baked, playhead)
                }
            };
            self.scratch.slots[index] = Some(rows);
        }
    }

    /// A sphere that no body leaves: x, y, z and radius.
    fn reach(&self, tick: usize) -> [f32; 4] {
        let seconds = tick as f32 / SAMPLE_RATE;
        let [x, y, z] = self.motion.root(self.baked.graph(), seconds).to_array();
        [x, y, z, self.baked.reach()]
    }

    /// A cylinder around the body.
    fn upright(&self, tick: usize) -> [f32; 5] {
        let seconds = tick as f32 / SAMPLE_RATE;
        let playhead = self.motion.playhead(self.baked.graph(), seconds);
        let upright = self.baked.bounding_cylinder(playhead.edge, playhead.frame);
        let upright = upright.placed(playhead.clip_to_world);
        let [x, z] = upright.axis.to_array();
        [x, z, upright.radius, upright.low, upright.high]
    }

    /// What `of` gives at the two ends of so many stretches that follow each other from a sample on.
    fn ends<const ROWS: usize>(
        &self,
        (tick, count): (usize, usize),
        of: impl Fn(usize) -> [f32; ROWS],
    ) -> ([Lanes; ROWS], [Lanes; ROWS]) {
        let (mut from, mut to) = ([[0.0; LANES]; ROWS], [[0.0; LANES]; ROWS]);
        for at in 0..=count {
            let values = of(tick + at * self.stretch());
            if at < count {
                put(&mut from, at, values);
            }
            if let Some(before) = at.checked_sub(1) {
                put(&mut to, before, values);
            }
        }
        (from, to)
    }

    fn axes(&self, tick: usize) -> [&[f32]; 3] {
        let row = self.baked.body_rows().radii().len();
        let start = self.slot(tick).unwrap_or(0);
        [0, 1, 2].map(|axis| &self.scratch.rows[start + axis * row..start + (axis + 1) * row])
    }
}

impl Samples for Posed<'_> {
    fn stretch(&self) -> usize {
        self.sampling.stretch()
    }

    fn bounds(&self, keys: [SphereKey; 2], (tick, count): (usize, usize)) -> Lanes {
        let stretch = self.stretch();
        match self.sampling {
            Sampling::Each => {
                let (from, to) = self.ends((tick, count), |tick| self.reach(tick));
                Isa::best().run(
                    #[inline(always)]
                    || Balls::new(keys, tick, stretch).distances_to_spheres([&from, &to]),
                )
            }
            Sampling::CoarseFirst => {
                let (from, to) = self.ends((tick, count), |tick| self.upright(tick));
                Isa::best().run(
                    #[inline(always)]
                    || Balls::new(keys, tick, stretch).distances_to_uprights([&from, &to]),
                )
            }
        }
    }

    fn near(&self, _: usize, _: &Ball, _: f32, blocks: &mut Vec<usize>) {
        blocks.extend(0..self.baked.body_rows().radii().len() / BodyTrack::LANES);
    }

    fn pace(&self) -> Pace {
        match self.sampling {
            Sampling::Each => Pace::Each,
            Sampling::CoarseFirst => Pace::EndsFirst,
        }
    }

    fn prepare(&mut self, tick: usize) {
        self.make(tick);
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

/// The body from an evasion's start on.
pub(super) struct Tracked<'a> {
    track: &'a BodyTrack,
    radii: &'a [f32],
    count: usize,
}

impl BakedGraph {
    pub(super) fn of_track<'a>(&'a self, track: &'a BodyTrack) -> Tracked<'a> {
        Tracked {
            track,
            radii: self.body_rows().radii(),
            count: self.body().spheres.len(),
        }
    }
}

impl Samples for Tracked<'_> {
    fn stretch(&self) -> usize {
        BodyTrack::STRETCH
    }

    fn bounds(&self, keys: [SphereKey; 2], (tick, _): (usize, usize)) -> Lanes {
        let hulls = self.track.hulls(tick / BodyTrack::STRETCH);
        Isa::best().run(
            #[inline(always)]
            || Balls::new(keys, tick, BodyTrack::STRETCH).distances_to_spheres([&hulls; 2]),
        )
    }

    fn near(&self, tick: usize, ball: &Ball, limit: f32, blocks: &mut Vec<usize>) {
        /// Parts of a block.
        const PARTS: usize = BodyTrack::LANES / PART;
        let hulls = self.track.part_hulls(tick / BodyTrack::STRETCH);
        Isa::best().run(
            #[inline(always)]
            || {
                for (first, hulls) in (0..).step_by(LANES / PARTS).zip(hulls) {
                    let distances = ball.distances_to_hulls(hulls);
                    for (at, parts) in distances.chunks_exact(PARTS).enumerate() {
                        if parts.iter().any(|&distance| distance < limit) {
                            blocks.push(first + at);
                        }
                    }
                }
            },
        );
    }

    fn pace(&self) -> Pace {
        Pace::Each
    }

    fn prepare(&mut self, _: usize) {}

    fn spheres(&self, ticks: [usize; 2]) -> Spheres<'_> {
        // The last sample has no next one: there the body stays for the moment that is asked for.
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
