//! The body's spheres where they are known beforehand, and where they are posed.

use glam::Vec3;
use rustc_hash::FxHashMap;

use super::nearest::{Ball, Spheres};
use super::sweep::{Pace, Samples, Stretches};
use super::{SAMPLE_RATE, Sampling};
use crate::anim::{JointTransform, Pose, forward_kinematics};
use crate::graph::{Motion, Playhead};
use crate::region::{BakedGraph, BodyTrack, Upright};

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
struct PosedRows {
    pose: Pose,
    joints: Vec<JointTransform>,
    /// For each sample from the first one asked for, where its rows begin.
    slots: Vec<Option<usize>>,
    first_tick: Option<usize>,
    /// Around the body at the sample that was asked for last.
    upright: Option<(usize, Upright)>,
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
    /// Where the rows of a pose begin.
    fn rows_of(&mut self, baked: &BakedGraph, playhead: Playhead) -> usize {
        let start = *self.known.entry(key(playhead)).or_insert(self.rows.len());
        if start == self.rows.len() {
            let graph = baked.graph();
            playhead.pose(graph, &mut self.pose);
            forward_kinematics(graph.skeleton(), &self.pose, &mut self.joints);
            baked.body_rows().push(&self.joints, &mut self.rows);
        }
        start
    }
}

fn key(playhead: Playhead) -> PoseKey {
    let place = playhead.clip_to_world;
    let [frame, cos, sin, x, z] =
        [playhead.frame, place.cos(), place.sin(), place.x, place.z].map(f32::to_bits);
    [playhead.edge.0, frame, cos, sin, x, z]
}

impl MotionBody {
    /// The body along `motion`.
    pub(super) fn on<'a>(
        &'a mut self,
        baked: &'a BakedGraph,
        motion: &'a Motion,
        sampling: Sampling,
    ) -> (Posed<'a>, &'a mut Stretches) {
        if self.posed.known.len() > MOST_KNOWN {
            self.forget();
        }
        self.posed.slots.clear();
        self.posed.first_tick = None;
        self.posed.upright = None;
        let posed = Posed {
            baked,
            motion,
            sampling,
            scratch: &mut self.posed,
        };
        (posed, &mut self.stretches)
    }

    /// Must be called before it is used for another graph.
    pub(in crate::avoid) fn forget(&mut self) {
        self.posed.known.clear();
        self.posed.rows.clear();
    }

    pub(in crate::avoid) fn take_motion(&mut self) -> Motion {
        std::mem::take(&mut self.motion)
    }

    pub(in crate::avoid) fn return_motion(&mut self, motion: Motion) {
        self.motion = motion;
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
            let playhead = self.motion.playhead(graph, tick as f32 / SAMPLE_RATE);
            self.scratch.slots[index] = Some(self.scratch.rows_of(self.baked, playhead));
        }
    }

    /// A sphere that no body leaves.
    fn reach(&self, tick: usize) -> (Vec3, f32) {
        let seconds = tick as f32 / SAMPLE_RATE;
        let root = self.motion.root(self.baked.graph(), seconds);
        (root, self.baked.reach())
    }

    fn upright(&mut self, tick: usize) -> Upright {
        match self.scratch.upright {
            Some((last, upright)) if last == tick => upright,
            _ => {
                let seconds = tick as f32 / SAMPLE_RATE;
                let playhead = self.motion.playhead(self.baked.graph(), seconds);
                let upright = self.baked.upright(playhead.edge, playhead.frame);
                let upright = upright.placed(playhead.clip_to_world);
                self.scratch.upright = Some((tick, upright));
                upright
            }
        }
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

    fn bound(&mut self, tick: usize, ball: &Ball) -> f32 {
        let ends = [tick, tick + self.stretch()];
        match self.sampling {
            Sampling::Each => ball.distance_to_spheres(ends.map(|tick| self.reach(tick))),
            Sampling::CoarseFirst => ball.distance_to_uprights(ends.map(|tick| self.upright(tick))),
        }
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

    fn bound(&mut self, tick: usize, ball: &Ball) -> f32 {
        let last = (self.track.ticks() - 1) / BodyTrack::STRETCH;
        let hull = self.track.hull((tick / BodyTrack::STRETCH).min(last));
        ball.distance_to_spheres([hull; 2])
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
