use std::ops::Range;

use crate::maps::{MapRect, RegionAtlas, RegionId};
use crate::math::Rigid2;
use crate::query::attack::Attack;

/// An evasion at the place where a candidate performs it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::query) struct PlacedRegion {
    pub region: RegionId,
    /// The character's frame at the evasion's start, in the frame in which the paths start.
    pub placement: Rigid2,
    /// Index of the clock.
    pub clock: u32,
}

/// The input of drawing: an attack, in the frame in which the paths start, and the evasions that it is compared with.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct DrawInput<'a> {
    pub atlas: &'a RegionAtlas,
    pub attack: &'a Attack,
    /// Offsets of the clocks: time from the attack's start to an evasion's start, seconds.
    pub clocks: &'a [f32],
    pub placed: &'a [PlacedRegion],
    /// Largest distance of any part of the body from the root, metres.
    pub reach: f32,
    /// Whether outer maps are drawn. Without them every candidate is open.
    pub outer: bool,
}

/// The part of the attack that is drawn: the space that some candidate's maps cover.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::query) struct Reach {
    /// Texels, in the frame in which the paths start.
    pub rect: MapRect,
    pub slabs: Range<i32>,
}
