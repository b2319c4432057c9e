//! The distance between windows of frames, for all pairs of windows of two clips.
//!
//! Source: Kovar, Gleicher & Pighin (2002), section 3.1: the weighted sum of squared distances
//! between two point clouds, minimised in closed form over a rotation about the vertical axis and a
//! translation on the ground. Differs: every term of the closed form is a sum over the frames of
//! the windows, so along a diagonal of the map a window slides by one pair of frames in and one
//! out; and the result is the root of the mean, metres.
//!
//! With weights w that sum to 1 over a window, points p of one window and q of the other, and
//! ground means p̄, q̄:
//! ```text
//! dot   = Σ w (px qx + pz qz) - (p̄x q̄x + p̄z q̄z)
//! cross = Σ w (px qz - pz qx) - (p̄x q̄z - p̄z q̄x)
//! D²    = Σ w |p|² + Σ w |q|² - |p̄|² - |q̄|² - 2 Σ w py qy - 2 √(dot² + cross²)
//! θ     = atan2(cross, dot)
//! ```

use glam::{DVec3, Vec3};

use super::PointCloud;
use crate::math::Rigid2;

/// Sums over one window of frames of a single clip.
#[derive(Clone, Copy, Debug, Default)]
struct WindowSums {
    x: f64,
    z: f64,
    squares: f64,
}

impl WindowSums {
    fn add(&mut self, weight: f64, point: DVec3) {
        self.x += weight * point.x;
        self.z += weight * point.z;
        self.squares += weight * point.length_squared();
    }
}

/// Sums over a pair of windows: what slides along a diagonal.
#[derive(Clone, Copy, Debug, Default)]
struct PairSums {
    heights: f64,
    dot: f64,
    cross: f64,
}

/// Calls `row` for every window of `a`, with the squared distances (m²) to all windows of `b`:
/// `row(i, d)` where `d[j]` compares the frames `i..i + window` of `a` with `j..j + window` of `b`.
/// Rows come in order. Nothing is called where a clip is shorter than the window.
///
/// # Panics
/// When `window` is 0 or the clouds have different joints.
pub fn for_each_row(
    a: &PointCloud,
    b: &PointCloud,
    window: usize,
    mut row: impl FnMut(usize, &[f32]),
) {
    assert!(
        window > 0 && a.joints() == b.joints(),
        "windows of at least one frame, clouds of one skeleton"
    );
    if a.frames() < window || b.frames() < window {
        return;
    }
    let (of_a, of_b) = (window_sums(a, window), window_sums(b, window));
    let columns = b.frames();
    // The last `window` rows of frame pairs, row r at r mod window.
    let mut recent = vec![FrameRow::new(columns); window];
    let mut sums = vec![PairSums::default(); columns];
    let mut distances = vec![0.0; of_b.len()];
    for frame in 0..a.frames() {
        let slot = &mut recent[frame % window];
        slide(&mut sums, window, slot, |leaving| leaving.fill(a, frame, b));
        let Some(start) = (frame + 1).checked_sub(window) else {
            continue;
        };
        for (start_b, distance) in distances.iter_mut().enumerate() {
            let pair = sums[start_b + window - 1];
            *distance = squared_distance(of_a[start], of_b[start_b], pair, window) as f32;
        }
        row(start, &distances);
    }
}

/// Moves the sums one frame down the diagonals. `slot` holds the row that leaves; `refill` puts the
/// new one in its place.
fn slide(
    sums: &mut [PairSums],
    window: usize,
    slot: &mut FrameRow,
    refill: impl FnOnce(&mut FrameRow),
) {
    sums.copy_within(..sums.len() - 1, 1);
    sums[0] = PairSums::default();
    for (column, sum) in sums.iter_mut().enumerate().skip(window) {
        sum.heights -= f64::from(slot.heights[column - window]);
        sum.dot -= f64::from(slot.dot[column - window]);
        sum.cross -= f64::from(slot.cross[column - window]);
    }
    refill(slot);
    for (column, sum) in sums.iter_mut().enumerate() {
        sum.heights += f64::from(slot.heights[column]);
        sum.dot += f64::from(slot.dot[column]);
        sum.cross += f64::from(slot.cross[column]);
    }
}

/// One frame of `a` against every frame of `b`: the sums over the joints.
#[derive(Clone, Debug)]
struct FrameRow {
    heights: Vec<f32>,
    dot: Vec<f32>,
    cross: Vec<f32>,
}

impl FrameRow {
    fn new(columns: usize) -> Self {
        Self {
            heights: vec![0.0; columns],
            dot: vec![0.0; columns],
            cross: vec![0.0; columns],
        }
    }

