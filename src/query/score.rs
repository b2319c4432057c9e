//! The score of a candidate, which measures how natural it looks.
//!
//! Source: Masaoka & Oshita, section 5.4, equations (1) and (2): V = w_a V_a + w_d V_d + w_t V_t; the smallest value wins. Differs: V_d is never
//! below 0, a warp adds a fourth term, and a goal a fifth.

use serde::{Deserialize, Serialize};

use super::clearance::Clearance;
use super::settings::Weights;
use crate::anim::Warp;
use crate::graph::Motion;

/// The terms of a candidate's score, and their weighted sum.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// V_a, 0 to 1: share of the evasion region that the attack misses, in the slabs that the attack touches. 1 for a move, 0.5 for a layered
    /// evasion.
    pub avoid: f32,
    /// V_d: smallest distance of body and attack, in metres, at least 0.
    pub distance: f32,
    /// V_t = (p - 1)², 0 to 1 within the default limits of p.
    pub time: f32,
    /// V_w: sum of the squared shares of its bounds that a warp uses; 0 without a warp.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub warp: f32,
    /// V_g: distance of the root, at the attack's end, from where the goal leads, as a share of that way, at most 2; 0 without a goal.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub goal: f32,
    /// V: weighted sum of the terms. The lowest value wins.
    pub total: f32,
}

/// V_a of a layered evasion, which half of the body plays.
const LAYERED: f32 = 0.5;

impl Score {
    /// Lower bound of the score of any move.
    pub(super) fn least_of_a_move(weights: &Weights) -> f32 {
        weights.avoid
    }

    /// Computes the score of a candidate: the number of texels of its evasion region in the slabs that the attack touches, how many of them the
    /// attack covers, the clearance in metres, the rate p of the retimable edges, and whether only the upper body plays the evasion.
    pub(super) fn new(
        region_texels: u32,
        covered_texels: u32,
        clearance: f32,
        rate: f32,
        is_layered: bool,
        weights: &Weights,
    ) -> Self {
        let avoid = match region_texels {
            _ if is_layered => LAYERED,
            0 => 1.0,
            // Rotated rasters may count more texels than the region has.
            texels => 1.0 - (covered_texels as f32 / texels as f32).min(1.0),
        };
        let (distance, time) = (clearance.max(0.0), (rate - 1.0).powi(2));
        let total =
            finite(weights.avoid * avoid + weights.distance * distance + weights.time * time);
        Self {
            avoid,
            distance,
            time,
            warp: 0.0,
            goal: 0.0,
            total,
        }
    }

    /// The score of a motion whose V_g is `goal`.
    pub(super) fn towards(self, goal: f32, weights: &Weights) -> Self {
        Self {
            goal,
            total: finite(self.total + weights.goal * goal),
            ..self
        }
    }

    /// The score of the same motion with a warp of the given effort.
    pub(super) fn warped(self, effort: f32, weights: &Weights) -> Self {
        Self {
            warp: effort,
            total: finite(self.total + weights.warp * effort),
            ..self
        }
    }
}

/// Clamps a score to finite numbers, so that scores can be compared for any weights. NaN becomes the largest finite number.
fn finite(total: f32) -> f32 {
    match total.is_nan() {
        true => f32::MAX,
        false => total.clamp(f32::MIN, f32::MAX),
    }
}

fn is_zero(value: &f32) -> bool {
    *value == 0.0
}

/// Result of the exact test of one candidate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Evaluated {
    pub clearance: Clearance,
    /// Score of a clean candidate; `None` for a hit.
    pub score: Option<Score>,
    /// Whether the final motion was tested over the whole attack.
    pub is_final: bool,
    pub warp: Option<Warp>,
    pub push: Push,
}

impl Evaluated {
    /// A hit, as far as it was tested.
    pub(super) fn hit(clearance: Clearance) -> Self {
        Self {
            clearance,
            score: None,
            is_final: false,
            warp: None,
            push: Push::Unmeasured,
        }
    }

    /// A motion whose warp was tested over the whole attack.
    pub(super) fn warped(clearance: Clearance, score: Score, motion: &Motion) -> Self {
        Self {
            score: Some(score),
            is_final: true,
            warp: motion.warp().copied(),
            push: Push::Allowed,
            ..Self::hit(clearance)
        }
    }

    pub(super) fn is_too_hard(&self) -> bool {
        matches!(self.push, Push::TooHard(_))
    }
}

/// How hard the body pushes off in a candidate's motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Push {
    Unmeasured,
    Allowed,
    /// Harder than allowed, in metres per second squared. The candidate has no score, unless all are.
    TooHard(f32),
}
