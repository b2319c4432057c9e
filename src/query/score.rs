//! The score of a candidate: how natural it looks.
//!
//! Source: Masaoka & Oshita, section 5.4, equations (1) and (2): V = w_a V_a + w_d V_d + w_t V_t;
//! the smallest value wins.

use serde::{Deserialize, Serialize};

/// Weights of the score's terms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Weights {
    /// Weight of V_a. Default 1.
    pub avoid: f32,
    /// Weight of V_d. Default 4: a tenth of a metre weighs as much as 0.4 of the evasion region missed.
    ///
    /// With a negative weight the widest miss is the best, and every candidate is tested.
    pub distance: f32,
    /// Weight of V_t. Default 1: double rate weighs as much as missing the evasion region altogether.
    pub time: f32,
    /// Weight of V_w. Default 0.5: a warp that uses one bound completely weighs as much as missing half of the evasion region.
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

/// The facts that a score is computed from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ScoreFacts {
    /// Texels of the evasion region in the slabs that the attack touches.
    pub region_texels: u32,
    /// Number of these texels that the attack covers.
    pub covered_texels: u32,
    /// Smallest distance of body and attack, metres.
    pub clearance: f32,
    /// Rate p of the retimable edges.
    pub rate: f32,
    /// Whether only the upper body plays the evasion.
    pub is_layered: bool,
}

/// V_a of a layered evasion: half of the body plays it.
const LAYERED: f32 = 0.5;

/// The terms of a candidate's score, and their weighted sum.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// V_a, 0 to 1: share of the evasion region that the attack misses, in the slabs that the attack touches. 1 for a move, 0.5 for a layered
    /// evasion.
    pub avoid: f32,
    /// V_d: smallest distance of body and attack, metres, 0 or more.
    pub distance: f32,
    /// V_t = (p - 1)², 0 to 1 within the default limits of p.
    pub time: f32,
    /// V_w: share of its bounds that a warp uses, the sum of the squared shares; 0 without a warp.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub warp: f32,
    /// V: weighted sum; the smallest is the best.
    pub total: f32,
}

impl Score {
    /// A lower bound of the scores of moves.
    pub(super) fn least_of_a_move(weights: &Weights) -> f32 {
        weights.avoid
    }

    /// The score of a candidate.
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

    /// The score of the same motion with a warp of this effort.
    pub(super) fn warped(self, effort: f32, weights: &Weights) -> Self {
        Self {
            warp: effort,
            total: finite(self.total + weights.warp * effort),
            ..self
        }
    }
}

/// The nearest finite number, by which scores can be compared whatever the weights are; the largest one for what is no number.
fn finite(total: f32) -> f32 {
    match total.is_nan() {
        true => f32::MAX,
        false => total.clamp(f32::MIN, f32::MAX),
    }
}

fn is_zero(value: &f32) -> bool {
    *value == 0.0
}
