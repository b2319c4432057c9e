use serde::{Deserialize, Serialize};

use super::RegionId;
use crate::graph::EdgeId;
use crate::math::Rigid2;

/// An edge that plays an evasion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evasion {
    /// Edge that plays the whole event and nothing else.
    pub edge: EdgeId,
    /// Maps of the evasion in the [`RegionAtlas`](super::RegionAtlas).
    #[doc(hidden)]
    pub region: RegionId,
    /// Character's frame at the event's start, in the space of its clip.
    pub placement: Rigid2,
}
