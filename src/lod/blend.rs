//! One joint goes: between two neighbouring levels it is blended from its motion to where it is drawn without it.
//!
//! Hasegawa, Nishio & Kobori leave it to future work (4.2: a bent joint that is removed becomes straight). All other joints
//! are where they were, and what rides on the joint goes with it; so this one matrix makes the whole difference, and it
//! is blended after the finer level was posed: nothing hangs on it that could be dragged along.

use glam::Affine3A;

use super::{LevelId, Levels};
use crate::anim::JointTransform;

/// What makes a level look like the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blend {
    /// The joint that the next level has not, as an index into the finer level's [`super::Level::kept`].
    pub joint: u16,
    /// The joint that it rides on there, as an index into the finer level's `kept`.
    pub carrier: u16,
    /// Where it rides, in the carrier's frame.
    pub offset: JointTransform,
}

impl Levels {
    /// From a level to the next; `None` for the last one.
    #[must_use]
    pub fn blend(&self, level: LevelId) -> Option<Blend> {
        let (finer, coarser) = (
            self.levels.get(level.index())?,
            self.levels.get(level.index() + 1)?,
        );
        let removed = coarser.removed?;
        let seat = coarser.seats.get(removed.index())?;
        let carrier = *coarser.kept.get(usize::from(seat.carrier))?;
        Some(Blend {
            joint: finer.index_of(removed)? as u16,
            carrier: finer.index_of(carrier)? as u16,
            offset: seat.offset,
        })
    }
}

impl Blend {
    /// Blends the joint's matrix among those of the finer level, in the space of the motion: 0 leaves it, 1 makes it ride. Every point goes in a straight
    /// line, at a speed that is as even as the weight's.
    pub fn apply(&self, weight: f32, matrices: &mut [Affine3A]) {
        let carrier = matrices[usize::from(self.carrier)];
        let riding = carrier * affine(&self.offset);
        let joint = &mut matrices[usize::from(self.joint)];
        let (from, to) = (joint.matrix3, riding.matrix3);
        joint.matrix3 = from * (1.0 - weight) + to * weight;
        joint.translation += (riding.translation - joint.translation) * weight;
    }
}

/// A joint's frame as a matrix.
#[must_use]
pub fn affine(transform: &JointTransform) -> Affine3A {
    Affine3A::from_rotation_translation(transform.rotation, transform.translation)
}
