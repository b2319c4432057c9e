//! Poses groups of sixteen characters.
//!
//! ```text
//! for each batch of 8 groups:                              finding moments is a long chain; those of several groups overlap
//!     find the moments of the next batch                   moments
//!     for each group, by how near its lanes are in time:
//!         for each part of 4, 8 or 16 lanes:               4 in plain Rust and NEON, 8 in AVX2, 16 in AVX-512
//!             for each joint, parents first:               chain
//!                 keys    = one load (near), two (wide), or 16 rows that are transposed (apart)        sampling
//!                 local   = keys before * weight + keys after * weight
//!                 model   = parent's model * local         joint_math
//!         write the models: in place, as rows, or past the caches                                     write
//! ```
//!
//! The kernel contains the joint loop of the commonest groups; the loops of the others are separate functions
//! ([`Lanes::apart`]).

use bytemuck::Zeroable;

use super::batches::{AHEAD, Picked, Scratch};
use super::chain::Posing;
use super::joint_math::{Model, NUMBERS, SPARE};
use super::moments::{Moments, Run};
use super::sampling::{Fetch, Playing, ReadRows};
use super::write::{GroupMemory, RunMemory};
use crate::crowd::output::WriteMode;
use crate::math::{F32x16, Isa, Kernel, KeyRows, Lanes};

struct PoseGroups<'a> {
    run: &'a Run<'a>,
    scratch: &'a mut Scratch,
    to: RunMemory<'a>,
}

impl Kernel for PoseGroups<'_> {
    /// Number of groups whose characters are no longer near each other in time.
    type Out = usize;

    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        let (run, scratch, mut to) = (*self.run, self.scratch, self.to);
        let mut own = std::mem::take(scratch);
        if matches!(to, RunMemory::Rows(_)) {
            // The memory behind the last joint, which the last `F32x16` of a row reads, is the same on any thread: zeros.
            for spare in &mut run.models(&mut own.models)[run.bank.joints.len()..] {
                *spare = Model::zeroed();
            }
        }
        let apart = match run.fades {
            false => run.pose_batches::<L>(&mut own, &mut to),
            true => run.pose_fading_batches::<L>(&mut own, &mut to),
        };
        *scratch = own;
        if run.output.write == WriteMode::Streamed {
            L::fence();
        }
        apart
    }
}

