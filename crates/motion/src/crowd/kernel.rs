//! Poses groups of sixteen characters: finds their moments, reads their keys, and computes their joints (see `chain`).

use std::marker::PhantomData;

use bytemuck::Zeroable;

use super::batches::{Batch, Batches, Picked};
use super::chain::Posing;
use super::fetch::Fetch;
use super::joint_math::JointMath;
use super::matrices::Matrices;
use super::mixed::{MixedRows, MixedWork};
use super::moments::Moments;
use super::output::{Form, Layout, Output, WriteMode};
use super::rotations::Rotations;
use super::run::{Run, RunMemory, Turn};
use super::sampling::{Playing, ReadRows, RowsPart, Window};
use super::scratch::AHEAD;
use super::scratch::Scratch;
use super::write::{Copied, InPlace, RunTarget, Scattered, Target};
use crate::math::{Apart, F32x16, Isa, Kernel, KeyRows, Lanes};

/// A run with one output form and one kind of target. Each pair has a kernel of its own. It contains the joint loop of the
/// commonest groups; the loops of the others are separate functions ([`Apart`]).
struct As<'a, P, T> {
    run: Run<'a>,
    to: T,
    math: PhantomData<P>,
}

impl<P: JointMath, T: RunTarget> Kernel for As<'_, P, T> {
    /// Number of groups that are no longer near each other in time.
    type Out = usize;

    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        let streamed = self.run.output.write == WriteMode::Streamed;
        let apart = self.run.pose::<L, P, T>(self.to);
        if streamed {
            L::fence();
        }
        apart
    }
}

impl Run<'_> {
    /// Poses all groups; returns the number of those that are no longer near each other in time.
    pub(super) fn on(self, isa: Isa, to: RunMemory<'_>) -> usize {
        let Output { layout, write, .. } = self.output;
        match to {
            RunMemory::Lines(lines) if (layout, write) == (Layout::Blocks, WriteMode::Cached) => {
                self.to(isa, InPlace(lines))
            }
            RunMemory::Lines(lines) => {
                let output = self.output;
                self.to(isa, Copied { lines, output })
            }
            RunMemory::Rows(rows) => {
                let is_streamed = write == WriteMode::Streamed;
                self.to(isa, Scattered { rows, is_streamed })
            }
        }
    }

    fn to<T: RunTarget>(self, isa: Isa, to: T) -> usize {
        match self.output.form {
            Form::Matrices => isa.on_lanes(As::<Matrices, T> {
                run: self,
                to,
                math: PhantomData,
            }),
            Form::Rotations => isa.on_lanes(As::<Rotations, T> {
                run: self,
                to,
                math: PhantomData,
            }),
        }
    }
}

