//! Joint transforms of a clip's frames in model space, in double precision.

use glam::{DQuat, DVec3};

use crate::anim::{JointId, Moment, Skeleton};

/// A joint's transform in model space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub(super) rotation: DQuat,
    pub(super) translation: DVec3,
}

impl Place {
    pub(super) const IDENTITY: Self = Self {
        rotation: DQuat::IDENTITY,
        translation: DVec3::ZERO,
    };

    pub(super) fn point(&self, local: DVec3) -> DVec3 {
        self.rotation * local + self.translation
    }

    /// The concatenation of two transforms; `inner` is applied first.
    pub(super) fn after(&self, inner: &Self) -> Self {
        Self {
            rotation: (self.rotation * inner.rotation).normalize(),
            translation: self.point(inner.translation),
        }
    }

    /// `other` in the frame of `self`.
    pub(super) fn sees(&self, other: &Self) -> Self {
        let back = self.rotation.conjugate();
        Self {
            rotation: (back * other.rotation).normalize(),
            translation: back * (other.translation - self.translation),
        }
    }
}

/// Writes the transforms of all joints at a moment of a clip to `out`.
pub(super) fn place_all(skeleton: &Skeleton, moment: Moment<'_>, out: &mut Vec<Place>) {
    out.clear();
    for id in skeleton.ids() {
        let (rotation, translation) = moment.local(skeleton, id);
        let local = Place {
            rotation: rotation.as_dquat().normalize(),
            translation: translation.as_dvec3(),
        };
        let place = match skeleton.joint(id).parent {
            Some(parent) => out[parent.index()].after(&local),
            None => local,
        };
        out.push(place);
    }
    debug_assert_eq!(out.len(), skeleton.len());
}

/// Total length of the bones that start at each joint, in the rest pose, in metres.
pub(super) fn bone_lengths(skeleton: &Skeleton) -> Vec<f64> {
    let mut lengths = vec![0.0; skeleton.len()];
    for joint in skeleton.joints() {
        if let Some(JointId(parent)) = joint.parent {
            lengths[usize::from(parent)] += f64::from(joint.offset.length());
        }
    }
    lengths
}
