//! Strikes with the fists.

use glam::Vec3;

use super::super::choreography::Choreography;
use super::super::keys::Body;
use super::super::skeleton::{LEFT, RIGHT, striking_arm};

/// Lead hand, straight at the face.
pub(super) fn jab(s: &mut Choreography, size: f32) {
    s.pose(0.09, |b| {
        b.hands[LEFT].z -= 0.02;
        b.chest.y += 0.06;
    });
    s.begin(0.0);
    let out = |b: &mut Body| {
        b.pelvis += Vec3::new(0.0, -0.02, 0.06);
        b.hips.y -= 0.1;
        b.chest += Vec3::new(0.02, -0.38, 0.0);
        b.head.x += 0.06;
        b.reach[LEFT] = Vec3::new(0.03, 1.45, 0.78 * size);
        b.reaching[LEFT] = 1.0;
        b.elbows[LEFT] = 0.7;
        b.hands[RIGHT] += Vec3::new(0.0, 0.02, -0.02);
        b.heels[RIGHT] = 0.2;
    };
    s.pose(0.16, out).hold(0.04);
    s.pose(0.24, |b| b.reach[LEFT].z = 0.4);
    s.struck(striking_arm(LEFT));
    s.guard(0.16);
}

/// Rear hand, straight, with the hip behind it.
pub(super) fn cross(s: &mut Choreography, size: f32) {
    s.pose(0.1, |b| {
        b.pelvis.z -= 0.015;
        b.chest.y -= 0.06;
    });
    s.begin(0.0);
    s.foot(RIGHT, 0.0, 0.17).pivot(0.6);
    s.pose(0.18, |b| {
        b.pelvis += Vec3::new(0.03, -0.035, 0.09);
        b.hips.y += 0.62;
        b.chest += Vec3::new(0.1, 0.92, 0.04);
        b.head.x += 0.08;
        b.heels[RIGHT] = 0.5;
        b.reach[RIGHT] = Vec3::new(0.0, 1.44, 0.84 * size);
        b.reaching[RIGHT] = 1.0;
        b.elbows[RIGHT] = 0.7;
        b.hands[LEFT] = Vec3::new(0.09, 0.2, 0.2);
    });
    s.hold(0.05);
    s.foot(RIGHT, 0.0, 0.26).pivot(0.0);
    s.pose(0.26, |b| b.reach[RIGHT].z = 0.45);
    s.struck(striking_arm(RIGHT));
    s.guard(0.18);
}

/// Lead hand, round from the side, elbow level.
pub(super) fn hook(s: &mut Choreography, size: f32) {
    s.pose(0.15, |b| {
        b.pelvis += Vec3::new(0.03, -0.025, 0.02);
        b.hips.y += 0.2;
        b.chest += Vec3::new(0.05, 0.38, 0.08);
        b.reach[LEFT] = Vec3::new(0.42, 1.36, 0.24);
        b.reaching[LEFT] = 0.6;
        b.elbows[LEFT] = 0.9;
    });
    s.begin(0.0);
    s.foot(LEFT, 0.0, 0.18).pivot(-0.75);
    s.pose(0.15, |b| {
        b.pelvis += Vec3::new(-0.01, -0.02, 0.03);
        b.hips.y -= 0.35;
        b.chest += Vec3::new(0.03, -0.45, 0.0);
        b.heels[LEFT] = 0.45;
        b.reach[LEFT] = Vec3::new(0.03, 1.45, 0.52 * size);
        b.reaching[LEFT] = 1.0;
        b.elbows[LEFT] = 1.45;
    });
    s.pose(0.07, |b| {
        b.pelvis += Vec3::new(-0.02, -0.02, 0.02);
        b.hips.y -= 0.42;
        b.chest += Vec3::new(0.03, -0.62, -0.02);
        b.heels[LEFT] = 0.4;
        b.reach[LEFT] = Vec3::new(-0.16, 1.44, 0.42);
        b.reaching[LEFT] = 0.9;
        b.elbows[LEFT] = 1.4;
    });
    s.foot(LEFT, 0.02, 0.28).pivot(0.0);
    s.guard(0.3).struck(striking_arm(LEFT));
    s.guard(0.12);
}

