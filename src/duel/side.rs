use serde::{Deserialize, Serialize};

/// One of the two fighters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// The fighter that attacks first.
    White,
    /// The other fighter.
    Blue,
}

impl Side {
    /// The other fighter.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::White => Self::Blue,
            Self::Blue => Self::White,
        }
    }

    /// The index of the fighter in arrays: 0 or 1.
    #[must_use]
    pub fn index(self) -> usize {
        match self {
            Self::White => 0,
            Self::Blue => 1,
        }
    }

    /// The name: `white` or `blue`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::White => "white",
            Self::Blue => "blue",
        }
    }
}
