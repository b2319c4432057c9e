use thiserror::Error;

use super::slot;
use crate::lod::LodError;

/// Why animations cannot be made, a character was not added or changed, or was not posed.
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
    /// More than [`AnimationSet::MOST_MOTIONS`](super::AnimationSet::MOST_MOTIONS).
    #[error("{clips} clips on {levels} levels are more than {max} motions", max = slot::MOST_MOTIONS)]
    TooManyMotions {
        /// How many clips.
        clips: usize,
        /// How many levels.
        levels: usize,
    },
    /// The keys of all clips take more than 2^32 units of 16 bytes.
    #[error("the keys of all clips take more than 64 GiB")]
    TooManyKeys,
    /// A clip that the animations do not have.
    #[error("there is no clip {clip}: the animations have {clips}")]
    NoSuchClip {
        /// The clip.
        clip: u32,
        /// How many there are.
        clips: usize,
    },
    /// A clip that is no additive layer, as a layer.
    #[error("clip {clip} is no additive layer")]
    NotALayer {
        /// The clip.
        clip: u32,
    },
    /// An additive layer in place of a clip.
    #[error("clip {clip} is an additive layer and can only be added to others")]
    IsALayer {
        /// The clip.
        clip: u32,
    },
    /// A character that the crowd does not have.
    #[error("there is no character {id}: the crowd has {characters}")]
    NoSuchCharacter {
        /// The character.
        id: u32,
        /// How many there are.
        characters: usize,
    },
    /// A character that the last frame found outside the frustum.
    #[error("character {id} is outside the frustum and was not posed")]
    NotVisible {
        /// The character.
        id: u32,
    },
    /// The crowd is full.
    #[error("a crowd has {max} characters at most", max = slot::MOST)]
    Full,
    /// The memory for the poses is too small; nothing was written.
    #[error("the poses take {needed} lines of 64 bytes, the memory has {found}")]
    TooSmall {
        /// Lines that are needed.
        needed: usize,
        /// Lines that are there.
        found: usize,
    },
}
