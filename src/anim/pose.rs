use glam::{Quat, Vec3};

use super::{JointId, Skeleton};
use crate::math::Rigid2;

/// One posture: the root's place and every joint's rotation from its parent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pose {
    /// Of the root, metres, in the space of the motion.
    pub root: Vec3,
    /// One for each joint of the skeleton; identity at end sites.
    pub rotations: Vec<Quat>,
    /// One for each joint where the motion moves joints, else empty: then the skeleton's offsets
    /// hold. The root's entry is not used.
    pub translations: Vec<Vec3>,
}

impl Pose {
    /// The same posture somewhere else on the ground.
    pub fn place(&mut self, placement: Rigid2) {
        self.root = placement.point(self.root);
        if let Some(rotation) = self.rotations.first_mut() {
            *rotation = (placement.rotation() * *rotation).normalize();
        }
    }

    /// A joint's rotation and place in its parent's frame; the root's in the space of the motion.
    pub(crate) fn local(&self, skeleton: &Skeleton, id: JointId) -> (Quat, Vec3) {
        let offset = || skeleton.joint(id).offset;
        let place = match id {
            JointId::ROOT => self.root,
            _ => self
                .translations
                .get(id.index())
                .copied()
                .unwrap_or_else(offset),
        };
        (self.rotations[id.index()], place)
    }

    /// The same posture with translations of its own: the skeleton's offsets, where it has none.
    pub fn fill_translations(&mut self, skeleton: &Skeleton) {
        if self.translations.is_empty() {
            let offsets = skeleton.joints().iter().map(|joint| joint.offset);
            self.translations.extend(offsets);
        }
    }

    /// Moves this posture towards `other`: all `self` at 0, all `other` at 1. The root and the
    /// translations go in a straight line, rotations by slerp along the shorter arc.
    ///
    /// Where only one of the two has translations, the result has none of its own:
    /// [`Pose::fill_translations`] of the other one before keeps them.
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
pub(crate) fn slerp(a: Quat, b: Quat, weight: f32) -> Quat {
    let b = if a.dot(b) < 0.0 { -b } else { b };
    a.slerp(b, weight).normalize()
}

/// The normalised straight line along the shorter arc. Over the angle between two frames of a clip
/// it is slerp, but for less than a five-hundredth of that angle, at a fraction of the cost.
pub(super) fn nlerp(a: Quat, b: Quat, weight: f32) -> Quat {
    let b = if a.dot(b) < 0.0 { -b } else { b };
    (a + (b - a) * weight).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_frames_nlerp_is_slerp() {
        // 15 rad/s at 30 frames a second.
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
