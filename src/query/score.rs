//! How natural does a candidate look?
//!
//! Source: Masaoka & Oshita, section 5.4, equations (1) and (2): V = w_a V_a + w_d V_d + w_t V_t;
//! the smallest wins.

use serde::{Deserialize, Serialize};

/// Weights of the three terms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Weights {
    /// Of V_a. Default 1.
    pub avoid: f32,
    /// Of V_d. Default 4: a tenth of a metre weighs as much as 0.4 of the evasion region missed.
    /// Below 0 the widest miss is the best, and every candidate must be tested.
    pub distance: f32,
    /// Of V_t. Default 1: twice the rate weighs as much as missing the evasion region altogether.
    pub time: f32,
    /// Of V_w. Default 0.5: a warp that uses one of its bounds whole weighs as much as missing half of the evasion region.
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

/// The three terms of a candidate and their weighted sum.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// V_a, 0 to 1: the share of the evasion region, in the slabs that the attack touches, through
    /// which the attack does not pass. 1 for a path without an evasion.
    pub avoid: f32,
    /// V_d, 0 or more: the smallest distance of body and attack, metres.
    pub distance: f32,
    /// V_t = (p - 1)², 0 to 1 within the default limits of p.
    pub time: f32,
    /// V_w: how much of its bounds a warp uses, the sum of the squared shares; 0 for a motion that is not bent.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub warp: f32,
    /// V: the smaller, the better.
    pub total: f32,
}

impl Score {
    /// No path that only moves scores below it, whatever its clearance.
    pub(super) fn least_of_a_move(weights: &Weights) -> f32 {
        weights.avoid
    }

    /// From the texels of the evasion region in the slabs that the attack touches and how many of
    /// them the attack covers, the clearance in metres and the rate p.
    #[must_use]
    pub fn new(
        (region_texels, covered_texels): (u32, u32),
        clearance: f32,
        rate: f32,
        weights: &Weights,
    ) -> Self {
        let avoid = match region_texels {
            0 => 1.0,
            // Two turned rasters can count an edge texel more than there are.
            texels => 1.0 - (covered_texels as f32 / texels as f32).min(1.0),
        };
        let (distance, time) = (clearance.max(0.0), (rate - 1.0).powi(2));
        let total = weights.avoid * avoid + weights.distance * distance + weights.time * time;
        Self {
            avoid,
            distance,
            time,
            warp: 0.0,
            total,
        }
    }

    /// The same for a motion that is bent with so much effort.
    pub(super) fn warped(self, effort: f32, weights: &Weights) -> Self {
        Self {
            warp: effort,
            total: self.total + weights.warp * effort,
            ..self
        }
    }
}

fn is_zero(value: &f32) -> bool {
    *value == 0.0
}
