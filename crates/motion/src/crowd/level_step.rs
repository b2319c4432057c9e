//! Steps that make a level look like a coarser one: removed joints are moved to where kept ones carry them.
//!
//! This goes beyond Hasegawa, Nishio & Kobori, who leave the jumps between levels to future work (their 4.2): see
//! `lod::blend`. A group may contain characters of several levels. It is posed on the finest of them. For a character of a
//! coarser level, some steps are applied to that pose, the last one in part.

use glam::{Quat, Vec3};

use crate::anim::JointId;
use crate::lod::Level;

/// The joints that are removed from one level to the next, as joints of the level that is posed.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct LevelStep {
    pub(super) removed: Vec<RemovedJoint>,
}

/// A removed joint, and its carrier on the coarser level, as indices into the posed level's joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RemovedJoint {
    pub(super) joint: u16,
    pub(super) carrier: u16,
    /// The joint's rotation in the carrier's frame.
    pub(super) turn: Quat,
    pub(super) place: Vec3,
}

/// The steps from each level to the levels after it, one list for each level.
pub(super) fn steps(levels: &[Level]) -> Vec<Vec<LevelStep>> {
    let after = |posed: usize| {
        let pairs = levels[posed..].windows(2);
        pairs.map(move |pair| step(&levels[posed], &pair[0], &pair[1]))
    };
    (0..levels.len())
        .map(|posed| after(posed).collect())
        .collect()
}

fn step(posed: &Level, finer: &Level, coarser: &Level) -> LevelStep {
    let index = |joint: JointId| Some(posed.index_of(joint)? as u16);
    let gone = |&&joint: &&JointId| coarser.index_of(joint).is_none();
    let removed = |&joint: &JointId| {
        let attachment = coarser.attachments.get(joint.index())?;
        let carrier = *coarser.kept.get(usize::from(attachment.carrier))?;
        Some(RemovedJoint {
            joint: index(joint)?,
            carrier: index(carrier)?,
            turn: attachment.offset.rotation,
            place: attachment.offset.translation,
        })
    };
    LevelStep {
        removed: finer.kept.iter().filter(gone).filter_map(removed).collect(),
    }
}
