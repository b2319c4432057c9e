use std::ops::Range;

use crate::maps::{MapRect, RegionAtlas, RegionId};
use crate::math::Rigid2;
use crate::query::attack::Attack;

/// An evasion at the position where a candidate performs it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::query) struct PlacedRegion {
    pub region: RegionId,
    /// The character's frame at the evasion's start, in the frame in which the paths start.
    pub placement: Rigid2,
    /// Index of the candidate's clock in [`DrawInput::clocks`].
    pub clock: u32,
}

/// The input of drawing: an attack, in the frame in which the paths start, and the evasions that it is compared with.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct DrawInput<'a> {
    pub atlas: &'a RegionAtlas,
    pub attack: &'a Attack,
    /// Offset of each clock: time from the attack's start to an evasion's start, in seconds.
    pub clocks: &'a [f32],
    pub placed: &'a [PlacedRegion],
    /// Maximum distance of any part of the body from the root, in metres.
    pub reach: f32,
    /// Whether outer maps are drawn. Without them every candidate is open.
    pub outer: bool,
}

/// The space that the maps of any candidate cover. Only the part of the attack within it is drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::query) struct Reach {
    /// Rectangle of texels, in the frame in which the paths start.
    pub rect: MapRect,
    pub slabs: Range<i32>,
}
