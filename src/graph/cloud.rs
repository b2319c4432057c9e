use std::ops::Range;

use glam::Vec3;

use crate::anim::{Clip, Pose, Skeleton, forward_kinematics};

/// The joints of a clip as points, frame after frame, in the layout that the distance map reads:
/// for each joint one row of x, one of y and one of z over the frames.
#[derive(Clone, Debug)]
pub struct PointCloud {
    frames: usize,
    /// One for each joint; they sum to 1.
    weights: Vec<f32>,
    /// `[joint][frame]`, metres, relative to `centre`.
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    /// Taken off every point, so that sums of squares stay small far from the origin.
    centre: Vec3,
}

impl PointCloud {
    /// The points of every frame of `clip`, weighted by joint. `weights` need not sum to 1; they
    /// must not be negative, and one must be above 0.
    #[must_use]
    pub fn new(skeleton: &Skeleton, clip: &Clip, weights: &[f32]) -> Self {
        let (frames, joints) = (clip.frames(), skeleton.len());
        let total: f32 = weights.iter().sum();
        let roots = &clip.desc().roots;
        let mean = roots.iter().sum::<Vec3>() / frames as f32;
        let centre = Vec3::new(mean.x, 0.0, mean.z);
        let zeros = vec![0.0; frames * joints];
        let mut cloud = Self {
            frames,
            weights: weights.iter().map(|w| w / total).collect(),
            x: zeros.clone(),
            y: zeros.clone(),
            z: zeros,
            centre,
        };
        let (mut pose, mut transforms) = (Pose::default(), Vec::new());
        for frame in 0..frames {
            clip.pose(frame, &mut pose);
            forward_kinematics(skeleton, &pose, &mut transforms);
            for (joint, transform) in transforms.iter().enumerate() {
                let point = transform.translation - centre;
                let index = joint * frames + frame;
                (cloud.x[index], cloud.y[index], cloud.z[index]) = (point.x, point.y, point.z);
            }
        }
        cloud
    }

    /// Some of the frames, at least one, as a cloud of their own with the same centre.
    pub(super) fn part(&self, frames: Range<usize>) -> Self {
        let part = |rows: &[f32]| -> Vec<f32> {
            let rows = rows.chunks_exact(self.frames);
            rows.flat_map(|row| &row[frames.clone()]).copied().collect()
        };
        Self {
            frames: frames.len(),
            weights: self.weights.clone(),
            x: part(&self.x),
            y: part(&self.y),
            z: part(&self.z),
            centre: self.centre,
        }
    }

    /// How many frames.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// How many points a frame has.
    #[must_use]
    pub fn joints(&self) -> usize {
        self.weights.len()
    }

    /// What was taken off every point, metres.
    #[must_use]
    pub fn centre(&self) -> Vec3 {
        self.centre
    }

    /// A joint's weight; all sum to 1.
    #[must_use]
    pub fn weight(&self, joint: usize) -> f32 {
        self.weights[joint]
    }

    /// A point relative to [`PointCloud::centre`], metres.
    #[must_use]
    pub fn point(&self, joint: usize, frame: usize) -> Vec3 {
        let index = joint * self.frames + frame;
        Vec3::new(self.x[index], self.y[index], self.z[index])
    }
}