impl Run<'_> {
    /// Poses all groups into `to`; returns the number of groups whose characters are no longer near each other in time.
    pub(crate) fn pose(&self, isa: Isa, scratch: &mut Scratch, to: RunMemory<'_>) -> usize {
        let run = self;
        isa.on_lanes(PoseGroups { run, scratch, to })
    }

    /// Poses groups of one clip for each character.
    #[inline(always)]
    fn pose_batches<L: Lanes>(&self, scratch: &mut Scratch, to: &mut RunMemory<'_>) -> usize {
        let (mut apart, mut is_fetched) = (0, false);
        let mut batch = self.find_batch::<L>(0, scratch);
        while batch.count > 0 {
            let next = self.find_batch::<L>(batch.begun + AHEAD, scratch);
            apart += batch.apart(&scratch.moments);
            let class = |moments: &Moments| moments.reach as usize;
            let [narrow, wide, read] = batch.pick(next, &scratch.moments, class);
            // Keys that are read one by one are prefetched in the batch before.
            if !(read.places().is_empty() || is_fetched && read.now() > 0) {
                self.rows(&scratch.moments[read.place(0)])
                    .prefetch_all(self.bank);
            }
            // Each reach has a loop of its own, so that the first one is short.
            self.pose_near_groups::<L, false>(&narrow, scratch, to);
            if wide.now() > 0 {
                self.pose_near_groups::<L, true>(&wide, scratch, to);
            }
            if read.now() > 0 {
                self.pose_read_groups::<L>(&read, scratch, to);
            }
            (batch, is_fetched) = (next, read.goes_on());
        }
        apart
    }

    /// Number of `F32x16`s of a group in the output.
    #[inline(always)]
    pub(crate) fn group_lines(&self) -> usize {
        self.output.group_len(self.bank.joints.len())
    }

    /// Poses groups whose characters share their loads.
    #[inline(always)]
    fn pose_near_groups<L: Lanes, const WIDE: bool>(
        &self,
        groups: &Picked,
        scratch: &mut Scratch,
        to: &mut RunMemory<'_>,
    ) {
        for turn in 0..groups.now() {
            let moments = &scratch.moments[groups.place(turn)];
            let next = &scratch.moments[groups.place(turn + 1)];
            let mut out = to.group(moments.group, self.group_lines(), &mut scratch.spare);
            for part in 0..L::PARTS {
                let playing = Playing {
                    columns: moments.window::<L, WIDE>(next, self.keys, part),
                    weights: L::load_words(&moments.weights, part),
                };
                let posing: Posing<'_> = self.posing(moments, &mut out, &mut scratch.models);
                let fetch = None::<&KeyRows<'_>>;
                match WIDE {
                    true => posing.joints::<L, _>(part, playing, fetch),
                    // The commonest groups.
                    false => posing.joints_here::<L, _>(part, playing, fetch),
                }
            }
            self.write::<L>(out, &mut scratch.models);
        }
    }

    /// Poses groups whose characters are read one by one. The keys of each group are prefetched while the group before it is
    /// posed.
    #[inline(always)]
    fn pose_read_groups<L: Lanes>(
        &self,
        groups: &Picked,
        scratch: &mut Scratch,
        to: &mut RunMemory<'_>,
    ) {
        let Scratch {
            models,
            columns: [columns, ..],
            spare,
            moments: ahead,
        } = scratch;
        let mut rows = [KeyRows::none(&self.keys.rows); AHEAD + 1];
        let places = groups.places();
        for (rows, &place) in rows.iter_mut().zip(places) {
            // Rows are found some groups before their use: numbers that were stored together cannot be read one by one right
            // away.
            *rows = self.rows(&ahead[usize::from(place)]);
        }
        for turn in 0..groups.now() {
            let moments = &ahead[groups.place(turn)];
            let rows = &rows[turn..places.len()];
            let mut out = to.group(moments.group, self.group_lines(), spare);
            for part in 0..L::PARTS {
                let playing = Playing {
                    columns: ReadRows::new::<L>(self.bank, &rows[0], part, columns),
                    weights: L::load_words(&moments.weights, part),
                };
                let posing: Posing<'_> = self.posing(moments, &mut out, models);
                posing.joints::<L, _>(part, playing, rows.get(1));
            }
            self.write::<L>(out, models);
        }
    }

    #[inline(always)]
    pub(crate) fn posing<'a>(
        &'a self,
        moments: &Moments,
        out: &'a mut GroupMemory<'_>,
        models: &'a mut [F32x16],
    ) -> Posing<'a> {
        let (models, ahead) = out.computed_in(self.output.write, self.models(models));
        Posing {
            bank: self.bank,
            level: self.level,
            group: &self.groups[moments.group],
            models,
            ahead,
            is_posed: moments.is_posed,
        }
    }

    /// Writes a group whose joints have been computed.
    #[inline(always)]
    pub(crate) fn write<L: Lanes>(&self, out: GroupMemory<'_>, models: &mut [F32x16]) {
        let joints = self.bank.joints.len();
        out.write::<L>(self.output.write, joints, self.models(models));
    }

    /// The thread's memory for the joints of a group.
    #[inline(always)]
    pub(crate) fn models<'a>(&self, models: &'a mut [F32x16]) -> &'a mut [Model] {
        let joints = self.bank.joints.len() + SPARE;
        bytemuck::cast_slice_mut(&mut models[..joints * NUMBERS])
    }
}
