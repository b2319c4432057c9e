//! Evasions of the trunk: the feet stay where they are.

use glam::Vec3;

use super::super::choreography::Choreography;
use super::super::keys::Body;
use super::super::skeleton::{LEFT, RIGHT, sign};

/// Hands close to the face.
pub(super) fn shell(b: &mut Body) {
    b.hands[LEFT] = Vec3::new(0.085, 0.22, 0.22);
    b.hands[RIGHT] = Vec3::new(-0.08, 0.22, 0.2);
    b.elbows = [0.22, 0.22];
}

/// Straight down, the feet stay.
pub(super) fn duck(s: &mut Choreography, k: f32) {
    let down = |b: &mut Body| {
        b.pelvis += Vec3::new(0.0, -0.38 * k, -0.05);
        b.hips.x += 0.25;
        b.chest.x += 0.42 * k;
        b.head.x += 0.08;
        b.heels[RIGHT] = 0.35;
        shell(b);
    };
    s.pose(0.27, down);
    s.pose(0.16, |b| {
        down(b);
        b.pelvis.y += 0.02;
    });
    s.guard(0.4);
}

/// By a hair: the head goes off the line, the weight onto that foot.
pub(super) fn slip(s: &mut Choreography, side: usize, k: f32) {
    s.pose(0.22, |b| slipped(b, side, k));
    s.hold(0.09);
    s.guard(0.32);
}

/// The posture at the end of a slip.
pub(super) fn slipped(b: &mut Body, side: usize, k: f32) {
    let d = sign(side);
    b.pelvis += Vec3::new(0.07 * d * k, -0.07 * k, 0.02 * d);
    b.hips += Vec3::new(0.02, -0.14 * d, 0.04 * d);
    b.chest += Vec3::new(0.14, -0.34 * d, 0.46 * d * k);
    b.head += Vec3::new(0.03, 0.0, 0.2 * d * k);
    b.heels[1 - side] = 0.22;
    b.hands[side] += Vec3::new(0.0, 0.03, -0.04);
    b.elbows = [0.25, 0.25];
}

/// The trunk goes back, the feet stay.
pub(super) fn sway_back(s: &mut Choreography, k: f32) {
    let back = |b: &mut Body| {
        b.pelvis += Vec3::new(-0.03, -0.035, -0.13 * k);
        b.hips += Vec3::new(-0.16 * k, -0.1, 0.0);
        b.chest += Vec3::new(-0.62 * k, -0.16, 0.0);
        b.head += Vec3::new(-0.12 * k, 0.0, 0.0);
        b.hands[LEFT] += Vec3::new(0.0, -0.06, 0.02);
        b.hands[RIGHT] += Vec3::new(0.0, 0.02, 0.0);
        b.heels[LEFT] = 0.18 * k;
    };
    s.pose(0.24, back);
    s.pose(0.12, |b| {
        back(b);
        b.chest.x -= 0.03;
    });
    s.guard(0.34);
}

/// The trunk bends to a side over straight hips; the head dips.
pub(super) fn lean(s: &mut Choreography, side: usize, k: f32) {
    let d = sign(side);
    s.pose(0.26, |b| {
        b.pelvis += Vec3::new(0.12 * d * k, -0.15 * k, -0.02);
        b.hips += Vec3::new(0.05, 0.0, 0.10 * d);
        b.chest += Vec3::new(0.18, 0.18 * d, 0.7 * d * k);
        b.head += Vec3::new(0.0, 0.0, 0.42 * d * k);
        b.heels[1 - side] = 0.3;
        shell(b);
    });
    s.hold(0.12);
    s.guard(0.38);
}

/// Under a round blow: down on one side, along below, up on the other.
pub(super) fn weave(s: &mut Choreography, side: usize, k: f32) {
    let d = sign(side);
    let low = |b: &mut Body, across: f32, drop: f32| {
        b.pelvis += Vec3::new(0.09 * across, -drop * k, -0.02);
        b.hips += Vec3::new(0.14, 0.05 * across, 0.05 * across);
        b.chest += Vec3::new(0.34, -0.12 * across, 0.3 * across);
        b.head += Vec3::new(0.05, 0.0, 0.1 * across);
        shell(b);
    };
    s.pose(0.2, |b| low(b, -0.9 * d, 0.16));
    s.pose(0.17, |b| low(b, 0.0, 0.31));
    s.pose(0.17, |b| low(b, d, 0.17));
    s.pose(0.16, |b| low(b, 0.8 * d, 0.06));
    s.guard(0.3);
}

/// Nearly to the ground, a hand at it.
pub(super) fn low_crouch(s: &mut Choreography, k: f32) {
    let low = |b: &mut Body| {
        b.pelvis += Vec3::new(-0.02, -0.48 * k, -0.09);
        b.hips.x += 0.45;
        b.chest += Vec3::new(0.72 * k, -0.1, 0.05);
        b.head.x += 0.2;
        b.heels = [0.1, 0.7];
        b.hands[RIGHT] = Vec3::new(-0.07, 0.22, 0.2);
        b.reach[LEFT] = Vec3::new(0.24, 0.16, 0.38);
        b.reaching[LEFT] = 0.85;
        b.elbows = [0.6, 0.25];
    };
    s.pose(0.33, low);
    s.hold(0.22);
    s.pose(0.3, |b| {
        b.pelvis.y -= 0.16;
        b.chest.x += 0.2;
    });
    s.guard(0.26);
}
