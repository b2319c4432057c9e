use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::anim::{JointId, JointTransform, Skeleton};

/// A sphere that is fixed to a joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodySphere {
    /// Joint that the sphere moves with.
    pub joint: JointId,
    /// Position of the centre in the joint's frame, in metres.
    pub offset: Vec3,
    /// Radius, in metres.
    pub radius: f32,
}

impl BodySphere {
    /// Whether the joint exists in `skeleton`, the position is finite and the radius is positive.
    #[must_use]
    pub fn is_sound(&self, skeleton: &Skeleton) -> bool {
        self.joint.index() < skeleton.len()
            && Skeleton::is_near(self.offset)
            && self.radius > 0.0
            && self.radius <= Skeleton::FURTHEST
    }

    /// Position of the centre in the space of `joints`.
    #[must_use]
    pub fn centre(&self, joints: &[JointTransform]) -> Vec3 {
        joints[self.joint.index()].point(self.offset)
    }
}
