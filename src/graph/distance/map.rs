//! Computes a distance map row by row.
//!
//! The sum of a pair of windows runs along a diagonal. Rows of frame pairs are grouped into blocks
//! as long as a window, so that each window ends in one block and starts in the same or the
//! previous block. Its sum is a suffix sum of the earlier block plus a prefix sum of the later
//! block. Both take one addition for each row, in f64. Nothing is ever subtracted, so rounding
//! errors do not grow with the clip's length. (This is the sliding maximum of van Herk, 1992, and
//! Gil & Werman, 1993, applied to sums.)

use std::ops::Range;

use super::Windows;
use super::kernel::{self, ROWS, SUMS, WindowRow};
use super::windows::TILE;
use crate::math::Isa;

/// The distances between all windows of two clouds.
#[derive(Clone, Copy, Debug)]
pub struct DistanceMap<'a> {
    a: &'a Windows,
    b: &'a Windows,
    isa: Isa,
}

impl<'a> DistanceMap<'a> {
    /// Creates the map of the windows of `a` and `b`.
    ///
    /// # Panics
    /// Panics if the clouds have different numbers of points or the windows different lengths.
    #[must_use]
    pub fn new(a: &'a Windows, b: &'a Windows) -> Self {
        assert!(a.fits(b), "windows of one length, clouds of one skeleton");
        let isa = Isa::best();
        Self { a, b, isa }
    }

    /// Selects an instruction set instead of the best one of the machine. All instruction sets give
    /// bit-identical results.
    #[must_use]
    pub fn with_isa(self, isa: Isa) -> Self {
        Self { isa, ..self }
    }

    /// Calls `row(i, d)` for each window of `a` in order, where `d[j]` is the squared distance (in
    /// m²) between the frames `i..i + window` of `a` and `j..j + window` of `b`. If a clip is
    /// shorter than the window, `row` is never called.
    pub fn for_each_row(self, row: impl FnMut(usize, &[f32])) {
        self.for_each_row_of(0..self.a.count(), row);
    }

    /// Calls `row` for the windows `rows` of `a` only. The distances are the same, to the bit, as
    /// those of the whole map. Windows after the last one are ignored.
    pub fn for_each_row_of(self, rows: Range<usize>, mut row: impl FnMut(usize, &[f32])) {
        let Self { a, b, isa } = self;
        let wanted = rows.start..rows.end.min(a.count());
        if wanted.is_empty() || b.count() == 0 {
            return;
        }
        let window = a.window();
        // A window lies in the block of its first frame and in the next one. Sums of earlier blocks
        // are not needed.
        let first_block = wanted.start / window * window;
        let mut sums = Sums::new(a, b);
        let mut squared = vec![0.0; b.count()];
        for block in (first_block..a.frames().min(wanted.end + window)).step_by(window) {
            let rows = window.min(a.frames() - block);
            for first in (0..rows).step_by(ROWS) {
                let phases = first..(first + ROWS).min(rows);
                match isa {
                    Isa::Avx512 => isa.run(
                        #[inline(always)]
                        || sums.multiply::<TILE>(block, phases),
                    ),
                    _ => isa.run(
                        #[inline(always)]
                        || sums.multiply::<{ TILE / 2 }>(block, phases),
                    ),
                }
            }
            for phase in 0..rows {
                isa.run(
                    #[inline(always)]
                    || sums.run_up(phase),
                );
                let start = (block + phase + 1).checked_sub(window);
                if let Some(start) = start.filter(|start| wanted.contains(start)) {
                    isa.run(
                        #[inline(always)]
                        || sums.squared(start, phase, &mut squared),
                    );
                    row(start, &squared);
                }
            }
            isa.run(
                #[inline(always)]
                || sums.next_block(),
            );
        }
    }
}

/// Rows of sums over frame pairs: heights, dot, cross. Row `phase` of a block stores the pair with
/// frame `column` of `b` at index `column + window - 1 - phase`, so that all pairs of a diagonal
/// have the same index. All other entries are 0 or unused.
struct Block<T> {
    length: usize,
    sums: [Vec<T>; SUMS],
}

impl<T: Copy + Default> Block<T> {
    fn new(rows: usize, length: usize) -> Self {
        let sums = [0; SUMS].map(|_| vec![T::default(); rows * length]);
        Self { length, sums }
    }

    #[inline(always)]
    fn row(&self, sum: usize, phase: usize) -> &[T] {
        &self.sums[sum][phase * self.length..(phase + 1) * self.length]
    }
}

