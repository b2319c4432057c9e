use super::drawing::AttackDrawing;
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
    /// [`Overlap::outer`](super::Overlap::outer) of 0 proves nothing.
    pub open: bool,
}
