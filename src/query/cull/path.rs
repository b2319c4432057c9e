//! The culling paths, and what they count.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::query::request::Evaluation;

/// The implementation that counts the overlaps of candidates and attack. All paths return the same counts, except [`CullPath::None`] and
/// [`CullPath::Exact`], which count no hits, and occlusion queries on a device without precise queries, which only distinguish zero from more.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CullPath {
    /// No culling: candidates are tested exactly, as far as the choice depends on them.
    #[default]
    None,
    /// No culling: every candidate is tested exactly, over the whole attack. The reference of the other paths.
    Exact,
    /// Counts maps on the CPU.
    Cpu,
    /// Counts maps on a Vulkan device with the stencil buffer and occlusion queries, as the paper does.
    Stencil,
    /// Counts maps on a Vulkan device with a compute shader.
    Compute,
}

impl CullPath {
    /// All paths.
    pub const ALL: [Self; 5] = [
        Self::None,
        Self::Exact,
        Self::Cpu,
        Self::Stencil,
        Self::Compute,
    ];

    /// Name of the path in arguments, tables and files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Exact => "exact",
            Self::Cpu => "cpu",
            Self::Stencil => "stencil",
            Self::Compute => "compute",
        }
    }

    /// The path of a [`CullPath::name`]; `None` for any other text.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|path| path.name() == name)
    }

    /// Evaluation of queries with this path: exhaustive for the exact path, lazy for all others.
    #[must_use]
    pub fn evaluation(self) -> Evaluation {
        match self {
            Self::Exact => Evaluation::Exhaustive,
            Self::None | Self::Cpu | Self::Stencil | Self::Compute => Evaluation::Lazy,
        }
    }

    /// Whether the path culls.
    #[must_use]
    pub fn culls(self) -> bool {
        !matches!(self, Self::None | Self::Exact)
    }

    /// Whether the path runs on a Vulkan device.
    #[must_use]
    pub fn needs_device(self) -> bool {
        matches!(self, Self::Stencil | Self::Compute)
    }
}

impl fmt::Display for CullPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// The parts of an [`Overlap`] that are counted. Parts that are left out cost nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counted {
    /// Whether [`Overlap::body`] is counted, for certain hits. It is 0 otherwise.
    pub body: bool,
    /// Whether [`Overlap::outer`] is counted, for certain misses. It is `u32::MAX` otherwise. This part costs the most: its maps are
    /// the largest, and most candidates have some overlap.
    pub outer: bool,
    /// Whether [`Overlap::evasion`] is counted, a term of the score. It is 0 otherwise.
    pub evasion: bool,
    /// Whether counting may end at a candidate's first certain hit. All counts of the candidate may then be too small. The CPU and the compute
    /// path save time by this; the stencil path ignores it.
    pub up_to_hits: bool,
}

impl Counted {
    /// All parts.
    pub const ALL: Self = Self {
        body: true,
        outer: true,
        evasion: true,
        up_to_hits: false,
    };

    pub(super) const BODY: Self = Self {
        outer: false,
        evasion: false,
        ..Self::ALL
    };

    /// The part that a query needs without culling: a term of the score.
    pub const FOR_A_SCORE: Self = Self {
        body: false,
        outer: false,
        evasion: true,
        up_to_hits: false,
    };

    /// The parts that a query needs. Certain misses are not needed, because these candidates are tested too: the distance is a part of the
    /// score.
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

/// The overlap of a candidate's maps and the attack, summed over the slabs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Overlap {
    /// Number of texel slices that the attack's inner map and the candidate's body map share. If sections are planes and maps are
    /// timed, 1 or more proves a hit.
    pub body: u32,
    /// Number of texel slices that the two outer maps share. 0 proves a miss, unless the candidate is
    /// [`CullCandidate::open`](super::CullCandidate::open).
    pub outer: u32,
    /// Number of texels that the attack's inner map, in any slice, and the candidate's evasion map share. A larger number
    /// means that the motion looks more like an evasion of this attack.
    pub evasion: u32,
}
