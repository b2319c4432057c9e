use crate::anim::{Clip, Pose, Skeleton, forward_kinematics};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The joints of a clip as points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointCloud {
    frames: usize,
    /// Weight of each joint. Weights sum to 1.
    weights: Vec<f32>,
    /// Positions relative to `centre`, `[frame][joint]`, in metres.
    points: Vec<Vec3>,
    /// Point that is subtracted from all points. It keeps sums of squares small far from the
    /// origin.
    centre: Vec3,
}

impl PointCloud {
    /// Computes the points of all frames of `clip`. `weights` holds the weight of each joint.
    /// Weights must not be negative, and at least one must be positive; they are normalised.
    #[must_use]
    pub fn new(skeleton: &Skeleton, clip: &Clip, weights: &[f32]) -> Self {
        let frames = clip.frames();
        let total: f32 = weights.iter().sum();
        let roots = (0..frames).map(|frame| clip.root(frame));
        let mean = roots.sum::<Vec3>() / frames as f32;
        let centre = Vec3::new(mean.x, 0.0, mean.z);
        let mut points = Vec::with_capacity(frames * skeleton.len());
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        for frame in 0..frames {
            clip.pose(frame, &mut pose);
            forward_kinematics(skeleton, &pose, &mut joints);
            points.extend(joints.iter().map(|joint| joint.translation - centre));
        }
        Self {
            frames,
            weights: weights.iter().map(|w| w / total).collect(),
            points,
            centre,
        }
    }

    /// Whether all points and weights are present and finite. It checks clouds that come from a file.
    pub fn is_sound(&self) -> bool {
        self.frames.checked_mul(self.joints()) == Some(self.points.len())
            && self.centre.is_finite()
            && self.points.iter().all(|point| point.is_finite())
            && self.weights.iter().all(|weight| weight.is_finite())
    }

    /// Returns a range of frames as a cloud with the same centre. The range must not be empty.
    pub(crate) fn part(&self, frames: Range<usize>) -> Self {
        let joints = self.joints();
        Self {
            frames: frames.len(),
            weights: self.weights.clone(),
            points: self.points[frames.start * joints..frames.end * joints].to_vec(),
            centre: self.centre,
        }
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// Mean of the points of each frame by their weights, in metres.
    pub(crate) fn middles(&self) -> Vec<Vec3> {
        let middle = |frame| {
            let points = self.weights.iter().enumerate();
            self.centre
                + points
                    .map(|(joint, weight)| *weight * self.point(joint, frame))
                    .sum::<Vec3>()
        };
        (0..self.frames).map(middle).collect()
    }

    /// Number of points in a frame.
    pub fn joints(&self) -> usize {
        self.weights.len()
    }

    /// Point that was subtracted from all points, in metres.
    pub fn centre(&self) -> Vec3 {
        self.centre
    }

    /// Weight of a joint. All weights sum to 1.
    pub fn weight(&self, joint: usize) -> f32 {
        self.weights[joint]
    }

    /// Position of a point relative to [`PointCloud::centre`], in metres.
    pub fn point(&self, joint: usize, frame: usize) -> Vec3 {
        self.points[frame * self.joints() + joint]
    }
}

/// Number of frames that are compared together.
pub(crate) const TILE: usize = 16;

/// Sums over one window of a cloud, weighted by point.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct WindowSums {
    pub(crate) x: f64,
    pub(crate) z: f64,
    pub(crate) squares: f64,
}

impl WindowSums {
    pub(crate) fn add(&mut self, weight: f64, point: DVec3) {
        self.x += weight * point.x;
        self.z += weight * point.z;
        self.squares += weight * point.length_squared();
    }

    /// Mean squared distance from the window's ground mean. Heights are relative to the ground.
    pub(crate) fn spread(&self) -> f64 {
        self.squares - self.x * self.x - self.z * self.z
    }
}

/// A point cloud in the layouts that distance maps read, with the sums of each window.
#[derive(Clone, Debug)]
pub struct Windows {
    window: usize,
    pub(crate) frames: usize,
    /// Number of points in the cloud, including those without weight.
    points: usize,
    /// Number of joints with a weight.
    joints: usize,
    /// Weight of each joint that has one.
    pub(crate) weights: Vec<f32>,
    /// Weighted coordinates, `[frame][joint]`.
    weighted: Vec<[f32; 3]>,
    /// Coordinates, `[frame / TILE][joint][x, y, z][frame % TILE]`, 0 after the last frame.
    tiles: Vec<[[f32; TILE]; 3]>,
    /// Ground mean and spread of each window.
    pub(crate) x: Vec<f64>,
    pub(crate) z: Vec<f64>,
    pub(crate) spread: Vec<f64>,
}

