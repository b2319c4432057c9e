//! A joint of one level, and where its keys are.

use super::tracks::Place;

/// The data of a joint that all clips share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LevelJoint {
    /// Index of the parent among the level's joints; `None` for the root alone.
    pub(super) parent: Option<u16>,
    pub(super) place: Place,
    /// Index of the first column of the joint's track.
    pub(super) column: usize,
    /// Number of [`LevelClips::reads`](super::level_clips::LevelClips::reads) that are still to be done when the joint is
    /// computed. The reads of its own keys and of the next joint's are done by then, so that they arrive in time.
    pub(super) reads_left: usize,
}
