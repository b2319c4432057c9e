use serde::{Deserialize, Serialize};

use super::JointId;

/// What happens in a labelled range of a clip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum EventKind {
    /// Something is struck at.
    Attack,
    /// The body leaves the place where it was.
    Evasion,
}

/// A labelled time range of a clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Index of the clip in its set.
    pub clip: usize,
    /// What happens.
    pub kind: EventKind,
    /// Seconds from the clip's first frame.
    pub start: f64,
    /// Seconds from the clip's first frame.
    pub end: f64,
    /// The joints that take part; empty means all, for evasions.
    pub joints: Vec<JointId>,
}
