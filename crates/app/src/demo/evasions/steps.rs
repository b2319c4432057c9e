//! Evasions with the feet: steps, leaps and turns out of the way.

use glam::Vec3;

use super::super::choreography::Choreography;
use super::super::skeleton::{LEFT, RIGHT, sign};
use super::trunk::shell;

/// Down and to a side, up again there.
pub(super) fn duck_step(s: &mut Choreography, side: usize, k: f32) {
    let d = sign(side);
    s.travel(0.38 * d * k, 0.02, -0.12 * d);
    s.step(side, 0.02, 0.24).step(1 - side, 0.30, 0.26);
    s.partway(0.28, 0.55, |b| {
        b.pelvis += Vec3::new(0.02 * d, -0.28, -0.02);
        b.hips += Vec3::new(0.2, 0.0, 0.08 * d);
        b.chest += Vec3::new(0.4, 0.0, 0.2 * d);
        b.head += Vec3::new(0.05, 0.0, 0.05 * d);
        shell(b);
    });
    s.pose(0.24, |b| {
        b.pelvis.y -= 0.17;
        b.chest += Vec3::new(0.2, 0.0, 0.05 * d);
        shell(b);
    });
    s.guard(0.3);
}

/// Quickly to a side, metres.
pub(super) fn side_step(s: &mut Choreography, side: usize, far: f32) {
    let d = sign(side);
    s.travel(far * d, 0.0, -0.15 * d);
    s.step(side, 0.0, 0.25).step(1 - side, 0.17, 0.28);
    s.partway(0.24, 0.6, |b| {
        b.pelvis.y -= 0.06;
        b.hips.z -= 0.04 * d;
        b.chest += Vec3::new(0.06, 0.0, 0.16 * d);
        b.head.z += 0.06 * d;
    });
    s.pose(0.2, |b| {
        b.pelvis += Vec3::new(0.02 * d, -0.05, 0.0);
        b.chest.z -= 0.05 * d;
    });
    s.guard(0.2);
}

/// Both feet off the ground, straight back, metres.
pub(super) fn leap_back(s: &mut Choreography, far: f32) {
    s.travel(0.0, -far, 0.0);
    s.foot(LEFT, 0.10, 0.36)
        .leap(0.10)
        .foot(RIGHT, 0.13, 0.38)
        .leap(0.08);
    s.partway(0.12, 0.06, |b| {
        b.pelvis.y -= 0.07;
        b.chest.x += 0.08;
    });
    s.partway(0.18, 0.55, |b| {
        b.pelvis.y += 0.05;
        b.hips.x += 0.1;
        b.chest.x += 0.12;
        b.hands[LEFT].z += 0.06;
    });
    s.pose(0.22, |b| {
        b.pelvis += Vec3::new(0.0, -0.12, 0.0);
        b.chest.x += 0.14;
        b.hands[LEFT].y -= 0.03;
    });
    s.guard(0.26);
}

/// Two quick steps straight back.
pub(super) fn quick_retreat(s: &mut Choreography, far: f32) {
    let first = 0.55 * far;
    s.travel(0.0, -first, 0.0);
    s.step(RIGHT, 0.0, 0.2).step(LEFT, 0.12, 0.2);
    s.partway(0.18, 0.7, |b| {
        b.pelvis.y -= 0.04;
        b.chest.x -= 0.14;
    });
    s.pose(0.14, |b| {
        b.pelvis.y -= 0.035;
        b.chest.x -= 0.06;
    });
    s.travel(0.0, first - far, 0.0);
    s.step(RIGHT, 0.0, 0.2).step(LEFT, 0.14, 0.2);
    s.partway(0.16, 0.6, |b| {
        b.pelvis.y -= 0.04;
        b.chest.x -= 0.08;
    });
    s.pose(0.18, |b| b.pelvis.y -= 0.025);
    s.guard(0.14);
}

/// Round the front foot, out to the left, facing back in.
pub(super) fn pivot_away(s: &mut Choreography, k: f32) {
    s.travel(0.42 * k, -0.06, -0.95 * k);
    s.step(LEFT, 0.0, 0.26).step(RIGHT, 0.16, 0.34);
    s.partway(0.24, 0.55, |b| {
        b.pelvis.y -= 0.05;
        b.chest += Vec3::new(0.05, -0.1, 0.16);
        b.head.y += 0.1;
        shell(b);
    });
    s.pose(0.27, |b| b.pelvis.y -= 0.04);
    s.guard(0.24);
}

