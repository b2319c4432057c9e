use super::clip_times::{ClipRange, FrameKeys};
use super::key_bank::{KeyBank, TrackPlaces};
use super::level_clips::LevelClips;
use super::tracks::{Tracks, count_keys};
use crate::anim::{Clip, ClipId, JointId, Skeleton};
use crate::crowd::error::{CrowdError, MOST_MOTIONS};
use crate::lod::{Level, LevelId, LevelMotion};

/// The clips of one skeleton that a crowd can play, on each of its levels, in the form that the kernels read. It is
/// immutable; share it by reference count.
#[derive(Clone, Debug)]
pub struct AnimationSet {
    /// The keys of all clips and levels.
    pub(crate) keys: KeyBank,
    /// The joints of each level, and where their keys are; one entry for each level.
    pub(crate) banks: Vec<LevelClips>,
    pub(crate) ranges: Vec<ClipRange>,
    /// Duration of each clip, in seconds.
    durations: Vec<f32>,
}

impl AnimationSet {
    /// Largest number of clips times levels.
    pub const MOST_MOTIONS: usize = MOST_MOTIONS;

    /// All clips on all levels. Rotations and positions are stored as 16-bit numbers: for bodies of human size a joint is
    /// within 0.2 mm of where slerp in double precision has it.
    ///
    /// # Errors
    /// No clip, no level, too many of both, or a clip or a level of another skeleton.
    pub fn new(skeleton: &Skeleton, clips: &[Clip], levels: &[Level]) -> Result<Self, CrowdError> {
        if levels.is_empty() {
            return Err(CrowdError::NoLevel);
        }
        if clips.len().saturating_mul(levels.len()) > Self::MOST_MOTIONS {
            let (clips, levels) = (clips.len(), levels.len());
            return Err(CrowdError::TooManyMotions { clips, levels });
        }
        if clips.is_empty() {
            return Err(CrowdError::NoClip);
        }
        let mut tracks = Tracks::new(levels, clips.len());
        let mut frames = FrameKeys::default();
        let mut ranges: Vec<ClipRange> = Vec::with_capacity(clips.len());
        for (index, clip) in clips.iter().enumerate() {
            let motions = levels
                .iter()
                .map(|level| LevelMotion::new(skeleton, clip, level));
            let motions: Vec<LevelMotion> = motions.collect::<Result<_, _>>()?;
            // All levels have equally many keys, so that a moment has the same number on all of them.
            let mut keys_of_frames = vec![1; clip.frames() - 1];
            for motion in &motions {
                count_keys(motion, &mut keys_of_frames);
            }
            for (level, motion) in motions.iter().enumerate() {
                tracks.add(level, index, motion, &keys_of_frames);
            }
            frames.add(&keys_of_frames);
            let range = ClipRange::after(ranges.last(), &keys_of_frames, clip.frame_rate());
            ranges.push(range);
        }
        tracks.store_places();
        let places = TrackPlaces::new(&tracks);
        let keys = KeyBank::new(&tracks, &ranges, &places, frames);
        if keys.rows.len() > u32::MAX as usize {
            return Err(CrowdError::TooManyKeys);
        }
        let bank = |number| LevelClips::new(levels, number, &tracks, &places);
        let durations = clips.iter().map(|clip| clip.duration() as f32);
        Ok(Self {
            keys,
            banks: (0..levels.len()).map(bank).collect(),
            ranges,
            durations: durations.collect(),
        })
    }

    /// The joints of a level in the order in which they are written: parents first, breadth-first. It is not the skeleton's
    /// order. A level beyond the last is the last one.
    pub fn joint_ids(&self, level: LevelId) -> &[JointId] {
        &self.bank(level).kept
    }

    /// For each joint of the skeleton, in its order, the index of the joint that draws it on a level: its own while it is
    /// kept, else the one that carries it. For [`PoseSlice::copy_joints`](crate::crowd::PoseSlice::copy_joints).
    pub fn skeleton_order(&self, level: LevelId) -> &[u16] {
        &self.bank(level).carriers
    }

    /// Number of clips.
    pub fn clips(&self) -> usize {
        self.durations.len()
    }

    /// Number of levels.
    pub fn levels(&self) -> usize {
        self.banks.len()
    }

    /// Number of joints that a level keeps. A level beyond the last is the last one.
    pub fn joints(&self, level: LevelId) -> usize {
        self.bank(level).joints.len()
    }

    fn bank(&self, level: LevelId) -> &LevelClips {
        &self.banks[level.min(self.last()).index()]
    }

    pub(crate) fn last(&self) -> LevelId {
        LevelId((self.banks.len() - 1) as u16)
    }

    pub(crate) fn range(&self, clip: ClipId) -> &ClipRange {
        &self.ranges[clip.index()]
    }

    /// Time from the first frame of a clip to its last, in seconds; `None` where there is no such clip.
    pub fn duration(&self, clip: ClipId) -> Option<f32> {
        self.durations.get(clip.index()).copied()
    }

    /// Size of all keys, in bytes.
    pub fn bytes(&self) -> usize {
        self.keys.bytes()
    }
}
