//! Distances of chosen pairs of windows, along the diagonals of a distance map.
//!
//! Windows on one diagonal share the products of their frames, as in [`DistanceMap`](crate::graph::search::distance::DistanceMap). The sums are added in
//! the order of that map, so that each distance has the same bits.

use crate::graph::search::distance::SUMS;
use crate::graph::search::features::WindowCell;
use crate::graph::search::windows::{TILE, Windows};
use crate::math::Isa;
use std::ops::Range;

/// Computes distances along diagonals, for a strip of the first cloud's windows.
#[derive(Debug, Default)]
pub(crate) struct Diagonals {
    /// Frames of the first cloud that the strip's windows cover.
    frames: Range<usize>,
    /// Length of a row: the strip's frames, and [`TILE`] more on both sides.
    width: usize,
    /// Weighted coordinates of the first cloud, `[joint][x, y, z][frame]`.
    weighted: Vec<f32>,
    /// Products of the frames of a diagonal, by frame of the first cloud.
    products: [Vec<f32>; SUMS],
    /// Sums of the products from a frame to the end of its block.
    early: [Vec<f64>; SUMS],
    /// Sums of the products from the start of a frame's block to the frame.
    late: [Vec<f64>; SUMS],
}

impl Diagonals {
    /// Copies the points of the windows `rows` of `a`.
    fn load(&mut self, a: &Windows, rows: Range<usize>) {
        let frames = rows.start..(rows.end + a.window() - 1).min(a.frames);
        let joints = a.weights.len();
        self.width = frames.len() + 2 * TILE;
        self.weighted.clear();
        self.weighted.resize(3 * joints * self.width, 0.0);
        for frame in frames.clone() {
            let at = frame - frames.start + TILE;
            for (joint, point) in a.weighted(frame).iter().enumerate() {
                for (axis, &value) in point.iter().enumerate() {
                    self.weighted[(3 * joint + axis) * self.width + at] = value;
                }
            }
        }
        for row in &mut self.products {
            row.resize(self.width, 0.0);
        }
        for row in self.early.iter_mut().chain(&mut self.late) {
            row.resize(self.width, 0.0);
        }
        self.frames = frames;
    }

    /// Calls `found` with each of the pairs `near` of windows of two clouds and their squared distance, in square metres. The windows of the
    /// first cloud lie in `rows`. Sorts the pairs by diagonal and row.
    pub(crate) fn for_each(
        &mut self,
        windows: [&Windows; 2],
        isa: Isa,
        rows: Range<usize>,
        near: &mut [WindowCell],
        mut found: impl FnMut((WindowCell, f32)),
    ) {
        let [a, b] = windows;
        self.load(a, rows);
        near.sort_unstable_by_key(|cell| (cell.column.wrapping_sub(cell.row), cell.row));
        let window = a.window();
        // A run of pairs on one diagonal whose windows touch.
        let is_run = |x: &WindowCell, y: &WindowCell| {
            x.column + y.row == y.column + x.row && (y.row - x.row) as usize <= window
        };
        for run in near.chunk_by(is_run) {
            let shift = run[0].column as isize - run[0].row as isize;
            let (first, last) = (run[0].row as usize, run[run.len() - 1].row as usize);
            let frames = first..last + window;
            isa.run(
                #[inline(always)]
                || match isa {
                    Isa::Avx512 => self.multiply::<TILE>(b, frames.clone(), shift),
                    _ => self.multiply::<{ TILE / 2 }>(b, frames.clone(), shift),
                },
            );
            self.sum(frames, window);
            for &cell in run {
                found((cell, self.squared(windows, cell)));
            }
        }
    }

    #[inline(always)]
    fn index(&self, frame: usize) -> usize {
        frame + TILE - self.frames.start
    }

    /// Computes the products of `frames` with those of the second cloud, by the tiles of the second.
    #[inline(always)]
    fn multiply<const L: usize>(&mut self, b: &Windows, frames: Range<usize>, shift: isize) {
        let beside = |frame: usize| (frame as isize + shift) as usize;
        let tiles = beside(frames.start) / TILE..beside(frames.end - 1) / TILE + 1;
        for tile in tiles {
            let points = b.tile(tile);
            // The first lane's frame may lie before the strip, by less than a tile.
            let frame = (tile * TILE) as isize - shift;
            let at = (frame + TILE as isize - self.frames.start as isize) as usize;
            for part in 0..TILE / L {
                let at = at + part * L;
                let mut sums = [[0.0f32; L]; SUMS];
                for (joint, [x, y, z]) in points.iter().enumerate() {
                    let x = &x.as_chunks::<L>().0[part];
                    let y = &y.as_chunks::<L>().0[part];
                    let z = &z.as_chunks::<L>().0[part];
                    let row = 3 * joint * self.width + at;
                    let px = &self.weighted[row..row + L];
                    let py = &self.weighted[row + self.width..row + self.width + L];
                    let pz = &self.weighted[row + 2 * self.width..row + 2 * self.width + L];
                    let [heights, dot, cross] = &mut sums;
                    for lane in 0..L {
                        heights[lane] += py[lane] * y[lane];
                        dot[lane] += px[lane] * x[lane] + pz[lane] * z[lane];
                        cross[lane] += px[lane] * z[lane] - pz[lane] * x[lane];
                    }
                }
                for (row, sums) in self.products.iter_mut().zip(&sums) {
                    row[at..at + L].copy_from_slice(sums);
                }
            }
        }
    }

    /// Sums the products within each block of `window` frames, forwards and backwards.
    fn sum(&mut self, frames: Range<usize>, window: usize) {
        let first = self.index(frames.start);
        let count = frames.len();
        for sum in 0..SUMS {
            let products = &self.products[sum][first..first + count];
            let late = &mut self.late[sum][first..first + count];
            let early = &mut self.early[sum][first..first + count];
            let mut phase = frames.start % window;
            let mut so_far = 0.0;
            for (late, &product) in late.iter_mut().zip(products) {
                so_far = match phase {
                    0 => f64::from(product),
                    _ => so_far + f64::from(product),
                };
                *late = so_far;
                phase = if phase + 1 == window { 0 } else { phase + 1 };
            }
            let mut phase = frames.end % window;
            let mut after = 0.0;
            for (early, &product) in early.iter_mut().zip(products).rev() {
                after = match phase {
                    0 => f64::from(product),
                    _ => after + f64::from(product),
                };
                *early = after;
                phase = phase.checked_sub(1).unwrap_or(window - 1);
            }
        }
    }

    fn squared(&self, [a, b]: [&Windows; 2], cell: WindowCell) -> f32 {
        let window = a.window();
        let (row, column) = (cell.row as usize, cell.column as usize);
        let (first, last) = (self.index(row), self.index(row + window - 1));
        let scale = 1.0 / window as f64;
        let [heights, dot, cross] = std::array::from_fn(|sum| {
            let early = match row.is_multiple_of(window) {
                true => 0.0,
                false => self.early[sum][first],
            };
            scale * (early + self.late[sum][last])
        });
        let ([ax, az], [bx, bz]) = (a.ground_mean(row), b.ground_mean(column));
        let dot = dot - (ax * bx + az * bz);
        let cross = cross - (ax * bz - az * bx);
        // The subtraction above has already lost precision, so an f32 square root is accurate
        // enough. It is also faster.
        let turned = ((dot * dot + cross * cross) as f32).sqrt();
        let still = (a.spread[row] + b.spread[column] - 2.0 * heights) as f32;
        (still - 2.0 * turned).max(0.0)
    }
}
