use super::drawing::AttackDrawing;
use crate::maps::{FixedTransform2, RegionAtlas, RegionId};

/// The input of a culling path.
#[derive(Clone, Copy, Debug)]
pub struct CullInput<'a> {
    /// Maps of all evasions.
    pub atlas: &'a RegionAtlas,
    /// Discs of the attack, in the frame in which the paths start.
    #[doc(hidden)]
    pub attack: &'a AttackDrawing,
    /// Candidates that are counted.
    #[doc(hidden)]
    pub candidates: &'a [CullCandidate],
}

/// An evasion at one position and time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CullCandidate {
    /// Maps of the evasion.
    pub region: RegionId,
    /// Clock of the candidate. Only the layers of that clock are compared with its maps.
    pub clock: u32,
    /// Transform from the attack's maps to the evasion's frame.
    pub transform: FixedTransform2,
    /// Whether the attack may come near the body outside the space or time of the maps. An
    /// [`Overlap::outer`](super::Overlap::outer) of 0 then does not prove a miss.
    pub open: bool,
}