impl Run<'_> {
    #[inline(always)]
    fn pose<L: Lanes, P: JointMath, T: RunTarget>(self, mut to: T) -> usize {
        let mut scratch = std::mem::take(self.scratch);
        if T::HAS_ROWS {
            // The memory behind the last joint is the same on any thread: zeros.
            for spare in &mut self.models::<P>(&mut scratch.models)[self.bank.joints.len()..] {
                *spare = P::Model::zeroed();
            }
        }
        let apart = match self.mix.is_none() {
            true => self.pose_batches::<L, P, T>(&mut scratch, &mut to),
            false => self.pose_mixed_batches::<L, P, T>(&mut scratch, &mut to),
        };
        *self.scratch = scratch;
        apart
    }

    /// Poses groups of one clip for each character.
    #[inline(always)]
    fn pose_batches<L: Lanes, P: JointMath, T: RunTarget>(
        &self,
        scratch: &mut Scratch,
        to: &mut T,
    ) -> usize {
        let mut apart = 0;
        let mut batches = self.first_batches::<L>(scratch);
        while batches.now.count > 0 {
            batches.next = self.find_batch::<L>(batches.now.after(), scratch);
            for moments in batches.now.of(&scratch.moments) {
                apart += usize::from(moments.is_apart);
            }
            let [narrow, wide, read] = batches.by_reach(&scratch.moments);
            // Keys that are read one by one are prefetched in the batch before.
            if !(read.places().is_empty() || batches.is_fetched && read.now() > 0) {
                self.rows(&scratch.moments[read.place(0)])
                    .prefetch_all(self.bank);
            }
            // Each reach has a loop of its own, so that the first one is short.
            self.pose_near_groups::<L, P, T, false>(&narrow, scratch, to);
            if wide.now() > 0 {
                self.pose_near_groups::<L, P, T, true>(&wide, scratch, to);
            }
            if read.now() > 0 {
                self.pose_read_groups::<L, P, T>(&read, scratch, to);
            }
            batches.advance(read.goes_on());
        }
        apart
    }

    /// Poses groups with something mixed in.
    #[inline(always)]
    fn pose_mixed_batches<L: Lanes, P: JointMath, T: RunTarget>(
        &self,
        scratch: &mut Scratch,
        to: &mut T,
    ) -> usize {
        let mut apart = 0;
        let mut rows = [MixedRows::<L>::NONE; AHEAD + 1];
        let mut batches = self.first_batches::<L>(scratch);
        while batches.now.count > 0 {
            batches.next = self.find_batch::<L>(batches.now.after(), scratch);
            for moments in batches.now.of(&scratch.moments) {
                apart += usize::from(moments.is_apart);
            }
            let mut work = MixedWork {
                groups: batches.visible(&scratch.moments),
                is_fetched: batches.is_fetched,
                rows: &mut rows,
            };
            self.pose_mixed::<L, P, T>(&mut work, scratch, to);
            batches.advance(work.groups.goes_on());
        }
        apart
    }

    /// Number of groups that are posed in this frame.
    #[inline(always)]
    fn turns(&self) -> usize {
        let Turn { first, step } = self.turn;
        (first..self.groups.len()).step_by(step).len()
    }

    /// Number of `F32x16`s of a group in the output.
    #[inline(always)]
    pub(super) fn group_lines(&self) -> usize {
        self.output.group_len(self.bank.joints.len())
    }

    /// The first batch of groups, with an empty one after it.
    #[inline(always)]
    fn first_batches<L: Lanes>(&self, scratch: &mut Scratch) -> Batches {
        let now = self.find_batch::<L>(0, scratch);
        Batches {
            now,
            next: Batch { count: 0, ..now },
            is_fetched: false,
        }
    }

    /// Finds the moments of the batch that begins at the turn `begun`.
    #[inline(always)]
    fn find_batch<L: Lanes>(&self, begun: usize, scratch: &mut Scratch) -> Batch {
        let count = AHEAD.min(self.turns().saturating_sub(begun));
        let batch = Batch { begun, count };
        L::apart(FindMoments {
            run: self,
            begun,
            moments: &mut scratch.moments[batch.places()],
        });
        batch
    }

    /// Poses groups whose characters share their loads.
    #[inline(always)]
    fn pose_near_groups<L: Lanes, P: JointMath, T: RunTarget, const WIDE: bool>(
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
                let posing: Posing<'_, P> = self.posing(moments, &mut out, &mut scratch.models);
                match WIDE {
                    true => posing.joints::<L, _, KeyRows<'_>>(part, playing, None),
                    // The commonest groups.
                    false => posing.joints_here::<L, _>(part, playing),
                }
            }
            let models = self.models::<P>(&mut scratch.models);
            out.write::<L, P>(self.bank.joints.len(), models);
        }
    }

    /// Poses groups whose characters are read one by one. The keys of each group are prefetched while the group before it is
    /// posed.
    #[inline(always)]
    fn pose_read_groups<L: Lanes, P: JointMath, T: RunTarget>(
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
                let from = RowsPart {
                    level: self.bank,
                    rows: &rows[0],
                    part,
                };
                let own = ReadRows::new::<L>(from, columns);
                let own = Playing::new(own, moments.weights(part));
                let posing: Posing<'_, P> = self.posing(moments, &mut out, models);
                posing.joints::<L, _, _>(part, own, rows.get(1));
            }
            out.write::<L, P>(self.bank.joints.len(), self.models::<P>(models));
        }
    }

    #[inline(always)]
    pub(super) fn posing<'a, P: JointMath>(
        &'a self,
        moments: &Moments,
        out: &'a mut impl Target,
        models: &'a mut [F32x16],
    ) -> Posing<'a, P> {
        let (models, ahead) = out.computed_in::<P>(self.models::<P>(models));
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
    pub(super) fn models<'a, P: JointMath>(&self, models: &'a mut [F32x16]) -> &'a mut [P::Model] {
        let joints = self.bank.joints.len() + P::SPARE;
        bytemuck::cast_slice_mut(&mut models[..joints * P::NUMBERS])
    }
}

/// Finds the moments of the groups from the turn `begun` on.
struct FindMoments<'a> {
    run: &'a Run<'a>,
    begun: usize,
    moments: &'a mut [Moments],
}

impl<L: Lanes> Apart<L> for FindMoments<'_> {
    #[inline(always)]
    fn run(self) {
        let Turn { first, step } = self.run.turn;
        for (turn, moments) in (self.begun..).zip(self.moments) {
            self.run.find_moments::<L>(first + turn * step, moments);
        }
    }
}