impl Windows {
    /// Prepares a cloud for windows of `window` frames.
    ///
    /// # Panics
    /// Panics if `window` is 0.
    #[must_use]
    pub fn new(cloud: &PointCloud, window: usize) -> Self {
        assert!(window > 0, "windows of at least one frame");
        let frames = cloud.frames();
        // A joint without weight adds nothing to any sum.
        let joints: Vec<usize> = (0..cloud.joints())
            .filter(|&joint| cloud.weight(joint) > 0.0)
            .collect();
        let mut windows = Self {
            window,
            frames,
            points: cloud.joints(),
            joints: joints.len(),
            weights: joints.iter().map(|&joint| cloud.weight(joint)).collect(),
            weighted: Vec::with_capacity(frames * joints.len()),
            tiles: vec![[[0.0; TILE]; 3]; frames.div_ceil(TILE) * joints.len()],
            x: Vec::new(),
            z: Vec::new(),
            spread: Vec::new(),
        };
        let mut sums = vec![WindowSums::default(); frames];
        for (frame, sums) in sums.iter_mut().enumerate() {
            for (index, &joint) in joints.iter().enumerate() {
                let (point, weight) = (cloud.point(joint, frame), cloud.weight(joint));
                sums.add(f64::from(weight), point.as_dvec3());
                windows.weighted.push((point * weight).to_array());
                let tile = &mut windows.tiles[frame / TILE * joints.len() + index];
                for (row, value) in tile.iter_mut().zip(point.to_array()) {
                    row[frame % TILE] = value;
                }
            }
        }
        let mean = |frames: &[WindowSums], of: fn(&WindowSums) -> f64| {
            frames.iter().map(of).sum::<f64>() / window as f64
        };
        for frames in sums.windows(window) {
            let mean = WindowSums {
                x: mean(frames, |s| s.x),
                z: mean(frames, |s| s.z),
                squares: mean(frames, |s| s.squares),
            };
            windows.x.push(mean.x);
            windows.z.push(mean.z);
            windows.spread.push(mean.spread());
        }
        windows
    }

    /// Number of windows. It is 0 if the cloud is shorter than a window.
    pub fn count(&self) -> usize {
        self.spread.len()
    }

    /// Number of frames in a window.
    pub fn window(&self) -> usize {
        self.window
    }

    /// Position of a joint that has a weight, relative to the cloud's centre, in metres. `joint` is its index in
    /// `weights`.
    pub(crate) fn point(&self, frame: usize, joint: usize) -> [f32; 3] {
        self.tiles[frame / TILE * self.joints + joint].map(|row| row[frame % TILE])
    }

    /// Ground mean of a window's points, relative to the cloud's centre, in metres.
    pub(crate) fn ground_mean(&self, window: usize) -> [f64; 2] {
        [self.x[window], self.z[window]]
    }

    /// Mean square of the distance of a window's points from the cloud's centre on the ground, in square metres.
    pub(crate) fn mean_square(&self, window: usize) -> f64 {
        let [x, z] = self.ground_mean(window);
        self.spread[window] + x * x + z * z
    }

    /// Whether both clouds have the same number of points and both windows the same length.
    pub(crate) fn fits(&self, other: &Self) -> bool {
        (self.window, self.points, self.joints) == (other.window, other.points, other.joints)
    }

    /// Weighted coordinates of one frame's points that have a weight.
    #[inline(always)]
    pub(crate) fn weighted(&self, frame: usize) -> &[[f32; 3]] {
        &self.weighted[frame * self.joints..(frame + 1) * self.joints]
    }

    /// Coordinates of the points that have a weight, tile by tile.
    #[inline(always)]
    pub(crate) fn tiles(&self) -> std::slice::ChunksExact<'_, [[f32; TILE]; 3]> {
        self.tiles.chunks_exact(self.joints)
    }

    /// One of [`Windows::tiles`].
    #[inline(always)]
    pub(crate) fn tile(&self, index: usize) -> &[[[f32; TILE]; 3]] {
        &self.tiles[index * self.joints..(index + 1) * self.joints]
    }
}
