use serde::{Deserialize, Serialize};

use super::JointId;

/// What happens in a labelled range of a clip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EventKind {
    /// A blow.
    Attack,
    /// A movement out of a blow's way.
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
    /// The joints that take part; empty for all.
    pub joints: Vec<JointId>,
}
