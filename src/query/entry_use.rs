use serde::{Deserialize, Serialize};

/// How entries are used.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EntryUse {
    /// Most candidates that enter an evasion; 0 for none, as in the paper. Default 128.
    pub most: usize,
    /// Slowest rate of what is entered. Default 0.75.
    pub slowest: f32,
    /// Fastest rate of what is entered; each entry has a limit of its own as well. Default 1.5.
    pub fastest: f32,
    /// The natural motion goes on at most so long before an entry, seconds. Default 0.8.
    pub longest_delay: f32,
}

impl Default for EntryUse {
    fn default() -> Self {
        Self {
            most: 128,
            slowest: 0.75,
            fastest: 1.5,
            longest_delay: 0.8,
        }
    }
}

impl EntryUse {
    /// No entries: the paper's way.
    #[must_use]
    pub fn none() -> Self {
        Self {
            most: 0,
            ..Self::default()
        }
    }
}