/// The rear foot swings back and the body turns edge on: what was aimed at the chest goes by in front of it.
pub(super) fn fade_turn(s: &mut Choreography, k: f32) {
    s.travel(-0.04, -0.16 * k, 0.0);
    s.foot(RIGHT, 0.0, 0.26)
        .step_off(Vec3::new(0.12, -0.6, -0.14));
    s.foot(LEFT, 0.06, 0.22).pivot(-0.55);
    s.pose(0.27, |b| {
        b.pelvis += Vec3::new(0.07, -0.06, -0.06);
        b.hips += Vec3::new(-0.05, -0.85 * k, 0.0);
        b.chest += Vec3::new(-0.26, -0.95 * k, -0.02);
        b.head += Vec3::new(-0.05, -0.25, 0.0);
        b.hands[LEFT] += Vec3::new(0.02, -0.1, -0.04);
    });
    s.hold(0.14);
    s.step(RIGHT, 0.06, 0.26);
    s.pose(0.36, |b| b.pelvis.y -= 0.01);
    s.step(LEFT, -0.12, 0.2);
    s.guard(0.2);
}

/// Both feet off the ground, to a side, metres.
pub(super) fn jump_side(s: &mut Choreography, side: usize, far: f32) {
    let d = sign(side);
    s.travel(far * d, -0.03, -0.1 * d);
    s.foot(side, 0.10, 0.36)
        .leap(0.11)
        .foot(1 - side, 0.15, 0.37)
        .leap(0.10);
    s.partway(0.13, 0.08, |b| {
        b.pelvis.y -= 0.09;
        b.chest += Vec3::new(0.1, 0.0, 0.10 * d);
    });
    s.partway(0.18, 0.55, |b| {
        b.pelvis.y += 0.06;
        b.hips.z -= 0.06 * d;
        b.chest.z -= 0.05 * d;
        b.hands[side] += Vec3::new(0.06 * d, -0.04, 0.0);
    });
    s.pose(0.22, |b| {
        b.pelvis += Vec3::new(-0.02 * d, -0.14, 0.0);
        b.chest += Vec3::new(0.14, 0.0, -0.12 * d);
    });
    s.guard(0.28);
}

/// Back and to a side in one step, facing in again.
pub(super) fn angle_back(s: &mut Choreography, side: usize, k: f32) {
    let d = sign(side);
    s.travel(0.34 * d * k, -0.34 * k, -0.4 * d);
    let (first, second) = if side == RIGHT {
        (RIGHT, LEFT)
    } else {
        (LEFT, RIGHT)
    };
    s.step(first, 0.0, 0.25).step(second, 0.15, 0.28);
    s.partway(0.24, 0.6, |b| {
        b.pelvis.y -= 0.05;
        b.chest += Vec3::new(-0.14, 0.0, 0.1 * d);
        b.head.y += 0.15 * d;
    });
    s.pose(0.2, |b| b.pelvis.y -= 0.03);
    s.guard(0.22);
}

/// The front leg leaves its place, the hips go back; the head hardly moves.
pub(super) fn draw_leg_back(s: &mut Choreography, k: f32) {
    s.travel(-0.02, -0.13 * k, 0.0);
    s.foot(LEFT, 0.0, 0.24)
        .step_off(Vec3::new(0.0, 0.05, -0.24 * k));
    s.pose(0.25, |b| {
        b.pelvis += Vec3::new(-0.01, -0.02, -0.09 * k);
        b.hips.x += 0.22;
        b.chest.x += 0.3;
        b.head.x += 0.02;
        b.hands[LEFT] += Vec3::new(0.0, 0.02, 0.04);
    });
    s.hold(0.1);
    s.travel(0.02, 0.13 * k, 0.0);
    s.step(LEFT, 0.06, 0.26);
    s.guard(0.36);
}

/// Both knees up, over what sweeps the ground.
pub(super) fn hop_over(s: &mut Choreography, k: f32) {
    s.foot(LEFT, 0.13, 0.42)
        .leap(0.30 * k)
        .foot(RIGHT, 0.15, 0.42)
        .leap(0.30 * k);
    s.pose(0.13, |b| {
        b.pelvis.y -= 0.09;
        b.chest.x += 0.12;
    });
    s.pose(0.22, |b| {
        b.pelvis.y += 0.21 * k;
        b.chest.x += 0.14;
        b.hands[LEFT].y -= 0.04;
        b.hands[RIGHT].y -= 0.03;
    });
    s.pose(0.23, |b| {
        b.pelvis.y -= 0.12;
        b.chest.x += 0.15;
    });
    s.guard(0.28);
}
