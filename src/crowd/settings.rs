use thiserror::Error;

use super::output::Output;
use super::schedule;
use crate::lod::LevelId;
use crate::math::Isa;

/// How a crowd is posed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrowdSettings {
    /// What is written.
    pub output: Output,
    /// On which registers.
    pub isa: Isa,
    /// How many threads, the caller's counted in; 0 for as many as the machine has. They stay as
    /// long as the crowd.
    pub threads: usize,
    /// Who is not posed in every frame.
    pub hold: Hold,
}

/// Characters of coarse levels keep their pose for some frames, each group of sixteen for others in
/// turn. Whoever poses hands over the same memory again, with what was written.
///
/// A held character is where it was so many frames ago at most: at 1.5 m/s and 60 frames a second
/// 25 mm behind for each of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hold {
    /// Groups that are posed on this level or a coarser one.
    pub from: LevelId,
    /// For how many frames a pose is kept after its own; 0, the default, for none.
    pub frames: u16,
}

impl Default for CrowdSettings {
    /// The widest registers, one thread.
    fn default() -> Self {
        Self {
            output: Output::default(),
            isa: Isa::best(),
            threads: 1,
            hold: Hold::default(),
        }
    }
}

/// Why a character cannot be what it is wanted to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum CrowdError {
    /// A clip that the animations has not.
    #[error("clip {clip} of a animations of {clips}")]
    NoSuchClip {
        /// The clip.
        clip: u16,
        /// How many there are.
        clips: usize,
    },
    /// A character that the crowd has not.
    #[error("character {id} of a crowd of {characters}")]
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
    /// No more can be told apart.
    #[error("a crowd has {max} characters at most", max = schedule::MOST)]
    Full,
}

/// Why a crowd was not posed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum PoseError {
    /// The memory is too small; nothing was written.
    #[error("the poses take {needed} lines of 64 bytes, the memory has {found}")]
    TooSmall {
        /// Lines that are needed.
        needed: usize,
        /// Lines that are there.
        found: usize,
    },
}
