//! Culling: which candidates does the attack hit for certain, and which does it miss for certain?
//!
//! Source: Masaoka & Oshita, section 5.3. Plain data in ([`CullInput`]), plain data out (an
//! [`Overlap`] for each candidate): whoever counts, the CPU ([`cpu`]) or a device, counts the same
//! texels.
//!
//! Differs: maps are planes and slices of time ([`MapGrid`](crate::maps::MapGrid)), rounded so
//! that one shared texel of the inner maps is a hit, and none of the outer ones a miss.

pub mod cpu;
mod drawing;
mod groups;
mod path;
mod scene;
mod steps;
mod texels;

pub(super) use drawing::Reach;
pub use drawing::{AttackDrawing, AttackLayer, TimedDisc};
pub use path::{CullPath, UnknownCullPath};
pub(super) use scene::{PlacedRegion, Scene};
pub(super) use steps::Steps;

use crate::maps::{FixedTransform2, RegionAtlas, RegionId};

/// What a culling path is given.
#[derive(Clone, Copy, Debug)]
pub struct CullInput<'a> {
    /// The maps of all evasions.
    pub atlas: &'a RegionAtlas,
    /// The attack in the frame that the paths start in.
    pub attack: &'a AttackDrawing,
    /// Every one is counted.
    pub candidates: &'a [CullCandidate],
}

/// One evasion at one place and time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CullCandidate {
    /// Which maps are moved into place.
    pub region: RegionId,
    /// Which of the attack's clocks it goes by: layers of other clocks are not its.
    pub clock: u32,
    /// From the attack's maps to the evasion's frame.
    pub turn: FixedTransform2,
    /// Whether the attack may come near where or when the maps know nothing: then an
    /// [`Overlap::outer`] of 0 proves nothing.
    pub open: bool,
}

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
    const BODY: Self = Self {
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
    /// miss for certain, unless the candidate is [`CullCandidate::open`].
    pub outer: u32,
    /// Texels of the attack's inner map, of any slice, on the candidate's evasion map: the more,
    /// the more it looks like an avoidance.
    pub evasion: u32,
}
