use serde::{Deserialize, Serialize};

use super::BodySphere;
use crate::anim::{JointId, Skeleton};
use crate::math::Sphere;

/// An object that a joint holds, for example a staff, a sword or a shield. It attacks when its
/// joint does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Prop {
    /// Joint that the prop moves with.
    pub joint: JointId,
    /// Spheres of the prop, in the joint's frame.
    pub spheres: Vec<Sphere>,
    /// Whether attacks can hit the prop, which makes it part of the body.
    pub is_body: bool,
}

impl Prop {
    /// Spheres of the prop as body spheres.
    pub fn body_spheres(&self) -> impl Iterator<Item = BodySphere> + '_ {
        self.spheres
            .iter()
            .map(|&Sphere { centre, radius }| BodySphere {
                joint: self.joint,
                offset: centre,
                radius,
            })
    }

    /// Whether the prop has spheres and each has a joint of `skeleton`, a finite position and a
    /// positive radius.
    #[must_use]
    pub fn is_sound(&self, skeleton: &Skeleton) -> bool {
        !self.spheres.is_empty() && self.body_spheres().all(|sphere| sphere.is_sound(skeleton))
    }

    /// Whether the prop takes part in an attack of `joints`. It does if its joint is one of them,
    /// or an ancestor or a descendant of one. An empty list stands for the whole body.
    #[must_use]
    pub fn takes_part(&self, skeleton: &Skeleton, joints: &[JointId]) -> bool {
        let above = |joint: JointId, other: JointId| skeleton.ancestry(joint).any(|j| j == other);
        let tied = |&joint: &JointId| above(self.joint, joint) || above(joint, self.joint);
        joints.is_empty() || joints.iter().any(tied)
    }
}
