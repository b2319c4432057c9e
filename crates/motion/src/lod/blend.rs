//! The transition between two neighbouring levels: the joint that the coarser one has lost is blended from its own motion to its
//! attachment.
//!
//! Hasegawa, Nishio & Kobori leave these transitions to future work (4.2: a bent joint becomes straight when it is removed). All other
//! joints are equal on both levels, and joints attached to the removed one follow it. So one matrix is the whole difference. It is
//! blended after the finer level has been posed, when no other joint depends on it.

use glam::Affine3A;

use super::{LevelId, Levels};
use crate::anim::JointTransform;

/// The difference between a level and the next coarser one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blend {
    /// The joint that the coarser level has lost, as an index into the finer level's [`super::Level::kept`].
    pub joint: u16,
    /// The joint that carries it on the coarser level, as an index into the finer level's `kept`.
    pub carrier: u16,
    /// The joint's transform in the carrier's frame.
    pub offset: JointTransform,
}

impl Levels {
    /// The blend from a level to the next coarser one, or `None` for the last level.
    #[must_use]
    #[doc(hidden)]
    pub fn blend(&self, level: LevelId) -> Option<Blend> {
        let (finer, coarser) = (
            self.levels.get(level.index())?,
            self.levels.get(level.index() + 1)?,
        );
        let removed = coarser.removed?;
        let attachment = coarser.attachments.get(removed.index())?;
        let carrier = *coarser.kept.get(usize::from(attachment.carrier))?;
        Some(Blend {
            joint: finer.index_of(removed)? as u16,
            carrier: finer.index_of(carrier)? as u16,
            offset: attachment.offset,
        })
    }
}

impl Blend {
    /// Blends the joint's matrix linearly. `matrices` are those of the finer level, in model space; at weight 0 the joint keeps its own
    /// motion, at 1 it follows the carrier.
    pub fn apply(&self, weight: f32, matrices: &mut [Affine3A]) {
        let carrier = matrices[usize::from(self.carrier)];
        let riding = carrier * affine(&self.offset);
        let joint = &mut matrices[usize::from(self.joint)];
        let (from, to) = (joint.matrix3, riding.matrix3);
        joint.matrix3 = from * (1.0 - weight) + to * weight;
        joint.translation += (riding.translation - joint.translation) * weight;
    }
}

/// Converts a joint's transform to a matrix.
#[must_use]
pub fn affine(transform: &JointTransform) -> Affine3A {
    Affine3A::from_rotation_translation(transform.rotation, transform.translation)
}
