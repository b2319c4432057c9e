//! Breathing and bouncing, which overlay all other motion.

use std::f32::consts::TAU;

use glam::Vec3;

use super::keys::Body;

/// A small motion on top of the keys.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rhythm {
    /// Amplitude of the hips' vertical motion, in metres.
    pub(super) bob: f32,
    /// Bounces per second.
    pub(super) rate: f32,
    /// Amplitude of the hips' sideways drift, in metres.
    pub(super) sway: f32,
    /// Angle by which the heels rise with each bounce, in radians.
    pub(super) spring: f32,
    /// Offset of the hips in this clip's guard, in metres.
    pub(super) stance: Vec3,
    /// Offset of each foot in this clip's guard: left, turn left, forward, in metres and radians.
    pub(super) feet: [Vec3; 2],
    /// Offset of the chest's rotation in this clip's guard, in radians.
    pub(super) lean: Vec3,
    /// Offset of both wrists in this clip's guard, in metres.
    pub(super) hands: [Vec3; 2],
    /// Amplitude of the hands' drift, in metres.
    pub(super) wander: f32,
    /// Phase at the start, from 0 to 1.
    pub(super) phase: f32,
}

impl Rhythm {
    /// A slightly varied rhythm; equal numbers give equal rhythms.
    pub(super) fn varied(number: u32) -> Self {
        let unit = |part: u32| hashed(number.wrapping_mul(32).wrapping_add(part));
        let spread = |part: u32, x: f32, y: f32, z: f32| {
            let around = |part: u32| 2.0 * unit(part) - 1.0;
            Vec3::new(x * around(part), y * around(part + 1), z * around(part + 2))
        };
        Self {
            bob: 0.007 + 0.009 * unit(0),
            rate: 1.3 + 0.7 * unit(1),
            sway: 0.010 + 0.014 * unit(2),
            spring: 0.0,
            stance: spread(3, 0.025, 0.03, 0.035),
            feet: [spread(17, 0.05, 0.15, 0.07), spread(20, 0.05, 0.2, 0.07)],
            lean: spread(6, 0.09, 0.14, 0.08),
            hands: [spread(9, 0.04, 0.055, 0.07), spread(12, 0.03, 0.04, 0.05)],
            wander: 0.012 + 0.014 * unit(15),
            phase: unit(16),
        }
    }

    /// The rhythm with another bounce.
    pub(super) fn bouncing(self, bob: f32, rate: f32, spring: f32) -> Self {
        Self {
            bob,
            rate,
            spring,
            ..self
        }
    }

    /// The rhythm with another drift.
    pub(super) fn swaying(self, sway: f32) -> Self {
        Self { sway, ..self }
    }

    /// The rhythm in the plain guard.
    pub(super) fn plain(self) -> Self {
        Self {
            stance: Vec3::ZERO,
            feet: [Vec3::ZERO; 2],
            lean: Vec3::ZERO,
            hands: [Vec3::ZERO; 2],
            ..self
        }
    }

    /// Adds the motion to a body, at a time in seconds from the clip's start.
    pub(super) fn apply(&self, time: f32, body: &mut Body) {
        let cycle = |rate: f32, offset: f32| (TAU * (rate * time + self.phase + offset)).sin();
        let bob = cycle(self.rate, 0.0);
        let breath = cycle(0.31, 0.2);
        let drift = 0.65 * cycle(0.27, 0.4) + 0.35 * cycle(0.61, 0.9);
        let weight = 0.6 * cycle(0.35, 0.15) + 0.4 * cycle(0.5 * self.rate, 0.3);
        body.pelvis +=
            self.stance + Vec3::new(self.sway * drift, self.bob * bob, self.sway * weight);
        body.hips += Vec3::new(0.0, 0.5 * self.sway * weight, 0.8 * self.sway * drift);
        body.chest += self.lean
            + Vec3::new(
                0.012 * breath + 0.8 * self.bob * cycle(self.rate, 0.35),
                2.0 * self.wander * cycle(0.43, 0.6),
                0.8 * self.sway * drift,
            );
        body.head += Vec3::new(0.02 * breath, 0.03 * cycle(0.23, 0.1), 0.0);
        for side in 0..2 {
            let offset = 0.37 * side as f32;
            body.hands[side] += self.hands[side]
                + Vec3::new(
                    self.wander * cycle(0.53, offset),
                    0.6 * self.wander * cycle(0.39, 0.7 + offset)
                        + 0.9 * self.bob * cycle(self.rate, 0.55 + 0.1 * offset),
                    self.wander * cycle(0.71, 0.5 + offset),
                );
            body.heels[side] += self.spring * (0.5 + 0.5 * bob);
        }
    }
}

/// A number in [0, 1) that looks random (the finalizer of MurmurHash3).
fn hashed(number: u32) -> f32 {
    let mut h = number.wrapping_add(0x9e37_79b9);
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    h ^= h >> 16;
    (h >> 8) as f32 / 16_777_216.0
}
