//! Groups of one kind, and characters that are in no group.

use std::ops::Range;

use super::character::CharacterState;
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

/// What is mixed into a clip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Mix {
    /// A second clip.
    pub(super) fades: bool,
    /// An additive layer.
    pub(super) is_layered: bool,
}

impl Mix {
    /// Number of combinations.
    pub(super) const COUNT: usize = 4;

    /// Each combination by its index.
    pub(super) fn all() -> impl Iterator<Item = Self> {
        (0..Self::COUNT).map(Self::of)
    }

    /// The combination of an index.
    pub(super) fn of(index: usize) -> Self {
        Self {
            fades: index & 1 != 0,
            is_layered: index & 2 != 0,
        }
    }

    pub(super) fn index(self) -> usize {
        usize::from(self.fades) + 2 * usize::from(self.is_layered)
    }

    /// Whether nothing is mixed in.
    pub(super) fn is_none(self) -> bool {
        self == Self::default()
    }

    /// Whether characters with less mixed in can be posed so, too.
    fn covers(self, other: Self) -> bool {
        self.index() & other.index() == other.index()
    }
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
