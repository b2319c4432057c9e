//! The distance between windows of frames, for all pairs of windows of two clips.
//!
//! Source: Kovar, Gleicher & Pighin (2002), section 3.1. The distance is the weighted sum of
//! squared distances between two point clouds, minimised in closed form over a rotation about the
//! vertical axis and a translation on the ground. Differs: every term of the closed form is a sum
//! over the frames of the windows. Along a diagonal of the map, each term takes a few additions
//! regardless of the window's length. The result is the root of the mean, in metres.
//!
//! With weights w that sum to 1 over a window, points p of one window and q of the other, and
//! ground means p̄ and q̄:
//! ```text
//! dot   = Σ w (px qx + pz qz) - (p̄x q̄x + p̄z q̄z)
//! cross = Σ w (px qz - pz qx) - (p̄x q̄z - p̄z q̄x)
//! D²    = Σ w |p|² + Σ w |q|² - |p̄|² - |q̄|² - 2 Σ w py qy - 2 √(dot² + cross²)
//! θ     = atan2(cross, dot)
//! ```

use crate::graph::search::windows::{PointCloud, TILE, WindowSums, Windows};
use crate::math::{Isa, Rigid2};
use glam::Vec3;
use std::ops::Range;

#[derive(Clone, Copy, Debug, Default)]
struct PairSums {
    heights: f64,
    dot: f64,
    cross: f64,
}

impl PairSums {
    fn squared_distance(&self, a: WindowSums, b: WindowSums) -> f64 {
        let (dot, cross) = self.turn(a, b);
        let spread = a.spread() + b.spread();
        (spread - 2.0 * self.heights - 2.0 * (dot * dot + cross * cross).sqrt()).max(0.0)
    }

    /// The terms `dot` and `cross` of the closed form.
    fn turn(&self, a: WindowSums, b: WindowSums) -> (f64, f64) {
        (
            self.dot - (a.x * b.x + a.z * b.z),
            self.cross - (a.x * b.z - a.z * b.x),
        )
    }
}

/// Two windows of frames, one of each cloud.
#[derive(Clone, Copy, Debug)]
pub struct WindowPair<'a> {
    /// Cloud that stays in place.
    pub a: &'a PointCloud,
    /// First frame of the window of `a`.
    pub start_a: usize,
    /// Cloud that is moved onto `a`. It must have the same joints.
    pub b: &'a PointCloud,
    /// First frame of the window of `b`.
    pub start_b: usize,
    /// Number of frames in each window. It is at least 1, and both windows lie inside their clouds.
    pub frames: usize,
}

impl WindowPair<'_> {
    /// Ground transform that best aligns the window of `b` with the window of `a`, in the spaces of
    /// their clips.
    pub fn alignment(&self) -> Rigid2 {
        self.weighted_alignment(|_, _| 0.0)
    }

    /// [`WindowPair::alignment`] with additional weights. `extra` returns the additional weight of a joint in a frame of the windows.
    /// Without it, the weights of a frame sum to 1.
    pub(crate) fn weighted_alignment(&self, extra: impl Fn(usize, usize) -> f64) -> Rigid2 {
        let (of_a, of_b, pair) = self.sums(extra);
        let (dot, cross) = pair.turn(of_a, of_b);
        let heading = cross.atan2(dot) as f32;
        // Ground means in the spaces of the clips: the clouds' centres are added back.
        let mean_a = Vec3::new(of_a.x as f32, 0.0, of_a.z as f32) + self.a.centre();
        let mean_b = Vec3::new(of_b.x as f32, 0.0, of_b.z as f32) + self.b.centre();
        let shift = mean_a - Rigid2::new(heading, 0.0, 0.0).point(mean_b);
        Rigid2::new(heading, shift.x, shift.z)
    }

    /// Root of the mean squared distance of the points after alignment, in metres.
    pub fn distance(&self) -> f32 {
        let (of_a, of_b, pair) = self.sums(|_, _| 0.0);
        pair.squared_distance(of_a, of_b).sqrt() as f32
    }

    /// Sums with weights that sum to 1.
    fn sums(&self, extra: impl Fn(usize, usize) -> f64) -> (WindowSums, WindowSums, PairSums) {
        let mut pair = PairSums::default();
        let (mut of_a, mut of_b) = (WindowSums::default(), WindowSums::default());
        let joints = || {
            (0..self.frames).flat_map(|frame| (0..self.a.joints()).map(move |joint| (joint, frame)))
        };
        let added: f64 = joints().map(|(joint, frame)| extra(joint, frame)).sum();
        let scale = (self.frames as f64 + added).recip();
        for (joint, frame) in joints() {
            let weight = scale * (f64::from(self.a.weight(joint)) + extra(joint, frame));
            let p = self.a.point(joint, self.start_a + frame).as_dvec3();
            let q = self.b.point(joint, self.start_b + frame).as_dvec3();
            pair.heights += weight * p.y * q.y;
            pair.dot += weight * (p.x * q.x + p.z * q.z);
            pair.cross += weight * (p.x * q.z - p.z * q.x);
            of_a.add(weight, p);
            of_b.add(weight, q);
        }
        (of_a, of_b, pair)
    }
}

// The two inner loops of a distance map, for any instruction set: products of frames, and sums of
// the products along diagonals.

