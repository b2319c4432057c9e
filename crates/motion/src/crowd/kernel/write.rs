//! Writes a group's joints to the output. Each kind of target has kernels of its own, so that it does not slow down the
//! others.

use super::joint_math::JointMath;
use crate::crowd::output::{Layout, Output, WriteMode, row_lines, turn_joints, turn_lines};
use crate::math::{
    Apart, F32x16, Lanes, PartWrite, RowLines, RowSet, Sixteen, StridedLines, prefetch_for_write,
};

/// Memory that groups are written to.
pub(crate) enum RunMemory<'a> {
    /// One after the other, [`Output::group_len`] `F32x16`s for each group.
    Lines(&'a mut [F32x16]),
    /// One row for each lane, anywhere in the output.
    Rows(RowSet<'a>),
}

impl RunMemory<'_> {
    /// Splits off the memory of the first `groups` groups, which take `lines` `F32x16`s.
    pub(crate) fn split_off_front(&mut self, lines: usize, groups: usize) -> Self {
        match self {
            Self::Lines(all) => {
                let (front, rest) = std::mem::take(all).split_at_mut(lines);
                *all = rest;
                Self::Lines(front)
            }
            Self::Rows(rows) => Self::Rows(rows.split_off_front(groups * F32x16::LANES)),
        }
    }
}

/// Memory that the groups of a run are written to.
pub(crate) trait RunTarget {
    type Group<'a>: Target
    where
        Self: 'a;

    /// Whether groups may be written as rows. The last `F32x16` of a row reads joints beyond the last one.
    const HAS_ROWS: bool;

    /// The memory of one group, which has `lines` `F32x16`s. `spare` receives the rows of unused lanes.
    fn group<'a>(
        &'a mut self,
        group: usize,
        lines: usize,
        spare: &'a mut [F32x16],
    ) -> Self::Group<'a>;
}

/// Memory that one group is written to.
pub(crate) trait Target {
    /// The memory in which the joints are computed, where children find their parents, and the memory to prefetch meanwhile.
    /// `models` is the thread's own memory.
    fn computed_in<'a, P: JointMath>(
        &'a mut self,
        models: &'a mut [P::Model],
    ) -> (&'a mut [P::Model], Ahead<'a>);

    /// Writes all joints, unless they were computed in place. `models` has [`JointMath::SPARE`] more than `joints`.
    fn write<L: Lanes, P: JointMath>(self, joints: usize, models: &[P::Model]);
}

/// Memory that is written some joints later.
#[derive(Clone, Copy)]
pub(crate) enum Ahead<'a> {
    /// No prefetching is needed.
    Nothing,
    /// Rows one after the other.
    Following(&'a [F32x16]),
    Scattered(&'a RowLines<'a>),
}

/// Memory for [`Layout::Blocks`], written through the caches. Joints are computed in it.
pub(crate) struct InPlace<'a>(pub(crate) &'a mut [F32x16]);

/// Memory for [`Layout::Blocks`] past the caches, and for [`Layout::Rows`]. Joints are copied to it.
pub(crate) struct Copied<'a> {
    pub(crate) lines: &'a mut [F32x16],
    pub(crate) output: Output,
}

/// Memory for [`Layout::Instances`]: a row for each lane, anywhere in the output.
pub(crate) struct Scattered<'a> {
    pub(crate) rows: RowSet<'a>,
    pub(crate) is_streamed: bool,
}

/// The sixteen rows of a group in [`Layout::Instances`].
pub(crate) struct ScatteredGroup<'a> {
    rows: RowLines<'a>,
    is_streamed: bool,
}

/// The memory of one group, if each has `lines` `F32x16`s.
#[inline(always)]
fn lines_of(all: &mut [F32x16], group: usize, lines: usize) -> &mut [F32x16] {
    &mut all[group * lines..][..lines]
}

impl RunTarget for InPlace<'_> {
    type Group<'a>
        = InPlace<'a>
    where
        Self: 'a;

    const HAS_ROWS: bool = false;

    #[inline(always)]
    fn group<'a>(&'a mut self, group: usize, lines: usize, _: &'a mut [F32x16]) -> InPlace<'a> {
        InPlace(lines_of(self.0, group, lines))
    }
}

