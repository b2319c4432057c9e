use serde::{Deserialize, Serialize};

use super::JointId;

/// What happens in a labelled range of a clip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum EventKind {
    /// A blow.
    Attack,
    /// A dodge.
    Evasion,
}

/// A labelled time range of a clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Index of the clip in its set.
    pub clip: usize,
    /// What happens.
    pub kind: EventKind,
    /// Seconds.
    pub start: f64,
    /// Seconds.
    pub end: f64,
    /// That take part; empty = all.
    pub joints: Vec<JointId>,
}
