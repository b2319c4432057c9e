use serde::{Deserialize, Serialize};

use super::JointId;

/// Kind of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EventKind {
    /// An attack, for example a punch or a kick.
    Attack,
    /// A movement that avoids an attack.
    Evasion,
}

/// A labelled time range of a clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Index of the clip in its set.
    pub clip: usize,
    /// Kind of the event.
    pub kind: EventKind,
    /// Start, in seconds from the clip's first frame.
    pub start: f64,
    /// End, in seconds from the clip's first frame.
    pub end: f64,
    /// Joints that take part, or empty for all joints.
    pub joints: Vec<JointId>,
}