impl RunTarget for Copied<'_> {
    type Group<'a>
        = Copied<'a>
    where
        Self: 'a;

    const HAS_ROWS: bool = true;

    #[inline(always)]
    fn group<'a>(&'a mut self, group: usize, lines: usize, _: &'a mut [F32x16]) -> Copied<'a> {
        Copied {
            lines: lines_of(self.lines, group, lines),
            output: self.output,
        }
    }
}

impl RunTarget for Scattered<'_> {
    type Group<'a>
        = ScatteredGroup<'a>
    where
        Self: 'a;

    const HAS_ROWS: bool = true;

    #[inline(always)]
    fn group<'a>(
        &'a mut self,
        group: usize,
        _: usize,
        spare: &'a mut [F32x16],
    ) -> ScatteredGroup<'a> {
        ScatteredGroup {
            rows: self.rows.sixteen(group * F32x16::LANES, spare),
            is_streamed: self.is_streamed,
        }
    }
}

impl Target for InPlace<'_> {
    #[inline(always)]
    fn computed_in<'a, P: JointMath>(
        &'a mut self,
        _: &'a mut [P::Model],
    ) -> (&'a mut [P::Model], Ahead<'a>) {
        (bytemuck::cast_slice_mut(self.0), Ahead::Nothing)
    }

    #[inline(always)]
    fn write<L: Lanes, P: JointMath>(self, _: usize, _: &[P::Model]) {}
}

/// Prefetching distance, in turns. A turn is the smallest number of joints that fill whole `F32x16`s in a row. Each joint of
/// a turn prefetches its share of the sixteen rows, for the turn this far ahead: hardware does not predict sixteen rows that
/// are written side by side.
const FURTHER: usize = 2;

impl Ahead<'_> {
    /// Prefetches the memory that is written after a joint, which is one of `joints`.
    #[inline(always)]
    pub(crate) fn prefetch<P: JointMath>(self, joint: usize, joints: usize) {
        let (of_turn, row) = (turn_joints(P::ROW), row_lines(P::ROW, joints));
        let share = F32x16::LANES / of_turn;
        let (mut first, mut line) = (0, (joint / of_turn + FURTHER) * turn_lines(P::ROW));
        match self {
            Self::Nothing => {}
            Self::Following(lines) => {
                if line >= row {
                    // The rows of the next sixteen.
                    line -= row;
                    first = F32x16::LANES;
                }
                let mut start = (first + joint % of_turn * share) * row + line;
                for _ in 0..share {
                    for line in 0..turn_lines(P::ROW) {
                        prefetch_for_write(lines, start + line);
                    }
                    start += row;
                }
            }
            Self::Scattered(_) if line >= row => {}
            Self::Scattered(rows) => {
                let first = joint % of_turn * share;
                for row in first..first + share {
                    for line in line..line + turn_lines(P::ROW) {
                        rows.prefetch(row, line);
                    }
                }
            }
        }
    }
}

impl Target for Copied<'_> {
    #[inline(always)]
    fn computed_in<'a, P: JointMath>(
        &'a mut self,
        models: &'a mut [P::Model],
    ) -> (&'a mut [P::Model], Ahead<'a>) {
        let ahead = match (self.output.layout, self.output.write) {
            (Layout::Blocks, _) | (_, WriteMode::Streamed) => Ahead::Nothing,
            _ => Ahead::Following(self.lines),
        };
        (models, ahead)
    }

    #[inline(always)]
    fn write<L: Lanes, P: JointMath>(self, joints: usize, models: &[P::Model]) {
        let Self { lines, output } = self;
        if output.layout == Layout::Blocks {
            L::apart(WriteBlocks::<P> { models, lines });
            return;
        }
        let row = row_lines(P::ROW, joints);
        L::apart(WriteRows::<P, _> {
            joints,
            models,
            is_streamed: output.write == WriteMode::Streamed,
            rows: Following { lines, row },
        });
    }
}

