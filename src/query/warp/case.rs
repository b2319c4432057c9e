//! What a warp is asked for, and what it returns.

use super::settings::WarpSettings;
use crate::maps::BakedGraph;
use crate::query::Attack;
use crate::query::clearance::{Clearance, MotionBody};

/// Number of samples on each side of the moment at which the attack is nearest.
pub(super) const SAMPLES: usize = 3;

/// A motion that was bent so that it is clean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Warped {
    /// Of the warped motion, exactly.
    pub clearance: Clearance,
    /// How much of the bounds the warp uses: the sum of the squared shares.
    pub effort: f32,
}

/// What is warped, and against what.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WarpCase<'a> {
    /// Whose motion it is.
    pub baked: &'a BakedGraph,
    /// In the world of the motion, on its clock.
    pub attack: &'a Attack,
    /// How far it may be bent.
    pub settings: &'a WarpSettings,
}

/// What a warp is to do to the smallest distance from the attack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Wish {
    /// Above the margin.
    Away,
    /// From one distance to a smaller one, metres.
    Nearer { from: f32, to: f32 },
}

/// A case with the change of the smallest distance that is wanted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Task<'a> {
    pub(super) case: WarpCase<'a>,
    pub(super) wish: Wish,
}

/// The exact test of a motion before it is bent, and the memory for the next test.
pub(crate) struct Tested<'b> {
    /// Smallest distance from the attack.
    pub clearance: Clearance,
    /// Scratch of the exact test.
    pub body: &'b mut MotionBody,
}
