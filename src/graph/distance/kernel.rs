//! The two inner loops of a distance map, for any instruction set: products of frames, and sums of
//! the products along diagonals.

use super::windows::TILE;

/// Number of frames of the first cloud that are processed together, so that each frame of the
/// second cloud is loaded once for all of them. The sums of four frames fit into the 16 registers
/// of AVX2.
pub(super) const ROWS: usize = 4;

/// Number of sums for a pair of frames and for a pair of windows: heights, dot, cross.
pub(super) const SUMS: usize = 3;

/// Values of `L` neighbouring columns.
type Lanes<const L: usize> = [f32; L];

/// Sums the products of `R` frames with lanes `part * L` to `part * L + L` of a tile.
///
/// It contains no closures, because closures are not compiled for the selected instruction set.
#[inline(always)]
pub(super) fn products<const R: usize, const L: usize>(
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
pub(super) fn add<T: Copy + Into<f64>>(sums: &mut [f64], row: &[T]) {
    for (sum, value) in sums.iter_mut().zip(row) {
        *sum += (*value).into();
    }
}

/// Copies `row` to `sums`, element by element, up to the shorter length.
#[inline(always)]
pub(super) fn copy(sums: &mut [f64], row: &[f32]) {
    for (sum, value) in sums.iter_mut().zip(row) {
        *sum = f64::from(*value);
    }
}

/// Input of the distances between one window of the first cloud and all windows of the second.
pub(super) struct WindowRow<'a> {
    /// Reciprocal of the number of frames in a window.
    pub(super) scale: f64,
    /// Ground mean and spread of the first cloud's window.
    pub(super) mean: [f64; 2],
    pub(super) spread: f64,
    /// Ground means and spreads of the second cloud's windows.
    pub(super) x: &'a [f64],
    pub(super) z: &'a [f64],
    pub(super) spreads: &'a [f64],
    /// Sums over pairs of frames in the earlier and in the later block of each window.
    pub(super) early: [&'a [f64]; SUMS],
    pub(super) late: [&'a [f64]; SUMS],
}

impl WindowRow<'_> {
    /// Computes the squared distances, in square metres.
    #[inline(always)]
    pub(super) fn squared(&self, out: &mut [f32]) {
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
