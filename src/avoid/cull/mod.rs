//! Culling: which candidates does the attack hit for certain?
//!
//! Source: Masaoka & Oshita, section 5.3. Plain data in ([`CullInput`]), plain data out (an
//! [`Overlap`] for each candidate): whoever counts, the CPU ([`cpu`]) or a device, counts the same
//! texels.

pub mod cpu;

use crate::region::{Drawing, MapTurn, RegionAtlas, RegionId, Slab};

/// What a culling path is given.
#[derive(Clone, Copy, Debug)]
pub struct CullInput<'a> {
    /// The maps of all evasions.
    pub atlas: &'a RegionAtlas,
    /// One for each slab that the attack touches. All have the same rectangle.
    pub attack: &'a [AttackDrawing],
    /// Every one is counted.
    pub candidates: &'a [CullCandidate],
}

/// The attack's discs in one slab, in the frame that the paths start in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AttackDrawing {
    /// Which height.
    pub slab: Slab,
    /// The discs of all its frames.
    pub drawing: Drawing,
}

/// One evasion at one place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CullCandidate {
    /// Which maps are moved into place.
    pub region: RegionId,
    /// From the attack's maps to the evasion's frame.
    pub turn: MapTurn,
}

/// Texels of the attack that fall on a candidate's maps, summed over the slabs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Overlap {
    /// On its body map: one is enough to remove it.
    pub body: u32,
    /// On its evasion map: the more, the more it looks like an avoidance.
    pub evasion: u32,
}
