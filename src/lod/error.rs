use thiserror::Error;

use crate::anim::ClipError;

/// Why there are no levels of this skeleton and these clips.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LodError {
    /// A joint is removed that is none of the skeleton, that is its root, or that is gone already.
    #[error("joint {0} cannot be removed: it is the root, not there, or removed already")]
    NotRemovable(u16),
    /// A clip is not of this skeleton.
    #[error("clip \"{clip}\" has {found} joints, and the skeleton has {expected}")]
    Joints {
        /// Name of the clip.
        clip: String,
        /// Joints of the clip.
        found: usize,
        /// Joints of the skeleton.
        expected: usize,
    },
    /// A level is not of this skeleton.
    #[error("the level keeps joint {0}, which the skeleton does not have")]
    Level(u16),
    /// What is drawn is no clip: as a rule, places out of all range.
    #[error(transparent)]
    Clip(#[from] ClipError),
    /// No clip was given.
    #[error("levels of detail need a clip at least")]
    NoClips,
    /// The clips and the skeleton are too large: levels would take hours.
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
    /// A total mass that is negative, NaN or infinite.
    #[error("a mass of {0} kg is not possible")]
    TotalMass(f32),
    /// A joint's mass is negative, NaN or infinite.
    #[error("joint \"{joint}\": a mass of {kilograms} kg is not possible")]
    Mass {
        /// Name of the joint.
        joint: String,
        /// Its mass.
        kilograms: f32,
    },
    /// Not one mass for each joint.
    #[error("{found} masses for {expected} joints")]
    Masses {
        /// How many were given.
        found: usize,
        /// Joints of the skeleton.
        expected: usize,
    },
    /// A setting is outside of what makes sense.
    #[error("{setting}: {value} is not possible; it must be {must}")]
    Setting {
        /// Which.
        setting: &'static str,
        /// Its value.
        value: f32,
        /// What it must be.
        must: &'static str,
    },
    /// A joint is to stay that the skeleton does not have.
    #[error("the skeleton has no joint {0}")]
    UnknownJoint(u16),
    /// Not one inverse bind for each joint.
    #[error("{found} inverse binds for {expected} joints")]
    Binds {
        /// How many were given.
        found: usize,
        /// Joints of the skeleton.
        expected: usize,
    },
}
