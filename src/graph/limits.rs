//! Limits on the size of a graph. Larger input would exhaust memory or time.

use super::{ClipSource, GraphError, GraphSettings};
use crate::anim::Clip;

impl GraphSettings {
    /// Default of [`GraphSettings::memory`], in bytes.
    pub const MEMORY: u64 = 8 << 30;

    /// Maximum number of events of all clips. The maps of an event take about 1 MB.
    pub const MOST_EVENTS: usize = 8192;

    /// Maximum duration of an event, in seconds.
    pub const LONGEST_EVENT: f64 = 60.0;

    /// Maximum number of transitions before pruning. If more are below the threshold, the closest of each stretch of a clip are
    /// kept.
    pub const MOST_TRANSITIONS: usize = 1 << 18;

    /// Maximum number of transitions that the closest are chosen from.
    pub const MOST_FOUND: usize = 1 << 24;

    /// Checks the limits before any memory is allocated.
    pub(super) fn check_size(&self, source: ClipSource<'_>) -> Result<(), GraphError> {
        let needed = self.estimate(source);
        if needed > self.memory as f64 {
            return Err(GraphError::Memory {
                needed: needed as u64,
                most: self.memory,
            });
        }
        let events = source.events.len();
        if events > Self::MOST_EVENTS {
            return Err(GraphError::TooMany {
                what: "events",
                found: events as u64,
                most: Self::MOST_EVENTS as u64,
            });
        }
        let long = |seconds: f64| seconds > Self::LONGEST_EVENT;
        let mut lengths = source.events.iter().map(|event| event.end - event.start);
        match lengths.position(long) {
            Some(index) => {
                let clip = source.clips.get(source.events[index].clip);
                Err(GraphError::EventTooLong {
                    index,
                    clip: clip.map(|clip| clip.name().to_owned()),
                    max: Self::LONGEST_EVENT,
                })
            }
            None => Ok(()),
        }
    }

    /// Estimate of the memory that a build takes, in bytes.
    fn estimate(&self, source: ClipSource<'_>) -> f64 {
        // Bytes of a joint and frame: the rotation twice, the point in three layouts, and about as much again for the graph's copies.
        const JOINT: f64 = 100.0;
        // Bytes of a frame: sums and projections of its window, and its data in the search for links.
        const FRAME: f64 = 400.0;
        // Resampling adds up to one frame beyond the whole frame times of a clip.
        let frames = |clip: &Clip| (clip.duration() * self.frame_rate).ceil() + 1.0;
        let frames = source.clips.iter().map(frames).sum::<f64>();
        // Links take the time from each frame to each event.
        let events = match self.links {
            Some(_) => source.events.len() as f64 * size_of::<u16>() as f64,
            None => 0.0,
        };
        frames * (source.skeleton.len() as f64 * JOINT + FRAME + events)
    }

    /// Checks the limit on the number of transitions that the closest are chosen from.
    pub(super) fn check_found(found: usize) -> Result<(), GraphError> {
        match found <= Self::MOST_FOUND {
            true => Ok(()),
            false => Err(GraphError::TooMany {
                what: "transitions under the threshold",
                found: found as u64,
                most: Self::MOST_FOUND as u64,
            }),
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
