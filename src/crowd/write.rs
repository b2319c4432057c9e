//! Where a group's joints go in the output. Each kind of place has kernels of its own: what one of them needs costs the others
//! nothing.

use bytemuck::Zeroable;

use super::joint_math::JointMath;
use super::output::{Layout, Output, WriteMode, row_lines, turn_joints, turn_lines};
use crate::math::{F32x16, Lanes, RowLines, RowSet, StridedLines, prefetch_for_write};

/// Where the groups of a run go.
pub(super) trait RunTarget {
    type Group<'a>: Target
    where
        Self: 'a;

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
    /// The output itself, if it is where children find their parents.
    fn in_place(&mut self) -> Option<&mut [F32x16]>;

    /// Asks for lines that are written some joints later, one of `joints`.
    fn prefetch<P: JointMath>(&mut self, joint: usize, joints: usize);

    /// Writes all joints, where they are not in place.
    fn write<L: Lanes, P: JointMath>(self, models: &[P::Model]);
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

impl RunTarget for InPlace<'_> {
    type Group<'a>
        = InPlace<'a>
    where
        Self: 'a;

    #[inline(always)]
    fn group<'a>(&'a mut self, group: usize, lines: usize, _: &'a mut [F32x16]) -> InPlace<'a> {
        InPlace(&mut self.0[group * lines..][..lines])
    }
}

impl RunTarget for Copied<'_> {
    type Group<'a>
        = Copied<'a>
    where
        Self: 'a;

    #[inline(always)]
    fn group<'a>(&'a mut self, group: usize, lines: usize, _: &'a mut [F32x16]) -> Copied<'a> {
        Copied {
            lines: &mut self.lines[group * lines..][..lines],
            output: self.output,
        }
    }
}

impl RunTarget for Scattered<'_> {
    type Group<'a>
        = ScatteredGroup<'a>
    where
        Self: 'a;

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
    fn in_place(&mut self) -> Option<&mut [F32x16]> {
        Some(self.0)
    }

    #[inline(always)]
    fn prefetch<P: JointMath>(&mut self, _: usize, _: usize) {}

    #[inline(always)]
    fn write<L: Lanes, P: JointMath>(self, _: &[P::Model]) {}
}

/// Turns from the one that is computed to the one whose lines are asked for. Some joints end on a whole line together, a turn;
/// each of them asks for the lines of its share of the rows. The machine does not foresee sixteen rows that are written side by
/// side.
const FURTHER: usize = 2;

impl Target for Copied<'_> {
    #[inline(always)]
    fn in_place(&mut self) -> Option<&mut [F32x16]> {
        None
    }

    #[inline(always)]
    fn prefetch<P: JointMath>(&mut self, joint: usize, joints: usize) {
        if self.output.layout == Layout::Blocks || self.output.write == WriteMode::Streamed {
            return;
        }
        let (of_turn, row) = (turn_joints::<P>(), row_lines::<P>(joints));
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
                prefetch_for_write(self.lines, start + line);
            }
            start += row;
        }
    }

    #[inline(always)]
    fn write<L: Lanes, P: JointMath>(self, models: &[P::Model]) {
        let Self { lines, output } = self;
        if output.layout == Layout::Blocks {
            write_blocks::<L, P>(models, lines);
            return;
        }
        let row = row_lines::<P>(models.len());
        let is_streamed = output.write == WriteMode::Streamed;
        write_rows::<L, P>(models, Following { lines, row }, is_streamed);
    }
}

impl Target for ScatteredGroup<'_> {
    #[inline(always)]
    fn in_place(&mut self) -> Option<&mut [F32x16]> {
        None
    }

    #[inline(always)]
    fn prefetch<P: JointMath>(&mut self, joint: usize, joints: usize) {
        let of_turn = turn_joints::<P>();
        let line = (joint / of_turn + FURTHER) * turn_lines::<P>();
        if self.is_streamed || line >= row_lines::<P>(joints) {
            return;
        }
        let share = F32x16::LANES / of_turn;
        let first = joint % of_turn * share;
        for row in first..first + share {
            for line in line..line + turn_lines::<P>() {
                self.rows.prefetch(row, line);
            }
        }
    }

    #[inline(always)]
    fn write<L: Lanes, P: JointMath>(self, models: &[P::Model]) {
        write_rows::<L, P>(models, self.rows, self.is_streamed);
    }
}

#[inline(always)]
fn write_blocks<L: Lanes, P: JointMath>(models: &[P::Model], out: &mut [F32x16]) {
    for (model, to) in models.iter().zip(out.chunks_exact_mut(P::NUMBERS)) {
        for (from, to) in model.as_ref().iter().zip(to) {
            for part in 0..L::PARTS {
                L::load(from, part).stream(to, part);
            }
        }
    }
}

/// Sixteen rows to write.
trait Rows {
    /// A line of each of them, from the first one on.
    fn lines(&mut self, index: usize) -> impl Sixteen;
}

/// A line of each of sixteen rows.
trait Sixteen {
    fn line(&mut self, row: usize) -> &mut F32x16;
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

impl Sixteen for StridedLines<'_> {
    #[inline(always)]
    fn line(&mut self, row: usize) -> &mut F32x16 {
        self.line(row)
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

#[inline(always)]
fn write_rows<L: Lanes, P: JointMath>(models: &[P::Model], mut rows: impl Rows, is_streamed: bool) {
    const { assert!(turn_lines::<P>() + 1 == turn_joints::<P>()) };
    let rest = P::Model::zeroed();
    for (turn, models) in models.chunks(turn_joints::<P>()).enumerate() {
        for line in 0..turn_lines::<P>() {
            // A line has the numbers of two joints. Where the second one is missing, its part of the line is undefined.
            let Some(first) = models.get(line) else {
                break;
            };
            let pair = [first, models.get(line + 1).unwrap_or(&rest)];
            let to = rows.lines(turn * turn_lines::<P>() + line);
            match line {
                0 => write_line::<L, P, 0>(pair, to, is_streamed),
                1 => write_line::<L, P, 1>(pair, to, is_streamed),
                _ => write_line::<L, P, 2>(pair, to, is_streamed),
            }
        }
    }
}

/// Line `LINE` of a turn, of sixteen rows.
#[inline(always)]
fn write_line<L: Lanes, P: JointMath, const LINE: usize>(
    pair: [&P::Model; 2],
    mut to: impl Sixteen,
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
