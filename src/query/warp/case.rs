//! Input and result of a warp.

use super::settings::WarpSettings;
use crate::maps::BakedGraph;
use crate::query::Attack;
use crate::query::clearance::{Clearance, MotionBody};

/// Number of samples on each side of the moment at which the attack is nearest that are linearised.
pub(super) const SAMPLES: usize = 3;

/// Result of a warp that makes a motion clean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Warped {
    /// Exact clearance of the warped motion.
    pub clearance: Clearance,
    /// Sum of the squared shares of the bounds that the warp uses.
    pub effort: f32,
}

/// Input of a warp.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WarpCase<'a> {
    /// Graph of the motion.
    pub baked: &'a BakedGraph,
    /// Attack, in the world and on the clock of the motion.
    pub attack: &'a Attack,
    /// Bounds of the warp.
    pub settings: &'a WarpSettings,
}

/// Wanted change of the smallest distance from the attack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ClearanceChange {
    /// Increase it to the margin.
    Away,
    /// Decrease it from one value to another, in metres.
    Nearer { from: f32, to: f32 },
}

/// Input of a warp with the wanted change.
#[derive(Clone, Copy, Debug)]
pub(super) struct Task<'a> {
    pub(super) case: WarpCase<'a>,
    pub(super) change: ClearanceChange,
}

/// Result of the exact test of a motion without the warp, and scratch of the next test.
pub(crate) struct Tested<'b> {
    /// Smallest distance from the attack.
    pub clearance: Clearance,
    /// Scratch of the exact test.
    pub body: &'b mut MotionBody,
}
