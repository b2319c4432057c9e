use serde::{Deserialize, Serialize};

/// Names a character of [`Characters`](super::Characters). It is not used again after the character is gone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct CharacterId {
    pub(super) index: u32,
    pub(super) generation: u32,
}

/// Names a threat of [`Characters`](super::Characters).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ThreatId(pub u64);
