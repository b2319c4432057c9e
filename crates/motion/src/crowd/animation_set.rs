use glam::Vec3;

use super::animation_set_desc::AnimationSetDesc;
use super::clip_range::ClipRange;
use super::error::CrowdError;
use super::frame_keys::FrameKeys;
use super::key_bank::{KeyBank, TrackPlaces};
use super::level_clips::{LevelClips, Stored};
use super::level_step::{LevelStep, steps};
use super::quantise::count_keys;
use super::slot;
use super::tracks::{MotionKeys, Tracks};
use crate::anim::{Clip, ClipId, JointId, Skeleton};
use crate::lod::{Level, LevelId, LevelMotion, LevelTrack, Levels, Translations};

/// The clips of one skeleton that a crowd can play, on each of its levels, in the form that the kernels read. It is
/// immutable; share it by reference count.
#[derive(Clone, Debug)]
pub struct AnimationSet {
    /// The keys of all clips and levels.
    pub(super) keys: KeyBank,
    /// The joints of each level, and where their keys are; one entry for each level.
    pub(super) banks: Vec<LevelClips>,
    /// Steps from each level to the levels after it; one list for each level.
    pub(super) steps: Vec<Vec<LevelStep>>,
    /// Range of keys of each clip, then of each additive layer.
    pub(super) ranges: Vec<ClipRange>,
    /// Number of clips, which come before the additive layers.
    clips: usize,
    /// Duration of each clip and layer, in seconds.
    durations: Vec<f32>,
    /// The joints of each level.
    kept: Vec<Vec<JointId>>,
    /// For each level, the index of the joint that draws each joint of the skeleton.
    carriers: Vec<Vec<u16>>,
}

/// Converts a motion to its differences from its first frame.
fn additive(motion: LevelMotion) -> LevelMotion {
    let tracks = motion.tracks.into_iter().map(|track| {
        let (turn, place) = (track.rotations[0].inverse(), track.translations.at(0));
        let translations = match track.translations {
            Translations::Fixed(_) => Translations::Fixed(Vec3::ZERO),
            Translations::Moving(places) => {
                Translations::Moving(places.into_iter().map(|at| at - place).collect())
            }
        };
        let rotations = track.rotations.into_iter();
        LevelTrack {
            rotations: rotations.map(|rotation| turn * rotation).collect(),
            translations,
        }
    });
    LevelMotion {
        tracks: tracks.collect(),
        ..motion
    }
}

impl AnimationSet {
    /// Largest number of clips times levels.
    pub const MOST_MOTIONS: usize = slot::MOST_MOTIONS;

    /// Builds the animations of clips without additive layers: see [`AnimationSet::build`].
    ///
    /// # Errors
    /// The errors of [`AnimationSet::build`].
    pub fn new(skeleton: &Skeleton, clips: &[Clip], levels: &[Level]) -> Result<Self, CrowdError> {
        Self::build(&AnimationSetDesc {
            skeleton,
            clips,
            layers: &[],
            levels,
        })
    }

    /// All clips and layers on all levels. Rotations and positions are stored as 16-bit numbers: for bodies of human size a
    /// joint is within 0.2 mm of where slerp in double precision has it.
    ///
    /// # Errors
    /// No clip, no level, or a clip or a level of another skeleton.
    pub fn build(desc: &AnimationSetDesc<'_>) -> Result<Self, CrowdError> {
        desc.check()?;
        let AnimationSetDesc {
            skeleton,
            clips,
            layers,
            levels,
        } = *desc;
        let mut tracks = Tracks::new(desc);
        let mut frames = FrameKeys::default();
        let mut ranges: Vec<ClipRange> = Vec::with_capacity(clips.len() + layers.len());
        for (index, clip) in clips.iter().chain(layers).enumerate() {
            let motions = levels
                .iter()
                .map(|level| LevelMotion::new(skeleton, clip, level));
            let mut motions: Vec<LevelMotion> = motions.collect::<Result<_, _>>()?;
            if index >= clips.len() {
                motions = motions.into_iter().map(additive).collect();
            }
            // All levels have equally many keys, so that a moment has the same number on all of them.
            let mut keys_of_frames = vec![1; clip.frames() - 1];
            for motion in &motions {
                count_keys(motion, &mut keys_of_frames);
            }
            for (level, motion) in motions.iter().enumerate() {
                let keys_of_frames = &keys_of_frames;
                tracks.add(
                    level,
                    index,
                    &MotionKeys {
                        motion,
                        keys_of_frames,
                    },
                );
            }
            frames.add(&keys_of_frames);
            let range = ClipRange::after(ranges.last(), &keys_of_frames, clip.frame_rate());
            ranges.push(range);
        }
        tracks.store_places();
        let places = TrackPlaces::new(&tracks);
        let keys = KeyBank::new(&tracks, &ranges, &places).with_frames(frames);
        if keys.rows.len() > u32::MAX as usize {
            return Err(CrowdError::TooManyKeys);
        }
        let stored = Stored {
            tracks: &tracks,
            places: &places,
        };
        let banks = levels.iter().enumerate();
        let banks = banks.map(|(number, level)| LevelClips::new(level, number, stored));
        let durations = clips.iter().chain(layers);
        Ok(Self {
            keys,
            banks: banks.collect(),
            steps: steps(levels),
            ranges,
            clips: clips.len(),
            durations: durations.map(|clip| clip.duration() as f32).collect(),
            kept: levels.iter().map(|level| level.kept.clone()).collect(),
            carriers: levels.iter().map(carriers).collect(),
        })
    }

    /// All clips with all joints: for crowds without levels of detail.
    ///
    /// # Errors
    /// No clip, or one of another skeleton.
    pub fn without_levels(skeleton: &Skeleton, clips: &[Clip]) -> Result<Self, CrowdError> {
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

    /// Number of clips, without additive layers.
    #[must_use]
    pub fn clips(&self) -> usize {
        self.clips
    }

    /// Number of additive layers.
    #[must_use]
    pub fn layers(&self) -> usize {
        self.durations.len() - self.clips
    }

    /// The id of an additive layer, for [`Character::layer`](super::Character::layer), by its index in
    /// [`AnimationSetDesc::layers`]; `None` where there is no such layer.
    #[must_use]
    pub fn layer(&self, index: usize) -> Option<ClipId> {
        (index < self.layers()).then(|| ClipId((self.clips + index) as u32))
    }

    /// Number of levels.
    #[must_use]
    pub fn levels(&self) -> usize {
        self.banks.len()
    }

    /// Number of joints that a level keeps. A level beyond the last is the last one.
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

    /// Time from the first frame of a clip to its last, in seconds; `None` where there is no such clip.
    #[must_use]
    pub fn duration(&self, clip: ClipId) -> Option<f32> {
        self.durations.get(clip.index()).copied()
    }

    /// Size of all keys, in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.keys.bytes()
    }
}

fn carriers(level: &Level) -> Vec<u16> {
    level
        .attachments
        .iter()
        .map(|attachment| attachment.carrier)
        .collect()
}
