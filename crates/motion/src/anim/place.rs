//! Joints in model space in double precision.

use glam::{DQuat, DVec3};

use super::{Moment, Skeleton};

/// A joint's transform in model space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    pub(crate) rotation: DQuat,
    pub(crate) translation: DVec3,
}

impl Place {
    pub(crate) const IDENTITY: Self = Self {
        rotation: DQuat::IDENTITY,
        translation: DVec3::ZERO,
    };

    #[inline]
    pub(crate) fn point(&self, local: DVec3) -> DVec3 {
        self.rotation * local + self.translation
    }

    /// The concatenation of two transforms; `inner` is applied first.
    #[inline]
    pub(crate) fn after(&self, inner: &Self) -> Self {
        Self {
            rotation: (self.rotation * inner.rotation).normalize(),
            translation: self.point(inner.translation),
        }
    }

    /// `other` in the frame of `self`.
    #[inline]
    pub(crate) fn sees(&self, other: &Self) -> Self {
        let back = self.rotation.conjugate();
        Self {
            rotation: (back * other.rotation).normalize(),
            translation: back * (other.translation - self.translation),
        }
    }
}

/// Writes the transforms of all joints at a moment of a clip to `out`.
pub(crate) fn place_all(skeleton: &Skeleton, moment: Moment<'_>, out: &mut Vec<Place>) {
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
