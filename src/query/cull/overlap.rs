/// What of an [`Overlap`] is counted: what is left out costs nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counted {
    /// [`Overlap::body`], 0 where it is not counted: what the attack hits for certain.
    pub body: bool,
    /// [`Overlap::outer`], the largest number there is where it is not counted: what the attack
    /// misses for certain. The dearest: its maps are the largest, and most candidates have some.
    pub outer: bool,
    /// [`Overlap::evasion`], 0 where it is not counted: a term of the score.
    pub evasion: bool,
    /// Whether a candidate is done with as soon as its body overlap is above 0, where that is a hit
    /// for certain: nothing else of it matters then, and all its counts may be less than they would be.
    /// The CPU and the compute path save time by it, the stencil path does not look.
    pub up_to_hits: bool,
}

impl Counted {
    /// Everything.
    pub const ALL: Self = Self {
        body: true,
        outer: true,
        evasion: true,
        up_to_hits: false,
    };

    /// What is hit for certain, and no more.
    pub(super) const BODY: Self = Self {
        outer: false,
        evasion: false,
        ..Self::ALL
    };

    /// What a query's choice needs: a candidate that the attack misses for certain has to be tested
    /// all the same, for its distance is a part of its score.
    pub const FOR_A_CHOICE: Self = Self {
        outer: false,
        up_to_hits: true,
        ..Self::ALL
    };
}

impl Default for Counted {
    fn default() -> Self {
        Self::ALL
    }
}

/// What a candidate's maps and the attack share, summed over the slabs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Overlap {
    /// Slices of texels of the attack's inner map that the candidate's body map has too. Where
    /// sections are planes and maps are timed, one is a hit for certain.
    pub body: u32,
    /// Slices of texels of the attack's outer map that the candidate's outer map has too. 0 is a
    /// miss for certain, unless the candidate is [`CullCandidate::open`](super::CullCandidate::open).
    pub outer: u32,
    /// Texels of the attack's inner map, of any slice, on the candidate's evasion map: the more,
    /// the more it looks like an avoidance.
    pub evasion: u32,
}
