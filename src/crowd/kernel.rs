//! The poses of groups of sixteen characters: keys, mixing, the chain of joints, the output.
//!
//! Source: Hasegawa, Nishio & Kobori, 3 (joints of a level evaluated in model space). Differs: one
//! joint of sixteen characters is computed at once, a character in each lane. Joints stand
//! breadth-first, so that a joint seldom waits for the one just before it.

use std::marker::PhantomData;

use super::bank::{Bank, Span};
use super::form::{Matrices, Posture, Rotations};
use super::group::Group;
use super::output::{Form, Layout, Memory, Output, row_lines, turn_joints, turn_lines};
use super::sample::{Columns, Moment, Playing, Scattered, Source, Window};
use crate::math::{Kernel, Lanes, Line};

/// Groups that play one clip on one level.
pub(super) struct Run<'a> {
    pub(super) bank: &'a Bank,
    pub(super) span: &'a Span,
    pub(super) groups: &'a [Group],
    /// Whether some of them have a second clip.
    pub(super) fading: bool,
    /// The crowd's clock, seconds.
    pub(super) now: f32,
    pub(super) output: Output,
    /// [`Output::lines`] for each group.
    pub(super) out: &'a mut [Line],
    /// One group's joints, where the output is not read from.
    pub(super) scratch: &'a mut Vec<Line>,
}

/// A line is taken in two parts at most.
const PARTS: usize = 2;

impl Kernel for Run<'_> {
    /// How many groups were not near enough in time to share their loads.
    type Out = usize;

    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        const { assert!(L::PARTS <= PARTS) };
        let streamed = self.output.memory == Memory::Streamed;
        let apart = match self.output.form {
            Form::Matrices => self.pose::<L, Matrices>(),
            Form::Rotations => self.pose::<L, Rotations>(),
        };
        if streamed {
            L::fence();
        }
        apart
    }
}

impl Run<'_> {
    #[inline(always)]
    fn pose<L: Lanes, P: Posture>(self) -> usize {
        let joints = self.bank.joints.len();
        let lines = self.output.lines(joints);
        self.scratch.resize(joints * P::NUMBERS, Line::ZERO);
        let length = L::splat(self.span.intervals as f32);
        let fading = self.fading.then_some(self.now);
        let mut apart = 0;
        for (group, out) in self.groups.iter().zip(self.out.chunks_exact_mut(lines)) {
            let mut posing = Posing::<P> {
                bank: self.bank,
                placement: [Line::ZERO; 12],
                models: &mut *self.scratch,
                out,
                output: self.output,
                posture: PhantomData,
            };
            for part in 0..L::PARTS {
                P::placed(&group.placement::<L>(part), &mut posing.placement, part);
            }
            // The second is the first again where a line has one part.
            let last = L::PARTS - 1;
            let moments = [
                group.clock.moment(0, self.now, length),
                group.clock.moment(last, self.now, length),
            ];
            let windows = (
                Window::new(self.span, moments[0].interval),
                Window::new(self.span, moments[1].interval),
            );
            if let (Some(first), Some(second)) = windows {
                posing.group(group, fading, moments, [first, second]);
            } else {
                apart += 1;
                let columns = [
                    Scattered::new(self.span, moments[0].interval),
                    Scattered::new(self.span, moments[1].interval),
                ];
                posing.group(group, fading, moments, columns);
            }
        }
        apart
    }
}

/// One group and where it goes.
struct Posing<'a, P> {
    bank: &'a Bank,
    placement: [Line; 12],
    models: &'a mut [Line],
    out: &'a mut [Line],
    output: Output,
    posture: PhantomData<P>,
}

impl<P: Posture> Posing<'_, P> {
    #[inline(always)]
    fn group<L: Lanes, C: Columns<L> + Copy>(
        &mut self,
        group: &Group,
        fading: Option<f32>,
        moments: [Moment<L>; PARTS],
        columns: [C; PARTS],
    ) {
        let first = [
            Playing::new(columns[0], moments[0].share),
            Playing::new(columns[1], moments[1].share),
        ];
        if let Some(now) = fading {
            let fade = &group.fade;
            self.joints([
                fade.mixed(first[0], 0, now),
                fade.mixed(first[1], L::PARTS - 1, now),
            ]);
        } else {
            self.joints(first);
        }
    }

    /// All joints, parents first.
    #[inline(always)]
    fn joints<L: Lanes, S: Source<L>>(&mut self, mut sources: [S; PARTS]) {
        let in_place = (Layout::Blocks, Memory::Cached);
        let in_place = (self.output.layout, self.output.memory) == in_place;
        for (index, joint) in self.bank.joints.iter().enumerate() {
            let models = if in_place {
                &mut *self.out
            } else {
                &mut *self.models
            };
            let (done, rest) = models.split_at_mut(index * P::NUMBERS);
            let above = match joint.parent {
                Some(parent) => &done[usize::from(parent) * P::NUMBERS..][..P::NUMBERS],
                None => &self.placement[..P::NUMBERS],
            };
            for part in 0..L::PARTS {
                let local = sources[part].next(&self.bank.words, joint);
                P::compose(above, local, &mut rest[..P::NUMBERS], part);
            }
            match (self.output.layout, self.output.memory) {
                (Layout::Blocks, Memory::Cached) => {}
                (Layout::Blocks, Memory::Streamed) => self.stream_block::<L>(index),
                (Layout::Rows, _) => self.write_rows::<L>(index),
            }
        }
    }

    #[inline(always)]
    fn stream_block<L: Lanes>(&mut self, joint: usize) {
        let lines = joint * P::NUMBERS..(joint + 1) * P::NUMBERS;
        let (from, to) = (&self.models[lines.clone()], &mut self.out[lines]);
        for (from, to) in from.iter().zip(to) {
            for part in 0..L::PARTS {
                L::load(from, part).stream(to, part);
            }
        }
    }

    /// Writes the whole lines that end with this joint.
    #[inline(always)]
    fn write_rows<L: Lanes>(&mut self, joint: usize) {
        let joints = self.bank.joints.len();
        let (of_turn, lines) = (turn_joints::<P>(), turn_lines::<P>());
        if (joint + 1) % of_turn != 0 && joint + 1 != joints {
            return;
        }
        let turn = joint / of_turn;
        let row = row_lines::<P>(joints);
        for line in 0..lines {
            let mut lines_in = [&Line::ZERO; Line::LANES];
            for (index, from) in lines_in.iter_mut().enumerate() {
                let number = line * Line::LANES + index;
                let joint = turn * of_turn + number / P::ROW;
                if number % P::ROW < P::NUMBERS && joint < joints {
                    *from = &self.models[joint * P::NUMBERS + number % P::ROW];
                }
            }
            let turned = L::transpose(lines_in);
            for (lane, from) in turned.iter().enumerate() {
                let to = &mut self.out[lane * row + turn * lines + line];
                for part in 0..L::PARTS {
                    match self.output.memory {
                        Memory::Cached => L::load(from, part).store(to, part),
                        Memory::Streamed => L::load(from, part).stream(to, part),
                    }
                }
            }
        }
    }
}
