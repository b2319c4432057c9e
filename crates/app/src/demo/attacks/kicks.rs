//! Kicks, all with the rear leg; the other foot turns on its ball.

use glam::Vec3;

use super::super::choreography::Choreography;
use super::super::feet::AirKey;
use super::super::skeleton::{LEFT, RIGHT, striking_leg};

fn air(after: f32, ankle: [f32; 3], knee: [f32; 3]) -> AirKey {
    AirKey {
        after,
        ankle: Vec3::from_array(ankle),
        point: 0.0,
        knee: Vec3::from_array(knee),
    }
}

/// Rear foot, straight at the belly, with the ball of the foot.
pub(super) fn front_kick(s: &mut Choreography, size: f32) {
    let way = [
        air(0.20, [-0.06, 0.52, 0.12], [0.0, 0.3, 1.0]).pointed(0.1),
        air(0.38, [0.0, 1.0, 1.04 * size], [0.0, 1.0, 0.6]).pointed(0.35),
        air(0.42, [0.0, 1.0, 1.04 * size], [0.0, 1.0, 0.6]).pointed(0.35),
        air(0.58, [-0.05, 0.58, 0.28], [0.0, 0.4, 1.0]).pointed(0.1),
    ];
    s.pose(0.2, |b| {
        b.pelvis += Vec3::new(0.01, -0.01, 0.04);
        b.hips.y += 0.1;
    });
    s.begin(0.0);
    s.foot(RIGHT, 0.0, 0.86).kick(&way);
    s.pose(0.2, |b| {
        b.pelvis += Vec3::new(0.03, 0.02, 0.06);
        b.hips += Vec3::new(-0.12, 0.4, 0.0);
        b.chest += Vec3::new(-0.08, 0.35, 0.0);
    });
    s.pose(0.18, |b| {
        b.pelvis += Vec3::new(0.03, 0.02, 0.12);
        b.hips += Vec3::new(-0.38, 0.6, 0.03);
        b.chest += Vec3::new(-0.32, 0.5, 0.02);
        b.hands[RIGHT] += Vec3::new(-0.1, -0.15, 0.0);
        b.heels[LEFT] = 0.08;
    });
    s.pose(0.2, |b| {
        b.pelvis += Vec3::new(0.03, 0.0, 0.07);
        b.hips += Vec3::new(-0.1, 0.4, 0.0);
        b.chest += Vec3::new(-0.08, 0.3, 0.0);
    });
    s.struck(striking_leg(RIGHT));
    s.guard(0.36).guard(0.1);
}

/// Rear shin, round at the thigh.
pub(super) fn low_kick(s: &mut Choreography, size: f32) {
    let way = [
        air(0.17, [-0.38, 0.42, -0.10], [-0.5, 0.3, 0.8]).pointed(0.5),
        air(0.34, [0.0, 0.46, 1.0 * size], [-0.5, 0.7, 0.4]).pointed(0.6),
        air(0.39, [0.14, 0.46, 0.95 * size], [-0.4, 0.7, 0.4]).pointed(0.6),
        air(0.54, [-0.12, 0.38, 0.2], [0.0, 0.2, 1.0]).pointed(0.4),
    ];
    s.pose(0.16, |b| b.pelvis += Vec3::new(0.02, -0.02, 0.04));
    s.begin(0.0);
    s.foot(LEFT, -0.04, 0.26).pivot(0.75);
    s.foot(RIGHT, 0.0, 0.84).kick(&way);
    s.pose(0.34, |b| {
        b.pelvis += Vec3::new(0.04, 0.01, 0.1);
        b.hips += Vec3::new(-0.12, 0.95, 0.12);
        b.chest += Vec3::new(0.0, 0.72, 0.16);
        b.hands[RIGHT] = Vec3::new(-0.32, -0.27, -0.1);
        b.elbows[RIGHT] = 0.4;
        b.hands[LEFT] += Vec3::new(-0.03, 0.02, -0.08);
    });
    s.hold(0.03);
    s.foot(LEFT, 0.06, 0.3).pivot(0.0);
    s.pose(0.2, |b| {
        b.pelvis += Vec3::new(0.03, 0.0, 0.06);
        b.hips.y += 0.45;
        b.chest.y += 0.35;
        b.hands[RIGHT] += Vec3::new(-0.04, -0.05, 0.0);
    });
    s.struck(striking_leg(RIGHT));
    s.guard(0.34).guard(0.12);
}

/// Rear foot, round at the ribs, the trunk leaning away.
pub(super) fn roundhouse(s: &mut Choreography, size: f32) {
    let way = [
        air(0.24, [-0.44, 0.66, -0.10], [-0.5, 0.5, 0.7]).pointed(0.6),
        air(0.45, [0.0, 1.14, 0.96 * size], [-0.45, 0.8, 0.45]).pointed(0.7),
        air(0.50, [0.12, 1.15, 0.93 * size], [-0.4, 0.85, 0.4]).pointed(0.7),
        air(0.68, [-0.14, 0.6, 0.28], [-0.1, 0.5, 1.0]).pointed(0.4),
    ];
    s.pose(0.2, |b| {
        b.pelvis += Vec3::new(0.02, -0.02, 0.04);
        b.chest.y -= 0.05;
    });
    s.begin(0.0);
    s.foot(LEFT, -0.04, 0.32).pivot(1.15);
    s.foot(RIGHT, 0.0, 0.98).kick(&way);
    s.pose(0.22, |b| {
        b.pelvis += Vec3::new(0.04, 0.02, 0.07);
        b.hips += Vec3::new(-0.2, 0.7, 0.2);
        b.chest += Vec3::new(-0.15, 0.4, 0.12);
    });
    s.pose(0.18, |b| {
        b.pelvis += Vec3::new(0.05, 0.02, 0.1);
        b.hips += Vec3::new(-0.35, 1.35, 0.45);
        b.chest += Vec3::new(-0.4, 1.0, 0.35);
        b.hands[RIGHT] = Vec3::new(-0.33, -0.27, -0.1);
        b.elbows[RIGHT] = 0.4;
        b.heels[LEFT] = 0.15;
    });
    s.hold(0.03);
    s.foot(LEFT, 0.1, 0.34).pivot(0.0);
    s.pose(0.22, |b| {
        b.pelvis += Vec3::new(0.03, 0.01, 0.06);
        b.hips += Vec3::new(-0.08, 0.5, 0.05);
        b.chest += Vec3::new(-0.08, 0.35, 0.04);
    });
    s.struck(striking_leg(RIGHT));
    s.guard(0.4).guard(0.12);
}