/// Sums for the rows of a map.
struct Sums<'a> {
    a: &'a Windows,
    b: &'a Windows,
    /// Sums of each row of the current block.
    block: Block<f32>,
    /// Suffix sums of the previous block: each row plus all later rows.
    before: Block<f64>,
    /// Prefix sum of the current block's rows.
    so_far: Block<f64>,
    /// Zeros, used as the earlier part of windows that lie in one block.
    nothing: Vec<f64>,
}

impl<'a> Sums<'a> {
    fn new(a: &'a Windows, b: &'a Windows) -> Self {
        let window = a.window();
        // Up to the end of the last tile, shifted by the largest phase.
        let length = b.frames().next_multiple_of(TILE) + window - 1;
        Self {
            a,
            b,
            block: Block::new(window, length),
            before: Block::new(window, length),
            so_far: Block::new(1, length),
            nothing: vec![0.0; b.count()],
        }
    }

    /// Computes sums over the joints for the rows `phases` of the block that starts at frame
    /// `block` of `a`.
    #[inline(always)]
    fn multiply<const L: usize>(&mut self, block: usize, phases: Range<usize>) {
        match phases.len() {
            4 => self.multiply_rows::<4, L>(block, phases.start),
            3 => self.multiply_rows::<3, L>(block, phases.start),
            2 => self.multiply_rows::<2, L>(block, phases.start),
            _ => self.multiply_rows::<1, L>(block, phases.start),
        }
    }

    #[inline(always)]
    fn multiply_rows<const R: usize, const L: usize>(&mut self, block: usize, phase: usize) {
        let a = self.a;
        let frames: [&[[f32; 3]]; R] = std::array::from_fn(|row| a.weighted(block + phase + row));
        let length = self.block.length;
        let shift = self.a.window() - 1;
        for (tile, points) in self.b.tiles().enumerate() {
            for part in 0..TILE / L {
                let sums = kernel::products::<R, L>(&frames, points, part);
                for (row, sums) in sums.iter().enumerate() {
                    let phase = phase + row;
                    let at = phase * length + shift - phase + tile * TILE + part * L;
                    for (out, sums) in self.block.sums.iter_mut().zip(sums) {
                        out[at..at + L].copy_from_slice(sums);
                    }
                }
            }
        }
    }

    /// Range of indices in a block's row that hold pairs of frames.
    #[inline(always)]
    fn written(&self, phase: usize) -> Range<usize> {
        let shift = self.a.window() - 1;
        shift - phase..self.block.length - phase
    }

    /// Adds the next row of the block to the prefix sum.
    #[inline(always)]
    fn run_up(&mut self, phase: usize) {
        let written = self.written(phase);
        for sum in 0..SUMS {
            let so_far = &mut self.so_far.sums[sum][written.clone()];
            let row = &self.block.row(sum, phase)[written.clone()];
            if phase == 0 {
                kernel::copy(so_far, row);
            } else {
                kernel::add(so_far, row);
            }
        }
    }

    /// Computes the squared distances of the window of `a` that starts at frame `start` and ends in
    /// row `phase` of the block.
    #[inline(always)]
    fn squared(&self, start: usize, phase: usize, out: &mut [f32]) {
        let (window, count) = (self.a.window(), out.len());
        // A window that starts at column 0 ends at column window - 1 of this row.
        let end = 2 * (window - 1) - phase;
        let late = std::array::from_fn(|sum| &self.so_far.sums[sum][end..end + count]);
        // In the next block, the same diagonal has an index that is larger by one window.
        let early = std::array::from_fn(|sum| match end.checked_sub(window) {
            Some(end) if phase + 1 < window => &self.before.row(sum, phase + 1)[end..end + count],
            _ => &self.nothing[..],
        });
        WindowRow {
            scale: 1.0 / window as f64,
            mean: [self.a.x[start], self.a.z[start]],
            spread: self.a.spread[start],
            x: &self.b.x,
            z: &self.b.z,
            spreads: &self.b.spread,
            early,
            late,
        }
        .squared(out);
    }

    /// Turns the current block into the previous block.
    #[inline(always)]
    fn next_block(&mut self) {
        let (window, length) = (self.a.window(), self.before.length);
        for phase in (0..window).rev() {
            let written = self.written(phase);
            for sum in 0..SUMS {
                let row = &self.block.row(sum, phase)[written.clone()];
                let (rows, after) = self.before.sums[sum].split_at_mut((phase + 1) * length);
                let out = &mut rows[phase * length..][written.clone()];
                kernel::copy(out, row);
                // The last pair has no successor on its diagonal, and the last row has no
                // successor.
                if let Some(after) = after.get(written.start..written.end - 1) {
                    kernel::add(out, after);
                }
            }
        }
    }
}
