//! A frame that is left, and a target that is aligned with it.

use glam::Vec3;

use super::Stance;
use super::targets::ClipFrame;
use crate::anim::{JointId, Pose, forward_kinematics};
use crate::graph::{MotionGraph, Node};
use crate::math::Rigid2;

/// Maximum horizontal distance of root and feet, in metres. Most pairs beyond it fail the later tests, which are slower.
pub(super) const ROOT_APART: f32 = 0.25;
pub(super) const FOOT_APART: f32 = 0.45;

/// Positions of hips and head in a frame of a clip.
#[derive(Clone, Copy, Debug)]
pub(super) struct Points {
    pub(super) hip: Vec3,
    pub(super) head: Vec3,
}

impl Points {
    /// Positions in a frame. `head` is the head's joint, which the caller looks up once.
    pub(super) fn of(graph: &MotionGraph, head: JointId, at: Node) -> Self {
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        graph.clip(at.clip).pose(at.frame as usize, &mut pose);
        forward_kinematics(graph.skeleton(), &pose, &mut joints);
        Self {
            hip: pose.root,
            head: joints[head.index()].translation,
        }
    }
}

/// Data of the frame that is left, by which targets are aligned.
pub(super) struct Leaving {
    /// The frame before the cut.
    pub(super) before: ClipFrame,
    pub(super) stance: Stance,
    pub(super) standing: Vec<bool>,
    pub(super) ways: [Points; 2],
}

/// Alignment of a target.
#[derive(Clone, Copy)]
pub(super) struct Aligned {
    /// Index of the target.
    pub(super) target: usize,
    pub(super) pin: Option<usize>,
    pub(super) align: Rigid2,
    /// Departure of hips and head and distance of the feet, in metres.
    pub(super) cost: f32,
    /// Whether the departure of hips and head is within the limits of a short blend.
    pub(super) goes_on: bool,
}
