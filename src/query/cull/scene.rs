use std::ops::Range;

use crate::maps::{MapRect, RegionAtlas, RegionId};
use crate::math::Rigid2;
use crate::query::attack::Attack;

/// An evasion where a candidate performs it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::query) struct PlacedRegion {
    pub region: RegionId,
    /// The character's frame at the evasion's start, in the frame in which the paths start.
    pub placement: Rigid2,
    /// Position among the clocks.
    pub clock: u32,
}

/// What is held against what: an attack, in the frame in which the paths start, and evasions.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct Scene<'a> {
    pub atlas: &'a RegionAtlas,
    pub attack: &'a Attack,
    /// Seconds from the attack's start to an evasion's start.
    pub clocks: &'a [f32],
    pub placed: &'a [PlacedRegion],
    /// No part of the body is ever further from its root, metres.
    pub reach: f32,
    /// Whether outer maps are drawn; where they are not, every candidate is open.
    pub outer: bool,
}

/// Which part of the attack is drawn: what some candidate's maps can reach.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::query) struct Reach {
    /// The attack's texels of the frame that the paths start in.
    pub rect: MapRect,
    pub slabs: Range<i32>,
}
