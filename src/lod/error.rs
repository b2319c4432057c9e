use thiserror::Error;

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
}
