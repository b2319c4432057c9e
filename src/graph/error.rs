use crate::anim::ClipError;
use crate::graph::watch::Stopped;
use thiserror::Error;

/// Reason why a graph cannot be built.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum GraphError {
    /// There are no clips.
    #[error("there are no clips to build a graph from")]
    NoClips,
    /// A setting is out of range.
    #[error("graph setting {name} is {value}; it must be {range}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Value of the setting.
        value: f64,
        /// Range of valid values.
        range: &'static str,
    },
    /// The number of joint weights differs from the number of joints, or a weight is invalid.
    #[error(
        "{found} joint weights for {joints} joints; they must be finite, none negative, one above 0"
    )]
    JointWeights {
        /// Number of weights.
        found: usize,
        /// Number of joints.
        joints: usize,
    },
    /// A clip has another number of joints than the skeleton.
    #[error("clip \"{clip}\" has {found} joints, and the skeleton {joints}")]
    ClipJoints {
        /// Name of the clip.
        clip: String,
        /// Number of joints of the clip.
        found: usize,
        /// Number of joints of the skeleton.
        joints: usize,
    },
    /// Two events of one kind have the same frames of one clip. Numbers are positions in the list of events.
    #[error(
        "\"{clip}\" has two events of one kind in the same frames, from {start} s to {end} s (events {first} and {second} of all)"
    )]
    EventTwice {
        /// One event.
        first: usize,
        /// The other event.
        second: usize,
        /// Name of the clip.
        clip: String,
        /// Start of the first event, in seconds.
        start: f64,
        /// End of the first event, in seconds.
        end: f64,
    },
    /// An event refers to an unknown clip or joint, or lies outside its clip.
    #[error(
        "{}: {start} s to {end} s does not lie inside {}, or names no joint of it",
        event(*index, clip),
        if clip.is_some() { "the clip" } else { "a clip of the set" }
    )]
    Event {
        /// Position in the list of events.
        index: usize,
        /// Name of the clip, or `None` if the set has no such clip.
        clip: Option<String>,
        /// Start, in seconds.
        start: f64,
        /// End, in seconds.
        end: f64,
    },
    /// The input exceeds a limit.
    #[error("{found} {what}; {most} is the most")]
    TooMany {
        /// Name of the counted items.
        what: &'static str,
        /// Number that was found. Transitions are counted only until the limit is exceeded.
        found: u64,
        /// Maximum number.
        most: u64,
    },
    /// The build would take more memory than [`GraphSettings::memory`](crate::graph::GraphSettings::memory), by an estimate.
    #[error("a graph of these clips takes about {} of memory to build; {} is the most", size(*needed), size(*most))]
    Memory {
        /// Estimate, in bytes.
        needed: u64,
        /// Maximum, in bytes.
        most: u64,
    },
    /// An event is too long.
    #[error("{}: it is longer than the maximum of {max} s", event(*index, clip))]
    EventTooLong {
        /// Position in the list of events.
        index: usize,
        /// Name of the clip, or `None` if the set has no such clip.
        clip: Option<String>,
        /// Maximum duration, in seconds.
        max: f64,
    },
    /// No clip has motion.
    #[error(
        "the clips have no motion: each of the {clips} is a pose of one frame (a glTF animation is one if all its keys have one time)"
    )]
    NoMotion {
        /// Number of clips.
        clips: usize,
    },
    /// The clips contain no cycle.
    #[error(
        "no motion leads back to where it started: no two moments of the {clips} clips ({seconds:.1} s) that could be joined are within {threshold} m of each other; add clips that return to a common stance, or raise the threshold"
    )]
    NoCycle {
        /// Number of clips.
        clips: usize,
        /// Duration of all clips, in seconds.
        seconds: f64,
        /// Threshold of the distance, in metres.
        threshold: f32,
    },
    /// A clip cannot be resampled.
    #[error(transparent)]
    Clip(#[from] ClipError),
    /// The watch of the build stopped it.
    #[error("the build was stopped")]
    Stopped,
}

impl From<Stopped> for GraphError {
    fn from(_: Stopped) -> Self {
        Self::Stopped
    }
}

/// A number of bytes, in the unit that leaves digits before the point.
fn size(bytes: u64) -> String {
    let (unit, name) = match bytes {
        1_000_000_000.. => (1e9, "GB"),
        1_000_000.. => (1e6, "MB"),
        _ => (1e3, "kB"),
    };
    format!("{:.1} {name}", bytes as f64 / unit)
}

/// Names an event by the name of its clip, or by its position without a clip.
fn event(index: usize, clip: &Option<String>) -> String {
    match clip {
        Some(clip) => format!("\"{clip}\", event {index} of all"),
        None => format!("event {index}"),
    }
}
