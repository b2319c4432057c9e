use crate::anim::{Clip, Pose, Skeleton, forward_kinematics};
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The joints of a clip as points. For each joint there is one row of x, one of y and one of z
/// coordinates over the frames, which is the layout that the distance map reads.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointCloud {
    frames: usize,
    /// Weight of each joint. Weights sum to 1.
    weights: Vec<f32>,
    /// Coordinates relative to `centre`, `[joint][frame]`, in metres.
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    /// Point that is subtracted from all points. It keeps sums of squares small far from the
    /// origin.
    centre: Vec3,
}

impl PointCloud {
    /// Computes the points of all frames of `clip`. `weights` holds the weight of each joint.
    /// Weights must not be negative, and at least one must be positive; they are normalised.
    #[must_use]
    pub fn new(skeleton: &Skeleton, clip: &Clip, weights: &[f32]) -> Self {
        let (frames, joints) = (clip.frames(), skeleton.len());
        let total: f32 = weights.iter().sum();
        let roots = (0..frames).map(|frame| clip.root(frame));
        let mean = roots.sum::<Vec3>() / frames as f32;
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

    /// Whether all points and weights are present and finite. It checks clouds that come from a file.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let points = self.frames.checked_mul(self.joints());
        let all = [&self.weights, &self.x, &self.y, &self.z].into_iter();
        [&self.x, &self.y, &self.z]
            .iter()
            .all(|row| Some(row.len()) == points)
            && self.centre.is_finite()
            && all.flatten().all(|value| value.is_finite())
    }

    /// Returns a range of frames as a cloud with the same centre. The range must not be empty.
    pub(crate) fn part(&self, frames: Range<usize>) -> Self {
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

    /// Number of frames.
    #[must_use]
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
    #[must_use]
    pub fn joints(&self) -> usize {
        self.weights.len()
    }

    /// Point that was subtracted from all points, in metres.
    #[must_use]
    pub fn centre(&self) -> Vec3 {
        self.centre
    }

    /// Weight of a joint. All weights sum to 1.
    #[must_use]
    pub fn weight(&self, joint: usize) -> f32 {
        self.weights[joint]
    }

    /// Position of a point relative to [`PointCloud::centre`], in metres.
    #[must_use]
    pub fn point(&self, joint: usize, frame: usize) -> Vec3 {
        let index = joint * self.frames + frame;
        Vec3::new(self.x[index], self.y[index], self.z[index])
    }
}
