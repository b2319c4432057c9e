use glam::{Quat, Vec3};

use super::{JointId, Skeleton};
use crate::math::Rigid2;

/// A pose: position of the root and rotation of every joint relative to its parent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pose {
    /// Position of the root in the space of the motion, in metres.
    pub root: Vec3,
    /// Rotation of each joint. End sites have the identity.
    pub rotations: Vec<Quat>,
    /// Position of each joint in its parent's frame, in metres. It is empty if the joints keep the
    /// skeleton's offsets. The root's entry is unused.
    pub translations: Vec<Vec3>,
}

impl Pose {
    /// The pose in which nothing is turned and the root stands at a place.
    #[must_use]
    pub fn at_rest(skeleton: &Skeleton, root: Vec3) -> Self {
        Self {
            root,
            rotations: vec![Quat::IDENTITY; skeleton.len()],
            translations: Vec::new(),
        }
    }

    /// Moves and rotates the pose on the ground.
    pub fn place(&mut self, placement: Rigid2) {
        self.root = placement.point(self.root);
        if let Some(rotation) = self.rotations.first_mut() {
            *rotation = (placement.rotation() * *rotation).normalize();
        }
    }

    /// Copies another pose into this one and reuses its memory.
    pub fn copy_from(&mut self, other: &Self) {
        self.root = other.root;
        self.rotations.clone_from(&other.rotations);
        self.translations.clone_from(&other.translations);
    }

    /// Rotation and position of a joint in its parent's frame. The root's are in the space of the
    /// motion.
    pub fn local(&self, skeleton: &Skeleton, id: JointId) -> (Quat, Vec3) {
        let offset = &skeleton.joint(id).offset;
        let place = match id {
            JointId::ROOT => self.root,
            _ => *self.translations.get(id.index()).unwrap_or(offset),
        };
        (self.rotations[id.index()], place)
    }

    /// Fills `translations` with the skeleton's offsets if it is empty.
    pub fn fill_translations(&mut self, skeleton: &Skeleton) {
        if self.translations.is_empty() {
            let offsets = skeleton.joints().iter().map(|joint| joint.offset);
            self.translations.extend(offsets);
        }
    }

    /// Blends this pose with `other`. Weight 0 keeps this pose, weight 1 gives `other`. The root
    /// and the translations are interpolated linearly, rotations by slerp along the shorter arc.
    ///
    /// If only one of the poses has translations, the result has none. Call
    /// [`Pose::fill_translations`] on the other pose first to keep them.
    pub fn blend(&mut self, other: &Self, weight: f32) {
        self.root = self.root.lerp(other.root, weight);
        for (mine, theirs) in self.rotations.iter_mut().zip(&other.rotations) {
            *mine = slerp(*mine, *theirs, weight);
        }
        if self.translations.len() == other.translations.len() {
            for (mine, theirs) in self.translations.iter_mut().zip(&other.translations) {
                *mine = mine.lerp(*theirs, weight);
            }
        } else {
            self.translations.clear();
        }
    }
}

/// Slerp along the shorter arc, normalised.
pub fn slerp(a: Quat, b: Quat, weight: f32) -> Quat {
    let b = if a.dot(b) < 0.0 { -b } else { b };
    a.slerp(b, weight).normalize()
}

/// Normalised linear interpolation along the shorter arc. Between neighbouring frames of a clip it
/// differs from slerp by less than a five-hundredth of the angle and is much faster.
pub(super) fn nlerp(a: Quat, b: Quat, weight: f32) -> Quat {
    let b = if a.dot(b) < 0.0 { -b } else { b };
    (a + (b - a) * weight).normalize()
}

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
                let offset = pose.translations.get(index).unwrap_or(&joint.offset);
                JointTransform {
                    rotation: parent.rotation * rotation,
                    translation: parent.point(*offset),
                }
            }
        };
        out.push(transform);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_frames_nlerp_is_slerp() {
        // 15 rad/s at 30 frames per second.
        let (from, to) = (
            Quat::from_rotation_x(0.4),
            Quat::from_rotation_x(0.9) * Quat::from_rotation_z(0.05),
        );
        for step in 0..=10 {
            let weight = step as f32 / 10.0;
            let apart = nlerp(from, to, weight).angle_between(slerp(from, to, weight));
            assert!(
                apart < 2e-3 * from.angle_between(to) + 1e-6,
                "{apart} rad at {weight}"
            );
        }
    }
}
