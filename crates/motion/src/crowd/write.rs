//! Where a group's joints go in the output. Each kind of place has kernels of its own: what one of them needs costs the others
//! nothing.

use super::joint_math::JointMath;
use super::output::{Layout, Output, WriteMode, row_lines, turn_joints, turn_lines};
use crate::math::{
    Apart, F32x16, Lanes, PartWrite, RowLines, RowSet, Sixteen, StridedLines, prefetch_for_write,
};

/// Where the groups of a run go.
pub(super) trait RunTarget {
    type Group<'a>: Target
    where
        Self: 'a;

    /// Whether rows may be written, which end with joints that there are not.
    const HAS_ROWS: bool;

    /// Where a group of so many lines goes. `spare` takes the rows of lanes that nobody uses.
    fn group<'a>(
        &'a mut self,
        group: usize,
        lines: usize,
        spare: &'a mut [F32x16],
    ) -> Self::Group<'a>;
}

/// Where a group goes.
pub(super) trait Target {
    /// Where the joints are computed, which is where children find their parents, and what is asked for meanwhile. `models` is memory of
    /// the thread's own.
    fn computed_in<'a, P: JointMath>(
        &'a mut self,
        models: &'a mut [P::Model],
    ) -> (&'a mut [P::Model], Ahead<'a>);

    /// Writes all joints, where they are not in place. `models` has [`JointMath::SPARE`] more than `joints`.
    fn write<L: Lanes, P: JointMath>(self, joints: usize, models: &[P::Model]);
}

/// Lines that are written some joints later.
#[derive(Clone, Copy)]
pub(super) enum Ahead<'a> {
    /// They need not be asked for.
    Nothing,
    /// Rows that follow each other.
    Following(&'a [F32x16]),
    Scattered(&'a RowLines<'a>),
}

/// [`Layout::Blocks`] through the caches.
pub(super) struct InPlace<'a>(pub(super) &'a mut [F32x16]);

/// Other lines that follow each other, as the output says: blocks past the caches, and [`Layout::Rows`].
pub(super) struct Copied<'a> {
    pub(super) lines: &'a mut [F32x16],
    pub(super) output: Output,
}

/// [`Layout::Instances`]: a row of its own for each lane.
pub(super) struct Scattered<'a> {
    pub(super) rows: RowSet<'a>,
    pub(super) is_streamed: bool,
}

/// Sixteen of these rows.
pub(super) struct ScatteredGroup<'a> {
    rows: RowLines<'a>,
    is_streamed: bool,
}

/// The lines of a group among those of all, so many each.
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

/// Turns from the one that is computed to the one whose lines are asked for. Some joints end on a whole line together, a turn;
/// each of them asks for the lines of its share of the rows. The machine does not foresee sixteen rows that are written side by
/// side.
const FURTHER: usize = 2;

impl Ahead<'_> {
    /// Asks for the lines of one of `joints`.
    #[inline(always)]
    pub(super) fn prefetch<P: JointMath>(self, joint: usize, joints: usize) {
        let (of_turn, row) = (turn_joints::<P>(), row_lines::<P>(joints));
        let share = F32x16::LANES / of_turn;
        let (mut first, mut line) = (0, (joint / of_turn + FURTHER) * turn_lines::<P>());
        match self {
            Self::Nothing => {}
            Self::Following(lines) => {
                if line >= row {
                    // The next group.
                    line -= row;
                    first = F32x16::LANES;
                }
                let mut start = (first + joint % of_turn * share) * row + line;
                for _ in 0..share {
                    for line in 0..turn_lines::<P>() {
                        prefetch_for_write(lines, start + line);
                    }
                    start += row;
                }
            }
            Self::Scattered(_) if line >= row => {}
            Self::Scattered(rows) => {
                let first = joint % of_turn * share;
                for row in first..first + share {
                    for line in line..line + turn_lines::<P>() {
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
        let row = row_lines::<P>(joints);
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

/// Joints that are written as blocks, past the caches.
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

/// Sixteen rows to write.
trait Rows {
    /// A line of each of them, from the first one on.
    fn lines(&mut self, index: usize) -> impl Sixteen;
}

/// Rows of so many lines that follow each other.
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

/// One line of each of sixteen rows that start anywhere.
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

/// Joints that are written as rows.
struct WriteRows<'a, P: JointMath, R> {
    joints: usize,
    /// Some more than there are joints.
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

/// The sixteen numbers of a line of a row.
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
