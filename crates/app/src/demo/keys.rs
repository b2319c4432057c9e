//! Key poses and the spline through them.
//!
//! The curve is a cubic Hermite spline with the slopes of Fritsch & Carlson 1980, "Monotone piecewise cubic
//! interpolation": it eases in and out of every extreme and holds, and never overshoots a key.

use glam::Vec3;

/// Number of vectors of a [`Body`].
pub(super) const ROWS: usize = 12;

/// Targets of the trunk, head and hands. The feet are handled by [`super::feet`].
///
/// *Home* is a frame on the ground that the choreography moves: midway between the feet in guard, facing the
/// opponent along +Z. Turns are (pitch forward, yaw left, roll left) in radians, in the frame of home.
#[derive(Clone, Copy, Debug)]
pub(super) struct Body {
    /// Home in the space of the motion: x and z in metres, y is the heading in radians.
    pub(super) place: Vec3,
    /// Position of the hips in home, in metres.
    pub(super) pelvis: Vec3,
    /// Rotation of the hips.
    pub(super) hips: Vec3,
    /// Rotation of the chest.
    pub(super) chest: Vec3,
    /// Rotation of the head.
    pub(super) head: Vec3,
    /// Positions of the wrists in the chest's frame, in metres.
    pub(super) hands: [Vec3; 2],
    /// Positions of the wrists in home, in metres, for strikes and for the ground.
    pub(super) reach: [Vec3; 2],
    /// Weight of `reach` against `hands`, 0 to 1.
    pub(super) reaching: [f32; 2],
    /// Angle by which the elbows are lifted outwards, in radians: 0 hangs, π/2 is horizontal.
    pub(super) elbows: [f32; 2],
    /// Angle by which the heels are raised about the toes, in radians.
    pub(super) heels: [f32; 2],
}

impl Body {
    /// The vectors as rows to interpolate.
    pub(super) fn rows(&self) -> [Vec3; ROWS] {
        let pair = |values: [f32; 2]| Vec3::new(values[0], values[1], 0.0);
        [
            self.place,
            self.pelvis,
            self.hips,
            self.chest,
            self.head,
            self.hands[0],
            self.hands[1],
            self.reach[0],
            self.reach[1],
            pair(self.reaching),
            pair(self.elbows),
            pair(self.heels),
        ]
    }

    /// Undoes [`Body::rows`].
    pub(super) fn from_rows(rows: &[Vec3; ROWS]) -> Self {
        let pair = |row: Vec3| [row.x, row.y];
        Self {
            place: rows[0],
            pelvis: rows[1],
            hips: rows[2],
            chest: rows[3],
            head: rows[4],
            hands: [rows[5], rows[6]],
            reach: [rows[7], rows[8]],
            reaching: pair(rows[9]),
            elbows: pair(rows[10]),
            heels: pair(rows[11]),
        }
    }

    /// Mirrors left and right about home.
    pub(super) fn mirrored(&self) -> Self {
        let place = |v: Vec3| Vec3::new(-v.x, v.y, v.z);
        let turn = |v: Vec3| Vec3::new(v.x, -v.y, -v.z);
        let swap = |v: [Vec3; 2]| [place(v[1]), place(v[0])];
        let other = |v: [f32; 2]| [v[1], v[0]];
        Self {
            place: self.place,
            pelvis: place(self.pelvis),
            hips: turn(self.hips),
            chest: turn(self.chest),
            head: turn(self.head),
            hands: swap(self.hands),
            reach: swap(self.reach),
            reaching: other(self.reaching),
            elbows: other(self.elbows),
            heels: other(self.heels),
        }
    }
}

/// A C1 spline through keys of `N` vectors. It is at rest at both ends and constant beyond them.
#[derive(Clone, Debug)]
pub(super) struct Track<const N: usize> {
    times: Vec<f32>,
    values: Vec<[Vec3; N]>,
    slopes: Vec<[Vec3; N]>,
}

impl<const N: usize> Track<N> {
    /// Keys in ascending order of time, in seconds.
    pub(super) fn new(keys: Vec<(f32, [Vec3; N])>) -> Self {
        let (times, values): (Vec<f32>, Vec<[Vec3; N]>) = keys.into_iter().unzip();
        let mut slopes = vec![[Vec3::ZERO; N]; times.len()];
        for key in 1..times.len().saturating_sub(1) {
            let (before, after) = (times[key] - times[key - 1], times[key + 1] - times[key]);
            for row in 0..N {
                let rise = (values[key][row] - values[key - 1][row]) / before;
                let next = (values[key + 1][row] - values[key][row]) / after;
                slopes[key][row] = Vec3::from_array(std::array::from_fn(|axis| {
                    slope([rise[axis], next[axis]], [before, after])
                }));
            }
        }
        Self {
            times,
            values,
            slopes,
        }
    }

    /// Value of one row at `time`, in seconds.
    pub(super) fn row(&self, row: usize, time: f32) -> Vec3 {
        let after = self.times.partition_point(|&key| key <= time);
        let last = self.times.len() - 1;
        if after == 0 || after > last {
            return self.values[after.min(last)][row];
        }
        let (a, b) = (after - 1, after);
        let span = self.times[b] - self.times[a];
        let s = (time - self.times[a]) / span;
        let (s2, s3) = (s * s, s * s * s);
        let rise = 3.0 * s2 - 2.0 * s3;
        self.values[a][row] * (1.0 - rise)
            + self.values[b][row] * rise
            + self.slopes[a][row] * ((s3 - 2.0 * s2 + s) * span)
            + self.slopes[b][row] * ((s3 - s2) * span)
    }
}

/// The weighted harmonic mean of the slopes of two intervals with these durations: zero at an extreme.
fn slope([rise, next]: [f32; 2], [before, after]: [f32; 2]) -> f32 {
    if rise * next <= 0.0 {
        return 0.0;
    }
    let (first, second) = (2.0 * after + before, after + 2.0 * before);
    (first + second) / (first / rise + second / next)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_track_passes_through_its_keys_and_never_overshoots() {
        let values = [0.0, 1.0, 1.0, -0.5, 2.0];
        let keys = values.iter().enumerate();
        let track = Track::new(keys.map(|(i, &v)| (i as f32, [Vec3::splat(v)])).collect());
        for (i, &v) in values.iter().enumerate() {
            assert!((track.row(0, i as f32).x - v).abs() < 1e-6);
        }
        for i in 0..400 {
            let time = i as f32 * 0.01;
            let (a, b) = (values[i / 100], values[i / 100 + 1]);
            let x = track.row(0, time).x;
            assert!(x >= f32::min(a, b) - 1e-5 && x <= f32::max(a, b) + 1e-5);
        }
    }
}