/// Number of frames of the first cloud that are processed together, so that each frame of the
/// second cloud is loaded once for all of them. The sums of four frames fit into the 16 registers
/// of AVX2.
const ROWS: usize = 4;

/// Number of sums for a pair of frames and for a pair of windows: heights, dot, cross.
pub(crate) const SUMS: usize = 3;

type Lanes<const L: usize> = [f32; L];

/// Sums the products of `R` frames with lanes `part * L` to `part * L + L` of a tile.
///
/// It contains no closures, because closures are not compiled for the selected instruction set.
#[inline(always)]
fn products<const R: usize, const L: usize>(
    frames: &[&[[f32; 3]]; R],
    tile: &[[[f32; TILE]; 3]],
    part: usize,
) -> [[Lanes<L>; SUMS]; R] {
    let mut sums = [[[0.0; L]; SUMS]; R];
    for (joint, [x, y, z]) in tile.iter().enumerate() {
        let x = &x.as_chunks::<L>().0[part];
        let y = &y.as_chunks::<L>().0[part];
        let z = &z.as_chunks::<L>().0[part];
        for row in 0..R {
            let [px, py, pz] = frames[row][joint];
            let [heights, dot, cross] = &mut sums[row];
            for lane in 0..L {
                heights[lane] += py * y[lane];
                dot[lane] += px * x[lane] + pz * z[lane];
                cross[lane] += px * z[lane] - pz * x[lane];
            }
        }
    }
    sums
}

/// Adds `row` to `sums`, element by element, up to the shorter length.
#[inline(always)]
fn add<T: Copy + Into<f64>>(sums: &mut [f64], row: &[T]) {
    for (sum, value) in sums.iter_mut().zip(row) {
        *sum += (*value).into();
    }
}

/// Copies `row` to `sums`, element by element, up to the shorter length.
#[inline(always)]
fn copy(sums: &mut [f64], row: &[f32]) {
    for (sum, value) in sums.iter_mut().zip(row) {
        *sum = f64::from(*value);
    }
}

/// Input of the distances between one window of the first cloud and all windows of the second.
struct WindowRow<'a> {
    /// Reciprocal of the number of frames in a window.
    scale: f64,
    /// Ground mean and spread of the first cloud's window.
    mean: [f64; 2],
    spread: f64,
    /// Ground means and spreads of the second cloud's windows.
    x: &'a [f64],
    z: &'a [f64],
    spreads: &'a [f64],
    /// Sums over pairs of frames in the earlier and in the later block of each window.
    early: [&'a [f64]; SUMS],
    late: [&'a [f64]; SUMS],
}

impl WindowRow<'_> {
    /// Computes the squared distances, in square metres.
    #[inline(always)]
    fn squared(&self, out: &mut [f32]) {
        let n = out.len();
        let (x, z, spreads) = (&self.x[..n], &self.z[..n], &self.spreads[..n]);
        let [heights0, dot0, cross0] = self.early;
        let (heights0, dot0, cross0) = (&heights0[..n], &dot0[..n], &cross0[..n]);
        let [heights1, dot1, cross1] = self.late;
        let (heights1, dot1, cross1) = (&heights1[..n], &dot1[..n], &cross1[..n]);
        let (scale, [ax, az]) = (self.scale, self.mean);
        for j in 0..n {
            let heights = scale * (heights0[j] + heights1[j]);
            let dot = scale * (dot0[j] + dot1[j]) - (ax * x[j] + az * z[j]);
            let cross = scale * (cross0[j] + cross1[j]) - (ax * z[j] - az * x[j]);
            // The subtraction above has already lost precision, so an f32 square root is accurate
            // enough. It is also faster.
            let turned = ((dot * dot + cross * cross) as f32).sqrt();
            let still = (self.spread + spreads[j] - 2.0 * heights) as f32;
            out[j] = (still - 2.0 * turned).max(0.0);
        }
    }
}

// Computes a distance map row by row.
//
// The sum of a pair of windows runs along a diagonal. Rows of frame pairs are grouped into blocks
// as long as a window, so that each window ends in one block and starts in the same or the
// previous block. Its sum is a suffix sum of the earlier block plus a prefix sum of the later
// block. Both take one addition for each row, in f64. Nothing is ever subtracted, so rounding
// errors do not grow with the clip's length. (This is the sliding maximum of van Herk, 1992, and
// Gil & Werman, 1993, applied to sums.)

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
    pub fn for_each_row(self, mut row: impl FnMut(usize, &[f32])) {
        let Self { a, b, isa } = self;
        if a.count() == 0 || b.count() == 0 {
            return;
        }
        let window = a.window();
        let mut sums = Sums::new(a, b);
        let mut squared = vec![0.0; b.count()];
        for block in (0..a.frames).step_by(window) {
            let rows = window.min(a.frames - block);
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
                if let Some(start) = (block + phase + 1).checked_sub(window) {
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

struct Sums<'a> {
    a: &'a Windows,
    b: &'a Windows,
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
        let length = b.frames.next_multiple_of(TILE) + window - 1;
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
                let sums = products::<R, L>(&frames, points, part);
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
                copy(so_far, row);
            } else {
                add(so_far, row);
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
                copy(out, row);
                // The last pair has no successor on its diagonal, and the last row has no
                // successor.
                if let Some(after) = after.get(written.start..written.end - 1) {
                    add(out, after);
                }
            }
        }
    }
}
