//! Poses groups of sixteen characters.
//!
//! ```text
//! for each batch of 8 groups:                              finding moments is a long chain; those of several groups overlap
//!     find the moments of the next batch                   moments
//!     for each group with a visible character, by how near its lanes are in time:
//!         for each part of 4, 8 or 16 lanes:               4 in plain Rust and NEON, 8 in AVX2, 16 in AVX-512
//!             for each joint, parents first:               chain
//!                 keys    = one load (near), two (wide), or 16 rows that are transposed (apart)        sampling
//!                 local   = keys before * weight + keys after * weight
//!                 model   = parent's model * local         joint_math
//!         write the models: in place, as rows, or past the caches                                     write
//! ```
//!
//! Each kind of memory has a kernel of its own. It contains the joint loop of the commonest groups;
//! the loops of the others are separate functions ([`Apart`](crate::math::Apart)).

use bytemuck::Zeroable;

use super::batches::{AHEAD, Picked, Scratch};
use super::chain::Posing;
use super::joint_math::{Model, NUMBERS, SPARE};
use super::moments::{Moments, Run};
use super::sampling::{Fetch, Playing, ReadRows, Window};
use super::write::{Copied, InPlace, RunMemory, RunTarget, Scattered, Target};
use crate::crowd::output::WriteMode;
use crate::math::{F32x16, Isa, Kernel, KeyRows, Lanes};

/// The kernel of one kind of memory.
struct PoseGroups<'a, T> {
    run: Run<'a>,
    scratch: &'a mut Scratch,
    to: T,
}

impl<T: RunTarget> Kernel for PoseGroups<'_, T> {
    /// Number of groups whose characters are no longer near each other in time.
    type Out = usize;

    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        let Self {
            run,
            scratch,
            mut to,
        } = self;
        let mut own = std::mem::take(scratch);
        if T::HAS_ROWS {
            // The memory behind the last joint is the same on any thread: zeros.
            for spare in &mut run.models(&mut own.models)[run.bank.joints.len()..] {
                *spare = Model::zeroed();
            }
        }
        let apart = match run.fades {
            false => run.pose_batches::<L, T>(&mut own, &mut to),
            true => run.pose_fading_batches::<L, T>(&mut own, &mut to),
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
        let is_streamed = self.output.write == WriteMode::Streamed;
        match to {
            RunMemory::Lines(lines) if !is_streamed => self.pose_to(isa, scratch, InPlace(lines)),
            RunMemory::Lines(lines) => self.pose_to(isa, scratch, Copied(lines)),
            RunMemory::Rows(rows) => self.pose_to(isa, scratch, Scattered { rows, is_streamed }),
        }
    }

    fn pose_to<T: RunTarget>(&self, isa: Isa, scratch: &mut Scratch, to: T) -> usize {
        isa.on_lanes(PoseGroups {
            run: *self,
            scratch,
            to,
        })
    }

    /// Poses groups of one clip for each character.
    #[inline(always)]
    fn pose_batches<L: Lanes, T: RunTarget>(&self, scratch: &mut Scratch, to: &mut T) -> usize {
        let mut apart = 0;
        let mut batches = self.first_batches::<L>(scratch);
        while batches.now.count > 0 {
            batches.next = self.find_batch::<L>(batches.now.after(), scratch);
            apart += batches.now.apart(&scratch.moments);
            let [narrow, wide, read] = batches.by_reach(&scratch.moments);
            // Keys that are read one by one are prefetched in the batch before.
            if !(read.places().is_empty() || batches.is_fetched && read.now() > 0) {
                self.rows(&scratch.moments[read.place(0)])
                    .prefetch_all(self.bank);
            }
            // Each reach has a loop of its own, so that the first one is short.
            self.pose_near_groups::<L, T, false>(&narrow, scratch, to);
            if wide.now() > 0 {
                self.pose_near_groups::<L, T, true>(&wide, scratch, to);
            }
            if read.now() > 0 {
                self.pose_read_groups::<L, T>(&read, scratch, to);
            }
            batches.advance(read.goes_on());
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
    fn pose_near_groups<L: Lanes, T: RunTarget, const WIDE: bool>(
        &self,
        groups: &Picked,
        scratch: &mut Scratch,
        to: &mut T,
    ) {
        for turn in 0..groups.now() {
            let moments = &scratch.moments[groups.place(turn)];
            let next = &scratch.moments[groups.place(turn + 1)];
            let mut out = to.group(moments.group, self.group_lines(), &mut scratch.spare);
            for part in 0..L::PARTS {
                let window = Window::<L, WIDE>::new(self.keys, moments.windows(next, part));
                let playing = Playing::new(window, moments.weights(part));
                let posing: Posing<'_> = self.posing(moments, &mut out, &mut scratch.models);
                match WIDE {
                    true => posing.joints::<L, _, KeyRows<'_>>(part, playing, None),
                    // The commonest groups.
                    false => posing.joints_here::<L, _>(part, playing),
                }
            }
            let models = self.models(&mut scratch.models);
            out.write::<L>(self.bank.joints.len(), models);
        }
    }

    /// Poses groups whose characters are read one by one. The keys of each group are prefetched while the group before it is
    /// posed.
    #[inline(always)]
    fn pose_read_groups<L: Lanes, T: RunTarget>(
        &self,
        groups: &Picked,
        scratch: &mut Scratch,
        to: &mut T,
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
                let own = ReadRows::new::<L>(self.bank, &rows[0], part, columns);
                let own = Playing::new(own, moments.weights(part));
                let posing: Posing<'_> = self.posing(moments, &mut out, models);
                posing.joints::<L, _, _>(part, own, rows.get(1));
            }
            out.write::<L>(self.bank.joints.len(), self.models(models));
        }
    }

    #[inline(always)]
    pub(crate) fn posing<'a>(
        &'a self,
        moments: &Moments,
        out: &'a mut impl Target,
        models: &'a mut [F32x16],
    ) -> Posing<'a> {
        let (models, ahead) = out.computed_in(self.models(models));
        Posing {
            bank: self.bank,
            level: self.level,
            group: &self.groups[moments.group],
            models,
            ahead,
            is_posed: moments.is_posed,
        }
    }

    /// The thread's memory for the joints of a group.
    #[inline(always)]
    pub(crate) fn models<'a>(&self, models: &'a mut [F32x16]) -> &'a mut [Model] {
        let joints = self.bank.joints.len() + SPARE;
        bytemuck::cast_slice_mut(&mut models[..joints * NUMBERS])
    }
}
