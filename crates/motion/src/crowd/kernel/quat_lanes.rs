//! Rotations and positions, one for each lane.

use glam::{Quat, Vec3};

use crate::crowd::keys::tracks::ONE;
use crate::math::Lanes;

/// A rotation for each lane, of any length.
#[derive(Clone, Copy)]
pub(crate) struct QuatLanes<L> {
    pub(crate) x: L,
    pub(crate) y: L,
    pub(crate) z: L,
    pub(crate) w: L,
}

impl<L: Lanes> QuatLanes<L> {
    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> L {
        // In two halves, which do not wait for each other.
        self.y.mul_add(other.y, self.x * other.x) + self.w.mul_add(other.w, self.z * other.z)
    }

    #[inline(always)]
    pub(crate) fn scaled(self, factor: L) -> Self {
        Self {
            x: self.x * factor,
            y: self.y * factor,
            z: self.z * factor,
            w: self.w * factor,
        }
    }

    /// Linear interpolation of two rotations of length 1 along the shorter arc; the result has any length.
    #[inline(always)]
    pub(crate) fn towards(self, other: Self, weight: L) -> Self {
        self.mixed(
            L::splat(1.0) - weight,
            other,
            weight.copy_sign(self.dot(other)),
        )
    }

    /// [`QuatLanes::towards`] for rotations interpolated between two keys, which are scaled by [`ONE`] squared. `other` is
    /// scaled to the length of this one: with squares of lengths m and n next to 1, √(m / n) = 1 + (m - n) / 2 with an error
    /// below 4e-6.
    #[inline(always)]
    pub(crate) fn towards_between_keys(self, other: Self, weight: L) -> Self {
        const HALF: f32 = 0.5 / (ONE * ONE * ONE * ONE);
        let apart = self.dot(self) - other.dot(other);
        let ratio = apart.mul_add(L::splat(HALF), L::splat(1.0));
        let to_other = (weight * ratio).copy_sign(self.dot(other));
        self.mixed(L::splat(1.0) - weight, other, to_other)
    }

    /// The weighted sum of both.
    #[inline(always)]
    fn mixed(self, to_self: L, other: Self, to_other: L) -> Self {
        Self {
            x: self.x.mul_add(to_self, other.x * to_other),
            y: self.y.mul_add(to_self, other.y * to_other),
            z: self.z.mul_add(to_self, other.z * to_other),
            w: self.w.mul_add(to_self, other.w * to_other),
        }
    }

    #[inline(always)]
    pub(crate) fn normalized(self) -> Self {
        self.scaled(L::splat(1.0) / self.dot(self).sqrt())
    }

    /// [`QuatLanes::normalized`] for a rotation interpolated between two keys, which is scaled by [`ONE`] squared. With m
    /// the square of its length, 1 / √m = 15/8 - 5/4 m + 3/8 m² + 5/16 (1 - m)³ + …. The cubic term is below 1e-8, because
    /// keys are no further apart than [`WIDEST`](super::quantise::WIDEST). Completing the square saves a product.
    #[inline(always)]
    pub(crate) fn between_keys_normalized(self) -> Self {
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
pub(crate) struct Local<L> {
    pub(crate) turn: QuatLanes<L>,
    pub(crate) place: [L; 3],
}

impl<L: Lanes> Local<L> {
    /// The same motion with a rotation of length 1.
    #[inline(always)]
    pub(crate) fn normalized(self) -> Self {
        Self {
            turn: self.turn.normalized(),
            ..self
        }
    }

    /// The same rotation and position in all lanes.
    #[inline(always)]
    pub(crate) fn splat(turn: Quat, place: Vec3) -> Self {
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
