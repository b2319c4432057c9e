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

use crate::graph::search::windows::{PointCloud, WindowSums};
use crate::math::Rigid2;
use glam::Vec3;

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