impl Target for ScatteredGroup<'_> {
    #[inline(always)]
    fn computed_in<'a, P: JointMath>(
        &'a mut self,
        models: &'a mut [P::Model],
    ) -> (&'a mut [P::Model], Ahead<'a>) {
        let ahead = match self.is_streamed {
            true => Ahead::Nothing,
            false => Ahead::Scattered(&self.rows),
        };
        (models, ahead)
    }

    #[inline(always)]
    fn write<L: Lanes, P: JointMath>(self, joints: usize, models: &[P::Model]) {
        L::apart(WriteRows::<P, _> {
            joints,
            models,
            is_streamed: self.is_streamed,
            rows: self.rows,
        });
    }
}

/// Copies joints as blocks, past the caches.
struct WriteBlocks<'a, P: JointMath> {
    models: &'a [P::Model],
    lines: &'a mut [F32x16],
}

impl<L: Lanes, P: JointMath> Apart<L> for WriteBlocks<'_, P> {
    #[inline(always)]
    fn run(self) {
        let lines = self.lines.chunks_exact_mut(P::NUMBERS);
        for (model, to) in self.models.iter().zip(lines) {
            for (from, to) in model.as_ref().iter().zip(to) {
                for part in 0..L::PARTS {
                    L::load(from, part).stream(to, part);
                }
            }
        }
    }
}

/// Sixteen rows that are written side by side.
trait Rows {
    /// The `F32x16` at `index` of each row.
    fn lines(&mut self, index: usize) -> impl Sixteen;
}

/// Rows one after the other, of `row` `F32x16`s each.
struct Following<'a> {
    lines: &'a mut [F32x16],
    row: usize,
}

impl Rows for Following<'_> {
    #[inline(always)]
    fn lines(&mut self, index: usize) -> impl Sixteen {
        StridedLines::new(&mut self.lines[index..], self.row)
    }
}

impl Rows for RowLines<'_> {
    #[inline(always)]
    fn lines(&mut self, index: usize) -> impl Sixteen {
        RowsAt { rows: self, index }
    }
}

/// The `F32x16` at one index of each of sixteen rows.
struct RowsAt<'a, 'b> {
    rows: &'a mut RowLines<'b>,
    index: usize,
}

impl Sixteen for RowsAt<'_, '_> {
    #[inline(always)]
    fn line(&mut self, row: usize) -> &mut F32x16 {
        self.rows.line(row, self.index)
    }
}

/// Transposes joints to rows.
struct WriteRows<'a, P: JointMath, R> {
    joints: usize,
    /// Joints to write, followed by [`JointMath::SPARE`] others.
    models: &'a [P::Model],
    is_streamed: bool,
    rows: R,
}

impl<L: Lanes, P: JointMath, R: Rows> Apart<L> for WriteRows<'_, P, R> {
    #[inline(always)]
    fn run(self) {
        let Self {
            joints,
            models,
            is_streamed,
            mut rows,
        } = self;
        for line in 0..(joints * P::ROW).div_ceil(F32x16::LANES) {
            let numbers = line_numbers::<P>(models, line);
            let mut to = rows.lines(line);
            for part in 0..L::PARTS {
                L::transpose(numbers, PartWrite { part, is_streamed }, &mut to);
            }
        }
    }
}

/// The sixteen values in one `F32x16` of a row, each for sixteen characters.
#[inline(always)]
fn line_numbers<P: JointMath>(models: &[P::Model], line: usize) -> [&F32x16; F32x16::LANES] {
    let mut numbers = [&F32x16::ZERO; F32x16::LANES];
    if P::ROW == P::NUMBERS {
        let models: &[F32x16] = bytemuck::cast_slice(models);
        let models = &models[line * F32x16::LANES..][..F32x16::LANES];
        for index in 0..F32x16::LANES {
            numbers[index] = &models[index];
        }
        return numbers;
    }
    let joints = const { F32x16::LANES / P::ROW };
    let models = &models[line * joints..][..joints];
    for joint in 0..joints {
        for number in 0..P::NUMBERS {
            numbers[joint * P::ROW + number] = &models[joint].as_ref()[number];
        }
    }
    numbers
}
