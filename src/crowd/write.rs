//! Where a group's joints go in the output.

use std::marker::PhantomData;

use bytemuck::Zeroable;

use super::joint_math::JointMath;
use super::output::{Layout, Output, WriteMode, row_lines, turn_joints, turn_lines};
use crate::math::{F32x16, Lanes, StridedLines, prefetch_for_write};

/// Writes the joints of a group from memory of the thread's own.
pub(super) struct GroupWriter<'a, P> {
    out: &'a mut [F32x16],
    output: Output,
    joints: usize,
    math: PhantomData<P>,
}

impl<'a, P: JointMath> GroupWriter<'a, P> {
    /// Writes a group of so many joints to `out`.
    #[inline(always)]
    pub(super) fn new(out: &'a mut [F32x16], output: Output, joints: usize) -> Self {
        Self {
            out,
            output,
            joints,
            math: PhantomData,
        }
    }

    /// Asks for lines that are written some joints later: the machine does not foresee sixteen rows that are written side by
    /// side. Some joints end on a whole line together, a turn; each of them asks for the lines of its share of the rows.
    #[inline(always)]
    pub(super) fn prefetch(&mut self, joint: usize) {
        /// Turns from the one that is computed.
        const FURTHER: usize = 2;
        if self.output.layout == Layout::Blocks || self.output.write == WriteMode::Streamed {
            return;
        }
        let (of_turn, row) = (turn_joints::<P>(), row_lines::<P>(self.joints));
        let share = F32x16::LANES / of_turn;
        let (mut first, mut line) = (0, (joint / of_turn + FURTHER) * turn_lines::<P>());
        if line >= row {
            // The next group.
            line -= row;
            first = F32x16::LANES;
        }
        let mut start = (first + joint % of_turn * share) * row + line;
        for _ in 0..share {
            for line in 0..turn_lines::<P>() {
                prefetch_for_write(self.out, start + line);
            }
            start += row;
        }
    }

    /// Writes all joints.
    #[inline(always)]
    pub(super) fn write<L: Lanes>(&mut self, models: &[P::Model]) {
        let models = &models[..self.joints];
        match self.output.layout {
            Layout::Blocks => self.blocks::<L>(models),
            Layout::Rows => self.rows::<L>(models),
        }
    }

    #[inline(always)]
    fn blocks<L: Lanes>(&mut self, models: &[P::Model]) {
        for (model, to) in models.iter().zip(self.out.chunks_exact_mut(P::NUMBERS)) {
            for (from, to) in model.as_ref().iter().zip(to) {
                for part in 0..L::PARTS {
                    L::load(from, part).stream(to, part);
                }
            }
        }
    }

    #[inline(always)]
    fn rows<L: Lanes>(&mut self, models: &[P::Model]) {
        const { assert!(turn_lines::<P>() + 1 == turn_joints::<P>()) };
        let rest = P::Model::zeroed();
        for (turn, models) in models.chunks(turn_joints::<P>()).enumerate() {
            for line in 0..turn_lines::<P>() {
                // A line has the numbers of two joints. Where the second one is missing, its part of the line is undefined.
                let Some(first) = models.get(line) else {
                    break;
                };
                let pair = [first, models.get(line + 1).unwrap_or(&rest)];
                let out = &mut self.out[turn * turn_lines::<P>() + line..];
                let to = StridedLines::new(out, row_lines::<P>(self.joints));
                let is_streamed = self.output.write == WriteMode::Streamed;
                match line {
                    0 => write_line::<L, P, 0>(pair, to, is_streamed),
                    1 => write_line::<L, P, 1>(pair, to, is_streamed),
                    _ => write_line::<L, P, 2>(pair, to, is_streamed),
                }
            }
        }
    }
}

/// Line `LINE` of a turn, of sixteen rows.
#[inline(always)]
fn write_line<L: Lanes, P: JointMath, const LINE: usize>(
    pair: [&P::Model; 2],
    mut to: StridedLines<'_>,
    is_streamed: bool,
) {
    if LINE >= turn_lines::<P>() {
        return;
    }
    let mut numbers = [&F32x16::ZERO; F32x16::LANES];
    for (index, number) in numbers.iter_mut().enumerate() {
        let place = LINE * (F32x16::LANES - P::ROW) + index;
        if place % P::ROW < P::NUMBERS {
            *number = &pair[place / P::ROW].as_ref()[place % P::ROW];
        }
    }
    L::transpose_with(
        numbers,
        #[inline(always)]
        |lane, part, numbers| {
            if is_streamed {
                numbers.stream(to.line(lane), part);
            } else {
                numbers.store(to.line(lane), part);
            }
        },
    );
}
