//! Limits on the size of a graph. Larger input would exhaust memory or time.

use super::{ClipSource, GraphError, GraphSettings};
use crate::anim::Clip;

impl GraphSettings {
    /// Maximum number of frames of all clips at the graph's rate: more than two hours at 30 frames
    /// per second. Every pair of frames is compared.
    pub const MOST_FRAMES: usize = 250_000;

    /// Maximum number of frames of all clips at the graph's rate, times the number of joints: about
    /// 1.5 GB during the build.
    pub const MOST_PLACES: usize = 1 << 24;

    /// Maximum number of events of all clips. The maps of an event take about 1 MB.
    pub const MOST_EVENTS: usize = 2048;

    /// Maximum duration of an event, in seconds.
    pub const LONGEST_EVENT: f64 = 60.0;

    /// Maximum number of transitions before pruning.
    pub const MOST_TRANSITIONS: usize = 1 << 18;

    /// Checks the limits before any memory is allocated.
    pub(super) fn check_size(&self, source: ClipSource<'_>) -> Result<(), GraphError> {
        // Resampling adds up to one frame beyond the whole frame times of a clip.
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
        let mut lengths = source.events.iter().map(|event| event.end - event.start);
        match lengths.position(long) {
            Some(index) => Err(GraphError::EventTooLong {
                index,
                max: Self::LONGEST_EVENT,
            }),
            None => Ok(()),
        }
    }

    /// Checks the limit on the number of transitions.
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
