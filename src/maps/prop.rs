use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::BodySphere;
use crate::anim::{JointId, Skeleton};

/// A sphere in a joint's own frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LocalSphere {
    /// Of its centre, metres.
    pub offset: Vec3,
    /// Metres.
    pub radius: f32,
}

/// What a joint holds: a staff, a sword, a shield. It attacks where its joint does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Prop {
    /// The joint that it moves with.
    pub joint: JointId,
    /// In that joint's frame.
    pub spheres: Vec<LocalSphere>,
    /// Whether an attack that meets it is a hit: it is then part of the body.
    pub is_body: bool,
}

impl Prop {
    /// Its spheres as the body has them.
    pub fn body_spheres(&self) -> impl Iterator<Item = BodySphere> + '_ {
        self.spheres
            .iter()
            .map(|&LocalSphere { offset, radius }| BodySphere {
                joint: self.joint,
                offset,
                radius,
            })
    }

    /// Whether it has spheres, and each hangs from one of `skeleton`'s joints and has a place and a size.
    #[must_use]
    pub fn is_sound(&self, skeleton: &Skeleton) -> bool {
        !self.spheres.is_empty() && self.body_spheres().all(|sphere| sphere.is_sound(skeleton))
    }

    /// Whether it attacks where `joints` do, of which none means the whole body: it is held by one of them, or by a joint above or below.
    #[must_use]
    pub fn takes_part(&self, skeleton: &Skeleton, joints: &[JointId]) -> bool {
        let above = |joint: JointId, other: JointId| skeleton.ancestry(joint).any(|j| j == other);
        let tied = |&joint: &JointId| above(self.joint, joint) || above(joint, self.joint);
        joints.is_empty() || joints.iter().any(tied)
    }
}
