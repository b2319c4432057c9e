//! Writes a group's joints to the output. Each kind of target has kernels of its own, so that it does not slow down the
//! others.

use super::joint_math::{Model, NUMBERS};
use crate::crowd::output::{TURN_JOINTS, TURN_LINES, row_lines};
use crate::math::{Apart, F32x16, Lanes, PartWrite, RowLines, RowSet, Sixteen};

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
    /// The memory in which the joints are computed, where children find their parents, and the rows to prefetch meanwhile.
    /// `models` is the thread's own memory.
    fn computed_in<'a>(
        &'a mut self,
        models: &'a mut [Model],
    ) -> (&'a mut [Model], Option<&'a RowLines<'a>>);

    /// Writes all joints, unless they were computed in place. `models` has [`SPARE`](super::joint_math::SPARE) more than `joints`.
    fn write<L: Lanes>(self, joints: usize, models: &[Model]);
}

/// Memory for [`Layout::Blocks`], written through the caches. Joints are computed in it.
pub(crate) struct InPlace<'a>(pub(crate) &'a mut [F32x16]);

/// Memory for [`Layout::Blocks`] past the caches. Joints are copied to it.
pub(crate) struct Copied<'a>(pub(crate) &'a mut [F32x16]);

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

    const HAS_ROWS: bool = false;

    #[inline(always)]
    fn group<'a>(&'a mut self, group: usize, lines: usize, _: &'a mut [F32x16]) -> Copied<'a> {
        Copied(lines_of(self.0, group, lines))
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
    fn computed_in<'a>(
        &'a mut self,
        _: &'a mut [Model],
    ) -> (&'a mut [Model], Option<&'a RowLines<'a>>) {
        (bytemuck::cast_slice_mut(self.0), None)
    }

    #[inline(always)]
    fn write<L: Lanes>(self, _: usize, _: &[Model]) {}
}

/// Prefetching distance, in turns. A turn is the smallest number of joints that fill whole `F32x16`s in a row. Each joint of
/// a turn prefetches its share of the sixteen rows, for the turn this far ahead: hardware does not predict sixteen rows that
/// are written side by side.
const FURTHER: usize = 2;

/// Prefetches the part of rows that is written after a joint, which is one of `joints`.
#[inline(always)]
pub(crate) fn prefetch_ahead(rows: &RowLines<'_>, joint: usize, joints: usize) {
    const SHARE: usize = F32x16::LANES / TURN_JOINTS;
    let line = (joint / TURN_JOINTS + FURTHER) * TURN_LINES;
    if line >= row_lines(joints) {
        return;
    }
    let first = joint % TURN_JOINTS * SHARE;
    for row in first..first + SHARE {
        for line in line..line + TURN_LINES {
            rows.prefetch(row, line);
        }
    }
}

impl Target for Copied<'_> {
    #[inline(always)]
    fn computed_in<'a>(
        &'a mut self,
        models: &'a mut [Model],
    ) -> (&'a mut [Model], Option<&'a RowLines<'a>>) {
        (models, None)
    }

    #[inline(always)]
    fn write<L: Lanes>(self, _: usize, models: &[Model]) {
        L::apart(WriteBlocks {
            models,
            lines: self.0,
        });
    }
}

impl Target for ScatteredGroup<'_> {
    #[inline(always)]
    fn computed_in<'a>(
        &'a mut self,
        models: &'a mut [Model],
    ) -> (&'a mut [Model], Option<&'a RowLines<'a>>) {
        let ahead = match self.is_streamed {
            true => None,
            false => Some(&self.rows),
        };
        (models, ahead)
    }

    #[inline(always)]
    fn write<L: Lanes>(self, joints: usize, models: &[Model]) {
        L::apart(WriteRows {
            joints,
            models,
            is_streamed: self.is_streamed,
            rows: self.rows,
        });
    }
}

/// Copies joints as blocks, past the caches.
struct WriteBlocks<'a> {
    models: &'a [Model],
    lines: &'a mut [F32x16],
}

impl<L: Lanes> Apart<L> for WriteBlocks<'_> {
    #[inline(always)]
    fn run(self) {
        let lines = self.lines.chunks_exact_mut(NUMBERS);
        for (model, to) in self.models.iter().zip(lines) {
            for (from, to) in model.iter().zip(to) {
                for part in 0..L::PARTS {
                    L::load(from, part).stream(to, part);
                }
            }
        }
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
struct WriteRows<'a> {
    joints: usize,
    /// Joints to write, followed by [`SPARE`](super::joint_math::SPARE) others.
    models: &'a [Model],
    is_streamed: bool,
    rows: RowLines<'a>,
}

impl<L: Lanes> Apart<L> for WriteRows<'_> {
    #[inline(always)]
    fn run(self) {
        let Self {
            joints,
            models,
            is_streamed,
            mut rows,
        } = self;
        for line in 0..(joints * NUMBERS).div_ceil(F32x16::LANES) {
            let numbers = line_numbers(models, line);
            let mut to = RowsAt {
                rows: &mut rows,
                index: line,
            };
            for part in 0..L::PARTS {
                L::transpose(numbers, PartWrite { part, is_streamed }, &mut to);
            }
        }
    }
}

/// The sixteen values in one `F32x16` of a row, each for sixteen characters.
#[inline(always)]
fn line_numbers(models: &[Model], line: usize) -> [&F32x16; F32x16::LANES] {
    let mut numbers = [&F32x16::ZERO; F32x16::LANES];
    let models: &[F32x16] = bytemuck::cast_slice(models);
    let models = &models[line * F32x16::LANES..][..F32x16::LANES];
    for index in 0..F32x16::LANES {
        numbers[index] = &models[index];
    }
    numbers
}
