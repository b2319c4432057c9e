//! Rotations and positions, one for each lane.

use glam::{Quat, Vec3};

use super::quantise::ONE;
use crate::math::Lanes;

/// A rotation for each lane, of any length.
#[derive(Clone, Copy)]
pub(super) struct QuatLanes<L> {
    pub(super) x: L,
    pub(super) y: L,
    pub(super) z: L,
    pub(super) w: L,
}

impl<L: Lanes> QuatLanes<L> {
    #[inline(always)]
    pub(super) fn dot(self, other: Self) -> L {
        // In two halves, which do not wait for each other.
        self.y.mul_add(other.y, self.x * other.x) + self.w.mul_add(other.w, self.z * other.z)
    }

    #[inline(always)]
    pub(super) fn scaled(self, factor: L) -> Self {
        Self {
            x: self.x * factor,
            y: self.y * factor,
            z: self.z * factor,
            w: self.w * factor,
        }
    }

    /// A part of the straight line to another one, both of length 1, along the shorter arc; of any length.
    #[inline(always)]
    pub(super) fn towards(self, other: Self, weight: L) -> Self {
        let to_other = weight.copy_sign(self.dot(other));
        let to_self = L::splat(1.0) - weight;
        Self {
            x: self.x.mul_add(to_self, other.x * to_other),
            y: self.y.mul_add(to_self, other.y * to_other),
            z: self.z.mul_add(to_self, other.z * to_other),
            w: self.w.mul_add(to_self, other.w * to_other),
        }
    }

    #[inline(always)]
    pub(super) fn normalized(self) -> Self {
        self.scaled(L::splat(1.0) / self.dot(self).sqrt())
    }

    /// The same of what stands between two keys, times [`ONE`] squared. With m the square of its length,
    /// 1 / √m = 15/8 - 5/4 m + 3/8 m² + 5/16 (1 - m)³ + …, of which the last is below 1e-8: keys are no further apart than
    /// [`WIDEST`](super::quantise::WIDEST). Written as a square and a rest, it takes two products.
    #[inline(always)]
    pub(super) fn between_keys_normalized(self) -> Self {
        const UNIT: f64 = ONE as f64;
        const ROOT: f64 = 0.612_372_435_695_794_5;
        const SLOPE: f64 = ROOT / (UNIT * UNIT * UNIT * UNIT * UNIT);
        const START: f64 = -ROOT * 5.0 / (3.0 * UNIT);
        const REST: f64 = 5.0 / (6.0 * UNIT * UNIT);
        let m = self.dot(self);
        let root = m.mul_add(L::splat(SLOPE as f32), L::splat(START as f32));
        self.scaled(root.mul_add(root, L::splat(REST as f32)))
    }
}

/// A joint's motion under its parent, for each lane.
#[derive(Clone, Copy)]
pub(super) struct Local<L> {
    pub(super) turn: QuatLanes<L>,
    pub(super) place: [L; 3],
}

impl<L: Lanes> Local<L> {
    /// The same for all.
    #[inline(always)]
    pub(super) fn splat(turn: Quat, place: Vec3) -> Self {
        Self {
            turn: QuatLanes {
                x: L::splat(turn.x),
                y: L::splat(turn.y),
                z: L::splat(turn.z),
                w: L::splat(turn.w),
            },
            place: [L::splat(place.x), L::splat(place.y), L::splat(place.z)],
        }
    }
}
