use serde::{Deserialize, Serialize};

/// Identifies a character of [`Characters`](super::Characters). It is not used again after the character is removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct CharacterId {
    pub(super) index: u32,
    pub(super) generation: u32,
}

impl CharacterId {
    /// Index of its place among the characters. A removed character's place is used again.
    #[must_use]
    pub fn index(self) -> u32 {
        self.index
    }

    /// As one number, for interfaces to other languages.
    #[must_use]
    pub fn to_bits(self) -> u64 {
        u64::from(self.generation) << 32 | u64::from(self.index)
    }

    /// The id of a number of [`CharacterId::to_bits`].
    #[must_use]
    pub fn from_bits(bits: u64) -> Self {
        Self {
            index: bits as u32,
            generation: (bits >> 32) as u32,
        }
    }
}

/// Identifies a threat of [`Characters`](super::Characters).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ThreatId(pub u64);
