use thiserror::Error;

use super::bank::{Bank, Span};
use super::character::{ClipId, LevelId};
use crate::anim::{Clip, Skeleton};
use crate::lod::{Level, LevelMotion, LodError, rehang};

/// What a crowd can play: clips of one skeleton on each of its levels, as the kernels read them.
/// Immutable once made; share it by reference count.
#[derive(Clone, Debug)]
pub struct Repertoire {
    pub(super) banks: Vec<Bank>,
    /// Seconds of each clip.
    durations: Vec<f32>,
}

/// Why clips and levels make no repertoire.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RepertoireError {
    /// There is no clip.
    #[error("a crowd needs at least one clip")]
    NoClip,
    /// There is no level.
    #[error("a crowd needs at least one level")]
    NoLevel,
    /// A clip or a level is not of the skeleton.
    #[error(transparent)]
    Lod(#[from] LodError),
    /// The clips' joints do not hang alike.
    #[error("the motions of one level differ in their joints")]
    Differ,
    /// More than [`Repertoire::MOST_MOTIONS`].
    #[error("{clips} clips on {levels} levels are more than {max} motions", max = Repertoire::MOST_MOTIONS)]
    TooMany {
        /// How many clips.
        clips: usize,
        /// How many levels.
        levels: usize,
    },
    /// More than 2^31 words, which is as far as a lane counts.
    #[error("the clips of one level take more than 8 GiB")]
    TooLarge,
}

impl Repertoire {
    /// Clips times levels may not be more.
    pub const MOST_MOTIONS: usize = 1 << 19;

    /// All clips on all levels. Rotations become 16-bit numbers: a joint is then within 0.2 mm of
    /// where slerp in double precision has it, for bodies of human size.
    ///
    /// # Errors
    /// No clip, no level, or what does not belong together.
    pub fn new(
        skeleton: &Skeleton,
        clips: &[Clip],
        levels: &[Level],
    ) -> Result<Self, RepertoireError> {
        if levels.is_empty() {
            return Err(RepertoireError::NoLevel);
        }
        if clips.len().saturating_mul(levels.len()) > Self::MOST_MOTIONS {
            return Err(RepertoireError::TooMany {
                clips: clips.len(),
                levels: levels.len(),
            });
        }
        let bank = |level| {
            let motions: Vec<LevelMotion> = clips
                .iter()
                .map(|clip| rehang(skeleton, clip, level))
                .collect::<Result<_, _>>()?;
            Bank::new(&motions)
        };
        let banks = levels.iter().map(bank).collect::<Result<_, _>>()?;
        Ok(Self {
            banks,
            durations: clips.iter().map(|clip| clip.duration() as f32).collect(),
        })
    }

    /// How many clips.
    #[must_use]
    pub fn clips(&self) -> usize {
        self.durations.len()
    }

    /// How many levels.
    #[must_use]
    pub fn levels(&self) -> usize {
        self.banks.len()
    }

    /// How many joints a level keeps. A level beyond the last is the last one.
    #[must_use]
    pub fn joints(&self, level: LevelId) -> usize {
        self.banks[self.clamp(level).index()].joints.len()
    }

    /// The level that is played for `level`.
    pub(super) fn clamp(&self, level: LevelId) -> LevelId {
        LevelId(level.0.min((self.banks.len() - 1) as u16))
    }

    pub(super) fn span(&self, clip: ClipId, level: LevelId) -> &Span {
        &self.banks[level.index()].spans[clip.index()]
    }

    /// From the first frame of a clip to its last, seconds; `None` where there is no such clip.
    #[must_use]
    pub fn duration(&self, clip: ClipId) -> Option<f32> {
        self.durations.get(clip.index()).copied()
    }

    /// Bytes of all keys.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.banks
            .iter()
            .map(|bank| size_of_val(bank.words.as_slice()))
            .sum()
    }
}
