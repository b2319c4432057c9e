use serde::{Deserialize, Serialize};

/// Settings of entries and layered evasions in a query.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EntryUse {
    /// Maximum number of candidates that enter an evasion. 0 means none, as in the paper. Default 128.
    pub most: usize,
    /// Slowest playback rate of an entered evasion. Default 0.75.
    pub slowest: f32,
    /// Fastest playback rate of an entered evasion. Each entry also has its own limit. Default 1.5.
    pub fastest: f32,
    /// Longest time that the natural motion continues before an entry, in seconds. Default 0.8.
    pub longest_delay: f32,
    /// Maximum number of candidates that layer the upper body of an evasion over the natural motion. 0 disables layers; recordings without the
    /// setting are read as 0. Default 3.
    #[serde(default)]
    pub layers: usize,
}

impl Default for EntryUse {
    fn default() -> Self {
        Self {
            most: 128,
            slowest: 0.75,
            fastest: 1.5,
            longest_delay: 0.8,
            layers: 3,
        }
    }
}

impl EntryUse {
    /// Settings without entries, as in the paper.
    #[must_use]
    pub fn none() -> Self {
        Self {
            most: 0,
            layers: 0,
            ..Self::default()
        }
    }
}
