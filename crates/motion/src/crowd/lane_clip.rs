//! The clips that one character of a group plays.

use super::clip_range::ClipRange;
use crate::anim::ClipId;

/// A clip as a lane plays it.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneClip<'a> {
    pub(super) clip: ClipId,
    pub(super) range: &'a ClipRange,
    /// Position in the clip when the groups' clock is 0, in frames.
    pub(super) start: f32,
    /// Playback rate, in seconds of the clip per second.
    pub(super) speed: f32,
    pub(super) weight: f32,
}

/// All clips of a lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneClips<'a> {
    pub(super) own: LaneClip<'a>,
    pub(super) fade: LaneClip<'a>,
    pub(super) layer: LaneClip<'a>,
}
