//! Where a group's joints go in the output.

use std::marker::PhantomData;

use bytemuck::Zeroable;

use super::joint_math::JointMath;
use super::output::{Layout, Output, WriteMode, row_lines, turn_joints, turn_lines};
use crate::math::{F32x16, Lanes, RowLines};

/// Where a group goes.
pub(super) enum GroupLines<'a> {
    /// [`Layout::Blocks`](super::Layout::Blocks).
    Blocks(&'a mut [F32x16]),
    /// [`Layout::Rows`].
    Rows(&'a mut [F32x16]),
    /// A row of its own for each lane.
    Instances(RowLines<'a>),
}

impl GroupLines<'_> {
    /// The same for a while.
    #[inline(always)]
    pub(super) fn reborrow(&mut self) -> GroupLines<'_> {
        match self {
            Self::Blocks(lines) => GroupLines::Blocks(lines),
            Self::Rows(lines) => GroupLines::Rows(lines),
            Self::Instances(rows) => GroupLines::Instances(rows.reborrow()),
        }
    }
}

/// Writes the joints of a group from memory of the thread's own.
pub(super) struct GroupWriter<'a, P> {
    pub(super) out: GroupLines<'a>,
    pub(super) output: Output,
    pub(super) joints: usize,
    pub(super) math: PhantomData<P>,
}

impl<P: JointMath> GroupWriter<'_, P> {
    /// Asks for lines that are written some joints later: the machine does not foresee sixteen rows that are written side by
    /// side. Some joints end on a whole line together, a turn; each of them asks for the lines of its share of the rows.
    #[inline(always)]
    pub(super) fn prefetch(&mut self, joint: usize) {
        /// Turns from the one that is computed.
        const FURTHER: usize = 2;
        let (of_turn, length) = (turn_joints::<P>(), row_lines::<P>(self.joints));
        let rows = match &mut self.out {
            GroupLines::Blocks(_) => return,
            _ if self.output.write == WriteMode::Streamed => return,
            // Stride by stride: the compiler keeps no table of rows.
            GroupLines::Rows(lines) => &RowLines::new(lines, length),
            GroupLines::Instances(rows) => &*rows,
        };
        let share = F32x16::LANES / of_turn;
        let mut line = (joint / of_turn + FURTHER) * turn_lines::<P>();
        if line >= length {
            if self.output.layout == Layout::Instances {
                return;
            }
            // The next group.
            line += (F32x16::LANES - 1) * length;
        }
        let first = joint % of_turn * share;
        for row in first..first + share {
            for line in line..line + turn_lines::<P>() {
                rows.prefetch(row, line);
            }
        }
    }

    /// Writes all joints.
    #[inline(always)]
    pub(super) fn write<L: Lanes>(self, models: &[P::Model]) {
        let models = &models[..self.joints];
        let is_streamed = self.output.write == WriteMode::Streamed;
        match self.out {
            GroupLines::Blocks(out) => blocks::<L, P>(models, out),
            GroupLines::Rows(lines) => {
                let rows = RowLines::new(lines, row_lines::<P>(self.joints));
                write_rows::<L, P>(models, rows, is_streamed);
            }
            GroupLines::Instances(rows) => write_rows::<L, P>(models, rows, is_streamed),
        }
    }
}

#[inline(always)]
fn blocks<L: Lanes, P: JointMath>(models: &[P::Model], out: &mut [F32x16]) {
    for (model, to) in models.iter().zip(out.chunks_exact_mut(P::NUMBERS)) {
        for (from, to) in model.as_ref().iter().zip(to) {
            for part in 0..L::PARTS {
                L::load(from, part).stream(to, part);
            }
        }
    }
}

#[inline(always)]
fn write_rows<L: Lanes, P: JointMath>(
    models: &[P::Model],
    mut rows: RowLines<'_>,
    is_streamed: bool,
) {
    const { assert!(turn_lines::<P>() + 1 == turn_joints::<P>()) };
    let rest = P::Model::zeroed();
    for (turn, models) in models.chunks(turn_joints::<P>()).enumerate() {
        for line in 0..turn_lines::<P>() {
            // A line has the numbers of two joints. Where the second one is missing, its part of the line is undefined.
            let Some(first) = models.get(line) else {
                break;
            };
            let pair = [first, models.get(line + 1).unwrap_or(&rest)];
            let mut to = RowLine {
                rows: &mut rows,
                line: turn * turn_lines::<P>() + line,
                is_streamed,
            };
            match line {
                0 => to.write::<L, P, 0>(pair),
                1 => to.write::<L, P, 1>(pair),
                _ => to.write::<L, P, 2>(pair),
            }
        }
    }
}

/// One line of each of sixteen rows.
struct RowLine<'a, 'b> {
    rows: &'a mut RowLines<'b>,
    line: usize,
    is_streamed: bool,
}

impl RowLine<'_, '_> {
    /// Line `LINE` of a turn.
    #[inline(always)]
    fn write<L: Lanes, P: JointMath, const LINE: usize>(&mut self, pair: [&P::Model; 2]) {
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
                let to = self.rows.line(lane, self.line);
                if self.is_streamed {
                    numbers.stream(to, part);
                } else {
                    numbers.store(to, part);
                }
            },
        );
    }
}