/// Rear hand, up from below under the chin.
pub(super) fn uppercut(s: &mut Choreography, size: f32) {
    s.pose(0.18, |b| {
        b.pelvis += Vec3::new(-0.03, -0.09, 0.0);
        b.hips.y -= 0.08;
        b.chest += Vec3::new(0.14, -0.12, -0.1);
        b.hands[RIGHT] = Vec3::new(-0.19, -0.06, 0.18);
        b.reach[RIGHT] = Vec3::new(-0.12, 1.05, 0.35);
        b.elbows[RIGHT] = 0.2;
    });
    s.begin(0.0);
    s.foot(RIGHT, 0.02, 0.16).pivot(0.5);
    s.pose(0.18, |b| {
        b.pelvis += Vec3::new(0.03, 0.015, 0.07);
        b.hips.y += 0.5;
        b.chest += Vec3::new(-0.1, 0.78, 0.02);
        b.heels[RIGHT] = 0.45;
        b.reach[RIGHT] = Vec3::new(0.0, 1.50, 0.50 * size);
        b.reaching[RIGHT] = 1.0;
        b.elbows[RIGHT] = 0.15;
        b.hands[LEFT] = Vec3::new(0.1, 0.21, 0.22);
    });
    s.hold(0.05);
    s.foot(RIGHT, 0.0, 0.26).pivot(0.0);
    s.guard(0.28).struck(striking_arm(RIGHT));
    s.guard(0.12);
}

/// Lead hand, loaded at the far shoulder, whipped outwards.
pub(super) fn backfist(s: &mut Choreography, size: f32) {
    s.pose(0.2, |b| {
        b.pelvis += Vec3::new(-0.02, -0.02, 0.0);
        b.chest += Vec3::new(0.04, -0.3, 0.0);
        b.hands[LEFT] = Vec3::new(-0.1, 0.14, 0.25);
        b.elbows[LEFT] = 1.2;
    });
    s.begin(0.0);
    s.pose(0.16, |b| {
        b.pelvis += Vec3::new(0.03, -0.01, 0.05);
        b.chest += Vec3::new(0.0, 0.12, 0.05);
        b.reach[LEFT] = Vec3::new(0.2, 1.5, 0.70 * size);
        b.reaching[LEFT] = 1.0;
        b.elbows[LEFT] = 1.3;
    });
    s.pose(0.06, |b| {
        b.pelvis += Vec3::new(0.03, -0.01, 0.05);
        b.chest += Vec3::new(0.0, 0.18, 0.06);
        b.reach[LEFT] = Vec3::new(0.36, 1.49, 0.60 * size);
        b.reaching[LEFT] = 1.0;
        b.elbows[LEFT] = 1.3;
    });
    s.guard(0.3).struck(striking_arm(LEFT));
    s.guard(0.15);
}

/// Lead hand, low, under the guard.
pub(super) fn body_jab(s: &mut Choreography, size: f32) {
    s.pose(0.12, |b| b.pelvis.y -= 0.05);
    s.begin(0.0);
    s.pose(0.18, |b| {
        b.pelvis += Vec3::new(0.02, -0.17, 0.06);
        b.hips.x += 0.12;
        b.chest += Vec3::new(0.28, -0.34, -0.04);
        b.head.x -= 0.05;
        b.reach[LEFT] = Vec3::new(0.02, 1.06, 0.84 * size);
        b.reaching[LEFT] = 1.0;
        b.elbows[LEFT] = 0.5;
    });
    s.hold(0.05);
    s.guard(0.34).struck(striking_arm(LEFT));
    s.guard(0.12);
}
