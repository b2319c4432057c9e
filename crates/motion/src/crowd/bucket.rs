//! Groups of one kind, and characters that are in no group.

use std::ops::Range;

use super::character::CharacterState;
use super::mix::Mix;
use crate::anim::ClipId;
use crate::lod::LevelId;
use crate::math::F32x16;

/// How a group is posed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct GroupKind {
    /// The finest level that one of its characters needs.
    pub(super) level: LevelId,
    /// The clip of all characters, where they are near each other in time.
    pub(super) near: Option<ClipId>,
    pub(super) mix: Mix,
}

/// Groups of one level and mixture that stand together, whatever their clips.
#[derive(Clone, Debug)]
pub(super) struct Bucket {
    pub(super) level: LevelId,
    pub(super) mix: Mix,
    pub(super) groups: Range<usize>,
    pub(super) offset: usize,
    /// Of each group.
    pub(super) lines: usize,
}

impl GroupKind {
    /// Whether a character can be posed so.
    pub(super) fn takes(self, state: &CharacterState) -> bool {
        self.level <= state.level()
            && self.near.is_none_or(|clip| clip == state.clip)
            && self.mix.covers(state.mix)
    }
}

/// Groups of one bucket in one chunk.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub(super) level: LevelId,
    pub(super) mix: Mix,
    pub(super) groups: Range<usize>,
    pub(super) lines: Range<usize>,
}

/// Sixteen characters outside the frustum, which are not posed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parked {
    pub(super) x: F32x16,
    pub(super) y: F32x16,
    pub(super) z: F32x16,
    /// `Group::NOBODY` for lanes that are not used.
    pub(super) ids: [u32; F32x16::LANES],
}
