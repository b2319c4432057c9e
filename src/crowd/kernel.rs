//! The poses of groups of sixteen characters: where they are in their clips, their keys, and their joints (see `chain`).

use std::marker::PhantomData;

use bytemuck::Zeroable;

use super::chain::Posing;
use super::fetch::Fetch;
use super::group_moments::{AHEAD, Moments};
use super::joint_math::JointMath;
use super::key_bank::ClipRange;
use super::matrices::Matrices;
use super::mixed::MixedRows;
use super::moment::Cycle;
use super::output::{Form, Layout, Output, WriteMode};
use super::rotations::Rotations;
use super::run::{Run, RunMemory, Turn};
use super::sampling::{Playing, ReadRows, RowsPart, Window};
use super::scratch::Scratch;
use super::write::{Copied, InPlace, RunTarget, Scattered, Target};
use crate::math::{F32x16, Isa, Kernel, KeyRows, Lanes};

/// A run in one form, to one kind of place: kernels are large, so each has its own.
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
            // What rows end with is the same on any thread.
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
        let cycle = self.near.map(|range| (range, Cycle::<L>::of(range)));
        for begun in (0..self.turns()).step_by(AHEAD) {
            let count = self.find_batch::<L>(begun, cycle, scratch);
            // In loops of their own: the first is short then.
            let mut is_read = [false; AHEAD];
            let moments = &scratch.moments[..count];
            for (moments, is_read) in moments.iter().zip(&mut is_read) {
                apart += usize::from(self.near.is_some() && !moments.all_near);
                if moments.is_visible && moments.all_near {
                    let out = to.group(moments.group, self.group_lines(), &mut scratch.spare);
                    self.pose_near::<L, P, T::Group<'_>>(moments, out, &mut scratch.models);
                } else {
                    *is_read = moments.is_visible;
                }
            }
            if is_read != [false; AHEAD] {
                self.pose_read_groups::<L, P, T>(&is_read, scratch, to);
            }
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
        let cycle = self.near.map(|range| (range, Cycle::<L>::of(range)));
        let mut rows = [MixedRows::<L>::NONE; AHEAD];
        for begun in (0..self.turns()).step_by(AHEAD) {
            let count = self.find_batch::<L>(begun, cycle, scratch);
            for moments in &scratch.moments[..count] {
                apart += usize::from(self.near.is_some() && !moments.all_near);
            }
            self.pose_mixed::<L, P, T>(&mut rows[..count], scratch, to);
        }
        apart
    }

    /// Number of groups that are posed.
    #[inline(always)]
    fn turns(&self) -> usize {
        let Turn { first, step } = self.turn;
        (first..self.groups.len()).step_by(step).len()
    }

    /// Lines of a group in the output.
    #[inline(always)]
    pub(super) fn group_lines(&self) -> usize {
        self.output.group_len(self.bank.joints.len())
    }

    /// Finds the moments of the next groups; returns how many there are.
    #[inline(always)]
    fn find_batch<L: Lanes>(
        &self,
        begun: usize,
        near: Option<(&ClipRange, Cycle<L>)>,
        scratch: &mut Scratch,
    ) -> usize {
        let Turn { first, step } = self.turn;
        let count = AHEAD.min(self.turns() - begun);
        for (turn, moments) in (begun..).zip(&mut scratch.moments[..count]) {
            self.find_moments(first + turn * step, near, moments);
        }
        count
    }

    /// A group whose characters share their loads.
    #[inline(always)]
    fn pose_near<L: Lanes, P: JointMath, T: Target>(
        &self,
        moments: &Moments,
        mut out: T,
        models: &mut [F32x16],
    ) {
        for part in 0..L::PARTS {
            let Some(window) = self.window::<L>(moments, part) else {
                return;
            };
            let playing = Playing::new(window, moments.weights(part));
            let mut posing = self.posing::<L, P, T>(moments, &mut out, models);
            posing.joints::<L, _, KeyRows<'_>>(part, playing, None);
        }
        out.write::<L, P>(self.bank.joints.len(), self.models::<P>(models));
    }

    /// The keys of characters that share their loads.
    #[inline(always)]
    pub(super) fn window<L: Lanes>(&self, moments: &Moments, part: usize) -> Option<Window<'_, L>> {
        let range = self.near?;
        Some(Window::new(self.keys, range, moments.near(part)))
    }

    /// Groups whose characters are read one by one. The keys of each group are asked for while the one before is posed.
    #[inline(always)]
    fn pose_read_groups<L: Lanes, P: JointMath, T: RunTarget>(
        &self,
        is_read: &[bool; AHEAD],
        scratch: &mut Scratch,
        to: &mut T,
    ) {
        let Scratch {
            models,
            columns: [columns, ..],
            spare,
            moments: ahead,
        } = scratch;
        let mut rows = [KeyRows::none(&self.keys.rows); AHEAD];
        let (mut indices, mut count) = ([0; AHEAD], 0);
        for index in 0..AHEAD {
            if is_read[index] {
                // Some groups before they are used: numbers that were stored together are not read one by one at once.
                rows[count] = self.rows(&ahead[index]);
                indices[count] = index;
                count += 1;
            }
        }
        rows[0].prefetch_all(self.bank);
        for turn in 0..count {
            let rows = &rows[turn..count];
            let moments = &ahead[indices[turn]];
            let mut out = to.group(moments.group, self.group_lines(), spare);
            for part in 0..L::PARTS {
                let from = RowsPart {
                    level: self.bank,
                    rows: &rows[0],
                    part,
                };
                let own = ReadRows::new::<L>(from, columns);
                let own = Playing::new(own, moments.weights(part));
                let mut posing = self.posing::<L, P, T::Group<'_>>(moments, &mut out, models);
                posing.joints::<L, _, _>(part, own, rows.get(1));
            }
            out.write::<L, P>(self.bank.joints.len(), self.models::<P>(models));
        }
    }

    #[inline(always)]
    pub(super) fn posing<'a, L: Lanes, P: JointMath, T: Target>(
        &'a self,
        moments: &Moments,
        out: &'a mut T,
        models: &'a mut [F32x16],
    ) -> Posing<'a, P, T> {
        Posing {
            bank: self.bank,
            level: self.level,
            group: &self.groups[moments.group],
            models: self.models::<P>(models),
            out,
            is_posed: moments.is_posed,
        }
    }

    /// A group's joints in memory of the thread's own.
    #[inline(always)]
    pub(super) fn models<'a, P: JointMath>(&self, models: &'a mut [F32x16]) -> &'a mut [P::Model] {
        let joints = self.bank.joints.len() + P::SPARE;
        bytemuck::cast_slice_mut(&mut models[..joints * P::NUMBERS])
    }
}
