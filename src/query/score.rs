//! The score of a candidate, which measures how natural it looks.
//!
//! Source: Masaoka & Oshita, section 5.4, equations (1) and (2): V = w_a V_a + w_d V_d + w_t V_t;
//! the smallest value wins.

use serde::{Deserialize, Serialize};

/// Weights of the score's terms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Weights {
    /// Weight of V_a. Default 1.
    pub avoid: f32,
    /// Weight of V_d. Default 4, with which 0.1 m weighs as much as missing 0.4 of the evasion region.
    ///
    /// With a negative weight the widest miss wins, and every candidate is tested.
    pub distance: f32,
    /// Weight of V_t. Default 1, with which double rate weighs as much as missing the whole evasion region.
    pub time: f32,
    /// Weight of V_w. Default 0.5, with which a warp that uses one bound completely weighs as much as missing half of the evasion region.
    #[serde(default)]
    pub warp: f32,
}

impl Default for Weights {
    fn default() -> Self {
        Self {
            avoid: 1.0,
            distance: 4.0,
            time: 1.0,
            warp: 0.5,
        }
    }
}

/// Inputs of a score.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ScoreFacts {
    /// Number of texels of the evasion region in the slabs that the attack touches.
    pub region_texels: u32,
    /// Number of these texels that the attack covers.
    pub covered_texels: u32,
    /// Smallest distance of body and attack, in metres.
    pub clearance: f32,
    /// Rate p of the retimable edges.
    pub rate: f32,
    /// Whether only the upper body plays the evasion.
    pub is_layered: bool,
}

/// V_a of a layered evasion, which half of the body plays.
const LAYERED: f32 = 0.5;

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
    /// V: weighted sum of the terms. The lowest value wins.
    pub total: f32,
}

impl Score {
    /// Lower bound of the score of any move.
    pub(super) fn least_of_a_move(weights: &Weights) -> f32 {
        weights.avoid
    }

    /// Computes the score of a candidate.
    #[must_use]
    pub(crate) fn new(facts: ScoreFacts, weights: &Weights) -> Self {
        let ScoreFacts {
            region_texels,
            covered_texels,
            clearance,
            rate,
            is_layered,
        } = facts;
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
            total,
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
