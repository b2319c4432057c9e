use thiserror::Error;

use super::character::ClipId;
use super::level_clips::{ClipRange, LevelClips};
use super::level_step::{LevelStep, steps};
use super::quantise::{keys_per_frame, quantise};
use crate::anim::{Clip, JointId, Skeleton};
use crate::lod::{Level, LevelId, LevelMotion, Levels, LodError, rehang};

/// What a crowd can play: clips of one skeleton on each of its levels, as the kernels read them.
/// Immutable once made; share it by reference count.
#[derive(Clone, Debug)]
pub struct AnimationSet {
    pub(super) banks: Vec<LevelClips>,
    /// Of each level, what makes it look like the ones after it: one step for each of those.
    pub(super) steps: Vec<Vec<LevelStep>>,
    /// One for each clip.
    pub(super) ranges: Vec<ClipRange>,
    /// Seconds of each clip.
    durations: Vec<f32>,
    /// The joints of each level.
    kept: Vec<Vec<JointId>>,
    /// Of each level, the joint that draws each joint of the skeleton.
    carriers: Vec<Vec<u16>>,
}

/// Why clips and levels make no animations.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum AnimationSetError {
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
    /// More than [`AnimationSet::MOST_MOTIONS`].
    #[error("{clips} clips on {levels} levels are more than {max} motions", max = AnimationSet::MOST_MOTIONS)]
    TooMany {
        /// How many clips.
        clips: usize,
        /// How many levels.
        levels: usize,
    },
    /// More than 2^32 lines, which is as far as a lane counts.
    #[error("the clips of one level take more than 256 GiB")]
    TooLarge,
}

impl AnimationSet {
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
    ) -> Result<Self, AnimationSetError> {
        if levels.is_empty() {
            return Err(AnimationSetError::NoLevel);
        }
        if clips.len().saturating_mul(levels.len()) > Self::MOST_MOTIONS {
            return Err(AnimationSetError::TooMany {
                clips: clips.len(),
                levels: levels.len(),
            });
        }
        // As many keys on every level, so that a moment is the same number on all of them.
        let mut per_frame = vec![1; clips.len()];
        for level in levels {
            for (clip, most) in clips.iter().zip(&mut per_frame) {
                *most = keys_per_frame(&rehang(skeleton, clip, level)?).max(*most);
            }
        }
        let mut ranges: Vec<ClipRange> = Vec::with_capacity(clips.len());
        let mut banks = Vec::with_capacity(levels.len());
        for level in levels {
            let motions = clips.iter().map(|clip| rehang(skeleton, clip, level));
            let motions: Vec<LevelMotion> = motions.collect::<Result<_, _>>()?;
            if ranges.is_empty() {
                for ((motion, clip), &per_frame) in motions.iter().zip(clips).zip(&per_frame) {
                    let rates = (clip.frame_rate(), per_frame);
                    ranges.push(ClipRange::after(ranges.last(), motion, rates));
                }
            }
            let pairs = motions.iter().zip(&per_frame);
            let keys: Vec<_> = pairs.map(|(motion, &per)| quantise(motion, per)).collect();
            banks.push(LevelClips::new(&motions, &keys, &ranges)?);
        }
        Ok(Self {
            banks,
            steps: steps(levels),
            ranges,
            durations: clips.iter().map(|clip| clip.duration() as f32).collect(),
            kept: levels.iter().map(|level| level.kept.clone()).collect(),
            carriers: levels.iter().map(carriers).collect(),
        })
    }

    /// All clips with all joints: for crowds without levels of detail.
    ///
    /// # Errors
    /// No clip, or one of another skeleton.
    pub fn without_levels(skeleton: &Skeleton, clips: &[Clip]) -> Result<Self, AnimationSetError> {
        let levels = Levels::in_order(skeleton, &[])?;
        Self::new(skeleton, clips, &levels.levels)
    }

    /// The joints of a level in the order in which they are written: parents first, breadth-first. It is not the skeleton's
    /// order. A level beyond the last is the last one.
    #[must_use]
    pub fn joint_ids(&self, level: LevelId) -> &[JointId] {
        &self.kept[self.clamp(level).index()]
    }

    /// For each joint of the skeleton, in its order, the index of the joint that draws it on a level: its own while it is
    /// kept, else the one that carries it. For [`PoseSlice::copy_joints`](super::PoseSlice::copy_joints).
    #[must_use]
    pub fn skeleton_order(&self, level: LevelId) -> &[u16] {
        &self.carriers[self.clamp(level).index()]
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
        level.min(self.last())
    }

    /// The coarsest level.
    pub(super) fn last(&self) -> LevelId {
        LevelId((self.banks.len() - 1) as u16)
    }

    pub(super) fn range(&self, clip: ClipId) -> &ClipRange {
        &self.ranges[clip.index()]
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
            .map(|bank| size_of_val(&*bank.words) + size_of_val(&*bank.rows))
            .sum()
    }
}

fn carriers(level: &Level) -> Vec<u16> {
    level.seats.iter().map(|seat| seat.carrier).collect()
}
