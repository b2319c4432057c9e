//! A joint of one level, and where its keys are.

use super::tracks::Place;

/// What all clips agree on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LevelJoint {
    /// `None` for the root alone.
    pub(super) parent: Option<u16>,
    pub(super) place: Place,
    /// The first of its columns.
    pub(super) column: usize,
    /// How many of [`LevelClips::reads`](super::level_clips::LevelClips::reads) are left when it is computed: those of its own keys and of the next joint's are done, so
    /// that they are there in time.
    pub(super) reads_left: usize,
}
