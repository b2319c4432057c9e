//! Errors of events files.

use thiserror::Error;

use super::shortened;
use crate::json::JsonError;

/// Reason why events cannot be used. Events are counted from 0, in the order of the file.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum EventsError {
    /// The text is not a valid events file.
    #[error(transparent)]
    Json(#[from] JsonError),
    /// There is no clip of this name.
    #[error("events for \"{file}\", but there is no such clip")]
    NoClip {
        /// Name of the clip's file, as written.
        file: String,
    },
    /// The name stands for several clips.
    #[error(
        "events for \"{file}\", which may be any of the clips {}",
        shortened(clips)
    )]
    SeveralClips {
        /// Name of the clip's file, as written.
        file: String,
        /// Names of these clips.
        clips: Vec<String>,
    },
    /// The skeleton has no joint of this name.
    #[error("\"{file}\", event {event}: the skeleton has no joint \"{joint}\"")]
    NoJoint {
        /// Name of the clip's file, as written.
        file: String,
        /// Index of the event.
        event: usize,
        /// Name of the joint, as written.
        joint: String,
    },
    /// Several joints of the clip's file have that name.
    #[error(
        "\"{file}\", event {event}: several joints are called \"{joint}\"; name one of them, as \"{joint}_2\", or rename them in the file"
    )]
    Ambiguous {
        /// Name of the clip's file, as written.
        file: String,
        /// Index of the event.
        event: usize,
        /// Name of the joint, as written.
        joint: String,
    },
    /// An attack has no joints.
    #[error("\"{file}\", event {event}: an attack needs the joints that strike")]
    NoJoints {
        /// Name of the clip's file, as written.
        file: String,
        /// Index of the event.
        event: usize,
    },
    /// The times are negative or not finite, or the end is not after the start.
    #[error(
        "\"{file}\", event {event}: from {start} s to {end} s is no time range (0 <= start < end)"
    )]
    Range {
        /// Name of the clip's file, as written.
        file: String,
        /// Index of the event.
        event: usize,
        /// Start, in seconds.
        start: f64,
        /// End, in seconds.
        end: f64,
    },
    /// The event ends more than half a frame after the clip's end.
    #[error("\"{file}\", event {event}: ends at {end} s, but the clip at {duration} s")]
    Outside {
        /// Name of the clip's file, as written.
        file: String,
        /// Index of the event.
        event: usize,
        /// End of the event, in seconds.
        end: f64,
        /// Duration of the clip, in seconds.
        duration: f64,
    },
}
