//! The two loops that a distance map spends its time in, for any instruction set: products of
//! frames, and their sums along the diagonals.

use super::windows::TILE;

/// Frames of the first cloud whose products are taken at once, so that each frame of the second is
/// loaded once for all of them. Four keep their sums in the 16 registers of AVX2.
pub(super) const ROWS: usize = 4;

/// What is summed over the joints of a pair of frames, and over the frames of a pair of windows:
/// heights, dot, cross.
pub(super) const SUMS: usize = 3;

/// One value for each of `L` neighbouring columns.
type Lanes<const L: usize> = [f32; L];

/// Sums of the products of `R` frames with those of the `part`th `L` lanes of a tile.
///
/// Closures would stay as the program was built: there are none here.
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

/// Adds `row` to `sums`, value by value, as far as both go.
#[inline(always)]
pub(super) fn add<T: Copy + Into<f64>>(sums: &mut [f64], row: &[T]) {
    for (sum, value) in sums.iter_mut().zip(row) {
        *sum += (*value).into();
    }
}

/// Writes `row` over `sums`, value by value, as far as both go.
#[inline(always)]
pub(super) fn copy(sums: &mut [f64], row: &[f32]) {
    for (sum, value) in sums.iter_mut().zip(row) {
        *sum = f64::from(*value);
    }
}

/// A window of the first cloud against all windows of the second.
pub(super) struct WindowRow<'a> {
    /// 1 over the frames of a window.
    pub(super) scale: f64,
    /// Ground mean and spread of the first cloud's window.
    pub(super) mean: [f64; 2],
    pub(super) spread: f64,
    /// Of the second cloud's windows.
    pub(super) x: &'a [f64],
    pub(super) z: &'a [f64],
    pub(super) spreads: &'a [f64],
    /// The sums of pairs of frames over the earlier and the later part of the windows.
    pub(super) early: [&'a [f64]; SUMS],
    pub(super) late: [&'a [f64]; SUMS],
}

impl WindowRow<'_> {
    /// The squared distances, metres².
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
            // What cancels has done so: an f32's root is close enough, and quick.
            let turned = ((dot * dot + cross * cross) as f32).sqrt();
            let still = (self.spread + spreads[j] - 2.0 * heights) as f32;
            out[j] = (still - 2.0 * turned).max(0.0);
        }
    }
}
