use glam::{Quat, Vec3};

use super::{Pose, Skeleton};

/// A joint's frame in the space of the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointTransform {
    /// Rotation from the joint's frame to the space of the motion.
    pub rotation: Quat,
    /// Position of the joint, in metres.
    pub translation: Vec3,
}

impl JointTransform {
    /// No rotation, at the origin.
    pub const IDENTITY: Self = Self {
        rotation: Quat::IDENTITY,
        translation: Vec3::ZERO,
    };

    /// Transforms a point from the joint's frame to the space of the motion.
    #[must_use]
    pub fn point(&self, local: Vec3) -> Vec3 {
        self.rotation * local + self.translation
    }
}

/// Computes every joint's frame in the space of the motion, parents first. `out` is resized to the
/// number of joints.
pub fn forward_kinematics(skeleton: &Skeleton, pose: &Pose, out: &mut Vec<JointTransform>) {
    out.clear();
    for (index, joint) in skeleton.joints().iter().enumerate() {
        let rotation = pose.rotations[index];
        let transform = match joint.parent {
            None => JointTransform {
                rotation,
                translation: pose.root,
            },
            Some(parent) => {
                let parent = out[parent.index()];
                let offset = pose
                    .translations
                    .get(index)
                    .copied()
                    .unwrap_or(joint.offset);
                JointTransform {
                    rotation: parent.rotation * rotation,
                    translation: parent.point(offset),
                }
            }
        };
        out.push(transform);
    }
}
