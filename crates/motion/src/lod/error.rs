use thiserror::Error;

use crate::anim::ClipError;

/// Errors of levels of detail.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LodError {
    /// A joint to be removed is the root, unknown, or already removed.
    #[error("joint {0} cannot be removed: it is the root, unknown, or removed already")]
    NotRemovable(u16),
    /// A clip belongs to another skeleton.
    #[error("clip \"{clip}\" has {found} joints, and the skeleton has {expected}")]
    Joints {
        /// Name of the clip.
        clip: String,
        /// Joints of the clip.
        found: usize,
        /// Joints of the skeleton.
        expected: usize,
    },
    /// A level belongs to another skeleton.
    #[error("the level keeps joint {0}, which the skeleton does not have")]
    Level(u16),
    /// The result is not a valid clip, usually because positions are out of range.
    #[error(transparent)]
    Clip(#[from] ClipError),
    /// No clip was given.
    #[error("levels of detail need at least one clip")]
    NoClips,
    /// The clips and the skeleton are too large; building levels would take hours.
    #[error(
        "levels of detail of {joints} joints in {frames} frames: {} joints are the most, and joints times joints times frames is {product}, of at most {}",
        super::LevelSettings::MOST_JOINTS,
        super::LevelSettings::MOST_WORK
    )]
    TooMuch {
        /// Joints of the skeleton.
        joints: usize,
        /// Frames of all clips.
        frames: usize,
        /// Joints times joints times frames.
        product: u64,
    },
    /// A joint's mass is negative or not finite.
    #[error("joint \"{joint}\": a mass of {kilograms} kg is not possible")]
    Mass {
        /// Name of the joint.
        joint: String,
        /// Mass of the joint, in kilograms.
        kilograms: f32,
    },
    /// The number of masses is not the number of joints.
    #[error("{found} masses for {expected} joints")]
    Masses {
        /// Number given.
        found: usize,
        /// Joints of the skeleton.
        expected: usize,
    },
    /// A setting is out of range.
    #[error("{setting}: {value} is not possible; it must be {must}")]
    Setting {
        /// Name of the setting.
        setting: &'static str,
        /// Value of the setting.
        value: f32,
        /// Valid range.
        must: &'static str,
    },
    /// A setting names a joint that the skeleton does not have.
    #[error("the skeleton has no joint {0}")]
    UnknownJoint(u16),
}

impl LodError {
    pub(super) fn setting(setting: &'static str, value: f32, must: &'static str) -> Self {
        Self::Setting {
            setting,
            value,
            must,
        }
    }
}
