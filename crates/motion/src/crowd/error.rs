use thiserror::Error;

use crate::lod::LodError;

/// Maximum number of characters of a crowd.
pub(super) const MOST_CHARACTERS: usize = (1 << 28) - 1;

/// Maximum number of clips times levels.
pub(super) const MOST_MOTIONS: usize = 1 << 19;

/// Reason why animations cannot be built, or why a character cannot be added, changed or posed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum CrowdError {
    /// There is no clip.
    #[error("a crowd needs at least one clip")]
    NoClip,
    /// There is no level.
    #[error("a crowd needs at least one level")]
    NoLevel,
    /// A clip or a level does not belong to the skeleton.
    #[error(transparent)]
    Lod(#[from] LodError),
    /// There are more clips times levels than [`AnimationSet::MOST_MOTIONS`](super::AnimationSet::MOST_MOTIONS).
    #[error("{clips} clips on {levels} levels are more than {max} motions", max = MOST_MOTIONS)]
    TooManyMotions {
        /// Number of clips.
        clips: usize,
        /// Number of levels.
        levels: usize,
    },
    /// The keys of all clips take more than 2^32 units of 16 bytes.
    #[error("the keys of all clips take more than 64 GiB")]
    TooManyKeys,
    /// The animations have no clip of this id.
    #[error("there is no clip {clip}: the animations have {clips}")]
    NoSuchClip {
        /// Id of the clip.
        clip: u32,
        /// Number of clips of the animations.
        clips: usize,
    },
    /// The crowd has no character of this number.
    #[error("there is no character {id}: the crowd has {characters}")]
    NoSuchCharacter {
        /// Number of the character.
        id: u32,
        /// Number of characters of the crowd.
        characters: usize,
    },
    /// The crowd is full.
    #[error("a crowd has {max} characters at most", max = MOST_CHARACTERS)]
    Full,
    /// The memory for the poses is too small; nothing was written.
    #[error("the poses take {needed} lines of 64 bytes, the memory has {found}")]
    TooSmall {
        /// Length that is needed, in [`F32x16`](crate::math::F32x16)s.
        needed: usize,
        /// Length that was given, in [`F32x16`](crate::math::F32x16)s.
        found: usize,
    },
}
