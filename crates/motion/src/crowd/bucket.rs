//! Groups of one kind, and characters that are in no group.

use std::ops::Range;

use super::character::CharacterState;
use super::mix::Mix;
use crate::anim::ClipId;
use crate::lod::LevelId;
use crate::math::F32x16;

/// The properties that all characters of a group share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct GroupKind {
    /// The finest level that a character of the group needs.
    pub(super) level: LevelId,
    /// The clip of all characters if they are near each other in time, else `None`.
    pub(super) near: Option<ClipId>,
    pub(super) mix: Mix,
}

/// Consecutive groups of one level and mixture, whatever their clips.
#[derive(Clone, Debug)]
pub(super) struct Bucket {
    pub(super) level: LevelId,
    pub(super) mix: Mix,
    pub(super) groups: Range<usize>,
    pub(super) offset: usize,
    /// Number of [`F32x16`]s of each group in the output.
    pub(super) lines: usize,
}

impl GroupKind {
    /// Whether a character can be in a group of this kind.
    pub(super) fn takes(self, state: &CharacterState) -> bool {
        self.level <= state.level()
            && self.near.is_none_or(|clip| clip == state.clip)
            && self.mix.covers(state.mix)
    }
}

/// Consecutive groups of one bucket that belong to one chunk.
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
    /// Numbers of the characters; `Group::NOBODY` for unused lanes.
    pub(super) ids: [u32; F32x16::LANES],
}
