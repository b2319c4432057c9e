//! The clips that are mixed into those of a character or of a group.

/// Which clips are mixed into a character's own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Mix {
    /// Whether a second clip is cross-faded to.
    pub(super) fades: bool,
    /// Whether an additive layer is added.
    pub(super) is_layered: bool,
}

impl Mix {
    /// Number of combinations.
    pub(super) const COUNT: usize = 4;

    /// Each combination by its index.
    pub(super) fn all() -> impl Iterator<Item = Self> {
        (0..Self::COUNT).map(Self::of)
    }

    /// The combination of an index.
    pub(super) fn of(index: usize) -> Self {
        Self {
            fades: index & 1 != 0,
            is_layered: index & 2 != 0,
        }
    }

    pub(super) fn index(self) -> usize {
        usize::from(self.fades) + 2 * usize::from(self.is_layered)
    }

    /// Whether nothing is mixed in.
    pub(super) fn is_none(self) -> bool {
        self == Self::default()
    }

    /// Whether a group with this mixture can pose a character with the mixture `other`.
    pub(super) fn covers(self, other: Self) -> bool {
        self.index() & other.index() == other.index()
    }
}