    fn fill(&mut self, a: &PointCloud, frame: usize, b: &PointCloud) {
        self.heights.fill(0.0);
        self.dot.fill(0.0);
        self.cross.fill(0.0);
        for joint in 0..a.joints() {
            let p = a.point(joint, frame) * a.weight(joint);
            let [x, y, z] = b.rows(joint);
            let sums = self
                .heights
                .iter_mut()
                .zip(&mut self.dot)
                .zip(&mut self.cross);
            for (((heights, dot), cross), ((&x, &y), &z)) in sums.zip(x.iter().zip(y).zip(z)) {
                *heights += p.y * y;
                *dot += p.x * x + p.z * z;
                *cross += p.x * z - p.z * x;
            }
        }
    }
}

fn window_sums(cloud: &PointCloud, window: usize) -> Vec<WindowSums> {
    let frames: Vec<WindowSums> = (0..cloud.frames())
        .map(|frame| {
            let mut sums = WindowSums::default();
            for joint in 0..cloud.joints() {
                let weight = f64::from(cloud.weight(joint));
                sums.add(weight, cloud.point(joint, frame).as_dvec3());
            }
            sums
        })
        .collect();
    let mean = |frames: &[WindowSums], of: fn(&WindowSums) -> f64| {
        frames.iter().map(of).sum::<f64>() / window as f64
    };
    frames
        .windows(window)
        .map(|w| WindowSums {
            x: mean(w, |s| s.x),
            z: mean(w, |s| s.z),
            squares: mean(w, |s| s.squares),
        })
        .collect()
}

fn squared_distance(a: WindowSums, b: WindowSums, pair: PairSums, window: usize) -> f64 {
    let scale = 1.0 / window as f64;
    let (dot, cross) = turn(a, b, pair, scale);
    let spread = a.squares - a.x * a.x - a.z * a.z + b.squares - b.x * b.x - b.z * b.z;
    (spread - 2.0 * scale * pair.heights - 2.0 * (dot * dot + cross * cross).sqrt()).max(0.0)
}

fn turn(a: WindowSums, b: WindowSums, pair: PairSums, scale: f64) -> (f64, f64) {
    (
        scale * pair.dot - (a.x * b.x + a.z * b.z),
        scale * pair.cross - (a.x * b.z - a.z * b.x),
    )
}

/// Two windows of frames, one of each cloud.
#[derive(Clone, Copy, Debug)]
pub struct WindowPair<'a> {
    /// The cloud that is stayed with.
    pub a: &'a PointCloud,
    /// First frame of the window of `a`.
    pub start_a: usize,
    /// The cloud that is moved; of the same joints.
    pub b: &'a PointCloud,
    /// First frame of the window of `b`.
    pub start_b: usize,
    /// Frames of either window; at least 1, and inside both clouds.
    pub frames: usize,
}

impl WindowPair<'_> {
    /// The transform of the ground that takes the window of `b` best onto the window of `a`, both
    /// in their clips' own spaces.
    #[must_use]
    pub fn alignment(&self) -> Rigid2 {
        let (of_a, of_b, pair) = self.sums();
        let (dot, cross) = turn(of_a, of_b, pair, 1.0 / self.frames as f64);
        let heading = cross.atan2(dot) as f32;
        // Both means in their clips' own spaces, with what the clouds took off put back.
        let mean_a = Vec3::new(of_a.x as f32, 0.0, of_a.z as f32) + self.a.centre();
        let mean_b = Vec3::new(of_b.x as f32, 0.0, of_b.z as f32) + self.b.centre();
        let shift = mean_a - Rigid2::new(heading, 0.0, 0.0).point(mean_b);
        Rigid2::new(heading, shift.x, shift.z)
    }

    /// Root of the mean squared distance of the points once the windows are aligned, metres.
    #[must_use]
    pub fn distance(&self) -> f32 {
        let (of_a, of_b, pair) = self.sums();
        squared_distance(of_a, of_b, pair, self.frames).sqrt() as f32
    }

    fn sums(&self) -> (WindowSums, WindowSums, PairSums) {
        let mut pair = PairSums::default();
        let (mut of_a, mut of_b) = (WindowSums::default(), WindowSums::default());
        let scale = 1.0 / self.frames as f64;
        for frame in 0..self.frames {
            for joint in 0..self.a.joints() {
                let weight = f64::from(self.a.weight(joint));
                let p = self.a.point(joint, self.start_a + frame).as_dvec3();
                let q = self.b.point(joint, self.start_b + frame).as_dvec3();
                pair.heights += weight * p.y * q.y;
                pair.dot += weight * (p.x * q.x + p.z * q.z);
                pair.cross += weight * (p.x * q.z - p.z * q.x);
                of_a.add(scale * weight, p);
                of_b.add(scale * weight, q);
            }
        }
        (of_a, of_b, pair)
    }
}
