//! How much a graph may be built of: what is beyond would fill the memory, or never be done.

use super::{ClipSource, GraphError, GraphSettings};
use crate::anim::Clip;

impl GraphSettings {
    /// Frames of all clips together, at the graph's rate: more than two hours at 30 a second. Every pair of frames is compared.
    pub const MOST_FRAMES: usize = 250_000;

    /// Frames of all clips, at the graph's rate, times joints: some 1.5 GB while the graph is built.
    pub const MOST_PLACES: usize = 1 << 24;

    /// Events of all clips together: each brings its maps, some 1 MB.
    pub const MOST_EVENTS: usize = 2048;

    /// How long an event may last, seconds.
    pub const LONGEST_EVENT: f64 = 60.0;

    /// Transitions, before what leads nowhere is dropped.
    pub const MOST_TRANSITIONS: usize = 1 << 18;

    /// Refuses what is beyond the limits, before anything is made of it.
    pub(super) fn check_size(&self, source: ClipSource<'_>) -> Result<(), GraphError> {
        // Resampling gives a frame more than whole frame times fit in.
        let frames = |clip: &Clip| (clip.duration() * self.frame_rate).ceil() + 1.0;
        let frames = source.clips.iter().map(frames).sum::<f64>();
        let most = |what, found: f64, most: usize| match found <= most as f64 {
            true => Ok(()),
            false => Err(GraphError::TooMany {
                what,
                found: found as u64,
                most: most as u64,
            }),
        };
        most("frames at the graph's rate", frames, Self::MOST_FRAMES)?;
        let places = frames * source.skeleton.len() as f64;
        most("frames times joints", places, Self::MOST_PLACES)?;
        most("events", source.events.len() as f64, Self::MOST_EVENTS)?;
        let long = |seconds: f64| seconds > Self::LONGEST_EVENT;
        let lengths = source.events.iter().map(|event| event.end - event.start);
        match { lengths }.position(long) {
            Some(index) => Err(GraphError::EventTooLong { index }),
            None => Ok(()),
        }
    }

    /// Refuses more transitions than a graph may have.
    pub(super) fn check_transitions(found: usize) -> Result<(), GraphError> {
        match found <= Self::MOST_TRANSITIONS {
            true => Ok(()),
            false => Err(GraphError::TooMany {
                what: "transitions under the threshold",
                found: found as u64,
                most: Self::MOST_TRANSITIONS as u64,
            }),
        }
    }
}
