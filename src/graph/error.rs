use thiserror::Error;

use crate::anim::ClipError;

/// Why there is no graph.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum GraphError {
    /// No clips.
    #[error("there are no clips to build a graph from")]
    NoClips,
    /// A setting is out of its range.
    #[error("graph setting {name} is {value}; it must be {range}")]
    Setting {
        /// Which.
        name: &'static str,
        /// What it is.
        value: f64,
        /// What it may be.
        range: &'static str,
    },
    /// Weights for a different number of joints.
    #[error(
        "{found} joint weights for {joints} joints; they must be finite, none negative, one above 0"
    )]
    JointWeights {
        /// How many weights.
        found: usize,
        /// How many joints.
        joints: usize,
    },
    /// A clip is of another skeleton.
    #[error("clip \"{clip}\" has {found} joints, and the skeleton {joints}")]
    ClipJoints {
        /// Name of the clip.
        clip: String,
        /// How many joints it has.
        found: usize,
        /// How many the skeleton has.
        joints: usize,
    },
    /// Two events of one clip share time. Positions in the list.
    #[error("events {earlier} and {later} of one clip overlap")]
    EventsOverlap {
        /// The one that starts first.
        earlier: usize,
        /// The one that starts before that has ended.
        later: usize,
    },
    /// An event names a clip or joints that are not there, or lies outside its clip.
    #[error(
        "event {index}: {start} s to {end} s does not lie inside a clip of the set, or names no joint of it"
    )]
    Event {
        /// Position in the list.
        index: usize,
        /// Seconds.
        start: f64,
        /// Seconds.
        end: f64,
    },
    /// Beyond what a graph may be built of.
    #[error("{found} {what}; {most} is the most")]
    TooMany {
        /// Of what there is too much.
        what: &'static str,
        /// How many there are; of transitions, how many were counted until there were too many.
        found: u64,
        /// How many there may be.
        most: u64,
    },
    /// An event lasts too long.
    #[error("event {index} lasts longer than {max} s, which is the most", max = super::GraphSettings::LONGEST_EVENT)]
    EventTooLong {
        /// Position in the list.
        index: usize,
    },
    /// Nothing leads back to where it came from.
    #[error(
        "no motion leads back to where it started: no two moments of the {clips} clips ({seconds:.1} s) that could be joined are within {threshold} m of each other; add clips that return to a common stance, or raise the threshold"
    )]
    NoCycle {
        /// Clips given.
        clips: usize,
        /// Seconds given.
        seconds: f64,
        /// Metres.
        threshold: f32,
    },
    /// Resampling failed.
    #[error(transparent)]
    Clip(#[from] ClipError),
}
