//! Writes a group's joints to the output.

use super::joint_math::{Model, NUMBERS};
use crate::crowd::output::{TURN_JOINTS, TURN_LINES, WriteMode, row_lines};
use crate::math::{F32x16, Lanes, RowLines, RowSet};

/// Memory that the groups of a run are written to.
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

    /// The memory of one group, which has `lines` `F32x16`s. `spare` receives the rows of unused lanes.
    #[inline(always)]
    pub(crate) fn group<'a>(
        &'a mut self,
        group: usize,
        lines: usize,
        spare: &'a mut [F32x16],
    ) -> GroupMemory<'a> {
        match self {
            Self::Lines(all) => GroupMemory::Lines(&mut all[group * lines..][..lines]),
            Self::Rows(rows) => GroupMemory::Rows(rows.sixteen(group * F32x16::LANES, spare)),
        }
    }
}

pub(crate) enum GroupMemory<'a> {
    Lines(&'a mut [F32x16]),
    Rows(RowLines<'a>),
}

impl GroupMemory<'_> {
    /// The memory in which the joints are computed, where children find their parents, and the rows to prefetch meanwhile.
    /// `models` is the thread's own memory.
    #[inline(always)]
    pub(crate) fn computed_in<'a>(
        &'a mut self,
        mode: WriteMode,
        models: &'a mut [Model],
    ) -> (&'a mut [Model], Option<&'a RowLines<'a>>) {
        match (self, mode) {
            (Self::Lines(lines), WriteMode::Cached) => (bytemuck::cast_slice_mut(lines), None),
            (Self::Rows(rows), WriteMode::Cached) => (models, Some(rows)),
            (_, WriteMode::Streamed) => (models, None),
        }
    }

    /// Writes all joints, unless they were computed in place. `models` has [`SPARE`](super::joint_math::SPARE) more than `joints`.
    #[inline(always)]
    pub(crate) fn write<L: Lanes>(self, mode: WriteMode, joints: usize, models: &[Model]) {
        match (self, mode) {
            (Self::Lines(_), WriteMode::Cached) => {}
            (Self::Lines(lines), WriteMode::Streamed) => L::apart(
                #[inline(always)]
                || stream_blocks::<L>(models, lines),
            ),
            (Self::Rows(mut rows), mode) => L::apart(
                #[inline(always)]
                || write_rows::<L>(mode, joints, models, &mut rows),
            ),
        }
    }
}

/// Copies joints as blocks, past the caches.
#[inline(always)]
fn stream_blocks<L: Lanes>(models: &[Model], lines: &mut [F32x16]) {
    for (model, to) in models.iter().zip(lines.chunks_exact_mut(NUMBERS)) {
        for (from, to) in model.iter().zip(to) {
            for part in 0..L::PARTS {
                L::load(from, part).stream(to, part);
            }
        }
    }
}

#[inline(always)]
fn write_rows<L: Lanes>(mode: WriteMode, joints: usize, models: &[Model], rows: &mut RowLines<'_>) {
    for line in 0..(joints * NUMBERS).div_ceil(F32x16::LANES) {
        let numbers = line_numbers(models, line);
        for part in 0..L::PARTS {
            L::transpose(numbers, part, rows, line, mode == WriteMode::Streamed);
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
