use crate::anim::{Clip, Event, Skeleton};

/// Input of [`build`](super::build()).
#[derive(Clone, Copy, Debug)]
pub struct ClipSource<'a> {
    /// Skeleton of all clips.
    pub skeleton: &'a Skeleton,
    /// Clips, at any frame rates.
    pub clips: &'a [Clip],
    /// Labelled events of the clips. They may overlap; two of one kind with the same frames are an error.
    pub events: &'a [Event],
}
