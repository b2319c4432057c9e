use super::clearance::Clearance;
use super::score::Score;
use crate::anim::Warp;

/// Result of the exact test of one candidate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Evaluated {
    pub clearance: Clearance,
    /// Score of a clean candidate; `None` for a hit.
    pub score: Option<Score>,
    /// Whether the final motion was tested over the whole attack.
    pub is_final: bool,
    /// Warp of the motion; `None` without a warp.
    pub warp: Option<Warp>,
}
