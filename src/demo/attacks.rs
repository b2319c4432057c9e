//! Strikes: fists and feet, alone and together.

use glam::Vec3;

use super::feet::Air;
use super::locomotion::shuffle;
use super::rhythm::Rhythm;
use super::score::Score;
use super::skeleton::{LEFT, RIGHT, striking_arm, striking_leg};

/// All clips of this family.
pub(super) fn scores(scores: &mut Vec<Score>) {
    type Strike = fn(&mut Score, f32);
    let strikes: [(&str, Strike); 9] = [
        ("jab", jab),
        ("cross", cross),
        ("lead_hook", hook),
        ("uppercut", uppercut),
        ("backfist", backfist),
        ("body_jab", body_jab),
        ("front_kick", front_kick),
        ("low_kick", low_kick),
        ("roundhouse", roundhouse),
    ];
    for (number, (name, strike)) in (60..).zip(strikes) {
        let mut s = Score::new(name, Rhythm::varied(number));
        s.guard(0.6);
        strike(&mut s, 1.0);
        s.guard(0.7);
        strike(&mut s, 0.93);
        s.guard(0.7);
        scores.push(s);
    }
    scores.push(one_two());
    scores.push(step_in_jab());
}

fn one_two() -> Score {
    let mut s = Score::new("one_two", Rhythm::varied(70));
    s.guard(0.6);
    jab(&mut s, 0.95);
    cross(&mut s, 1.0);
    s.guard(0.8);
    jab(&mut s, 1.0);
    cross(&mut s, 0.97);
    hook(&mut s, 1.0);
    s.guard(0.8);
    s
}

fn step_in_jab() -> Score {
    let mut s = Score::new("step_in_jab", Rhythm::varied(71));
    s.guard(0.5);
    s.travel(0.0, 0.32, 0.0);
    s.step(LEFT, 0.06, 0.24).step(RIGHT, 0.34, 0.24);
    s.partway(0.12, 0.1, |b| b.pelvis.y -= 0.03);
    jab(&mut s, 1.0);
    s.guard(0.5);
    shuffle(&mut s, 0.0, -0.3, 0.0, 1.0);
    s.guard(0.8);
    s
}

/// Lead hand, straight at the face.
fn jab(s: &mut Score, size: f32) {
    s.pose(0.09, |b| {
        b.hands[LEFT].z -= 0.02;
        b.chest.y += 0.06;
    });
    s.begin(0.0);
    let out = |b: &mut super::keys::Body| {
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
fn cross(s: &mut Score, size: f32) {
    s.pose(0.1, |b| {
        b.pelvis.z -= 0.015;
        b.chest.y -= 0.06;
    });
    s.begin(0.0);
    s.pivot(RIGHT, 0.0, 0.17, 0.6);
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
    s.pivot(RIGHT, 0.0, 0.26, 0.0);
    s.pose(0.26, |b| b.reach[RIGHT].z = 0.45);
    s.struck(striking_arm(RIGHT));
    s.guard(0.18);
}

/// Lead hand, round from the side, elbow level.
fn hook(s: &mut Score, size: f32) {
    s.pose(0.15, |b| {
        b.pelvis += Vec3::new(0.03, -0.025, 0.02);
        b.hips.y += 0.2;
        b.chest += Vec3::new(0.05, 0.38, 0.08);
        b.reach[LEFT] = Vec3::new(0.42, 1.36, 0.24);
        b.reaching[LEFT] = 0.6;
        b.elbows[LEFT] = 0.9;
    });
    s.begin(0.0);
    s.pivot(LEFT, 0.0, 0.18, -0.75);
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
    s.pivot(LEFT, 0.02, 0.28, 0.0);
    s.guard(0.3).struck(striking_arm(LEFT));
    s.guard(0.12);
}

/// Rear hand, up from below under the chin.
fn uppercut(s: &mut Score, size: f32) {
    s.pose(0.18, |b| {
        b.pelvis += Vec3::new(-0.03, -0.09, 0.0);
        b.hips.y -= 0.08;
        b.chest += Vec3::new(0.14, -0.12, -0.1);
        b.hands[RIGHT] = Vec3::new(-0.19, -0.06, 0.18);
        b.reach[RIGHT] = Vec3::new(-0.12, 1.05, 0.35);
        b.elbows[RIGHT] = 0.2;
    });
    s.begin(0.0);
    s.pivot(RIGHT, 0.02, 0.16, 0.5);
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
    s.pivot(RIGHT, 0.0, 0.26, 0.0);
    s.guard(0.28).struck(striking_arm(RIGHT));
    s.guard(0.12);
}

/// Lead hand, loaded at the far shoulder, whipped outwards.
fn backfist(s: &mut Score, size: f32) {
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
fn body_jab(s: &mut Score, size: f32) {
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

fn air(after: f32, ankle: [f32; 3], point: f32, knee: [f32; 3]) -> Air {
    Air {
        after,
        ankle: Vec3::from_array(ankle),
        point,
        knee: Vec3::from_array(knee),
    }
}

/// Rear foot, straight at the belly, with the ball of the foot.
fn front_kick(s: &mut Score, size: f32) {
    let way = [
        air(0.20, [-0.06, 0.52, 0.12], 0.1, [0.0, 0.3, 1.0]),
        air(0.38, [0.0, 1.0, 0.92 * size], 0.35, [0.0, 1.0, 0.6]),
        air(0.42, [0.0, 1.0, 0.92 * size], 0.35, [0.0, 1.0, 0.6]),
        air(0.58, [-0.05, 0.58, 0.28], 0.1, [0.0, 0.4, 1.0]),
    ];
    s.pose(0.2, |b| {
        b.pelvis += Vec3::new(0.01, -0.01, 0.04);
        b.hips.y += 0.1;
    });
    s.begin(0.0);
    s.kick(RIGHT, 0.0, 0.86, &way);
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
fn low_kick(s: &mut Score, size: f32) {
    let way = [
        air(0.17, [-0.38, 0.42, -0.10], 0.5, [-0.5, 0.3, 0.8]),
        air(0.34, [0.0, 0.46, 0.86 * size], 0.6, [-0.5, 0.7, 0.4]),
        air(0.39, [0.12, 0.46, 0.82 * size], 0.6, [-0.4, 0.7, 0.4]),
        air(0.54, [-0.12, 0.38, 0.2], 0.4, [0.0, 0.2, 1.0]),
    ];
    s.pose(0.16, |b| b.pelvis += Vec3::new(0.02, -0.02, 0.04));
    s.begin(0.0);
    s.pivot(LEFT, -0.04, 0.26, 0.75);
    s.kick(RIGHT, 0.0, 0.84, &way);
    s.pose(0.34, |b| {
        b.pelvis += Vec3::new(0.04, 0.01, 0.1);
        b.hips += Vec3::new(-0.12, 0.95, 0.12);
        b.chest += Vec3::new(0.0, 0.72, 0.16);
        b.hands[RIGHT] = Vec3::new(-0.3, -0.1, -0.06);
        b.elbows[RIGHT] = 0.9;
        b.hands[LEFT] += Vec3::new(-0.03, 0.02, -0.08);
    });
    s.hold(0.03);
    s.pivot(LEFT, 0.06, 0.3, 0.0);
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
fn roundhouse(s: &mut Score, size: f32) {
    let way = [
        air(0.24, [-0.44, 0.66, -0.10], 0.6, [-0.5, 0.5, 0.7]),
        air(0.43, [0.0, 1.14, 0.80 * size], 0.7, [-0.45, 0.8, 0.45]),
        air(0.48, [0.11, 1.15, 0.77 * size], 0.7, [-0.4, 0.85, 0.4]),
        air(0.66, [-0.14, 0.6, 0.28], 0.4, [-0.1, 0.5, 1.0]),
    ];
    s.pose(0.2, |b| {
        b.pelvis += Vec3::new(0.02, -0.02, 0.04);
        b.chest.y -= 0.05;
    });
    s.begin(0.0);
    s.pivot(LEFT, -0.04, 0.32, 1.15);
    s.kick(RIGHT, 0.0, 0.96, &way);
    s.pose(0.22, |b| {
        b.pelvis += Vec3::new(0.04, 0.02, 0.07);
        b.hips += Vec3::new(-0.2, 0.7, 0.2);
        b.chest += Vec3::new(-0.15, 0.4, 0.12);
    });
    s.pose(0.18, |b| {
        b.pelvis += Vec3::new(0.05, 0.02, 0.1);
        b.hips += Vec3::new(-0.35, 1.35, 0.45);
        b.chest += Vec3::new(-0.4, 1.0, 0.35);
        b.hands[RIGHT] = Vec3::new(-0.3, -0.12, -0.05);
        b.elbows[RIGHT] = 0.8;
        b.heels[LEFT] = 0.15;
    });
    s.hold(0.03);
    s.pivot(LEFT, 0.1, 0.34, 0.0);
    s.pose(0.22, |b| {
        b.pelvis += Vec3::new(0.03, 0.01, 0.06);
        b.hips += Vec3::new(-0.08, 0.5, 0.05);
        b.chest += Vec3::new(-0.08, 0.35, 0.04);
    });
    s.struck(striking_leg(RIGHT));
    s.guard(0.4).guard(0.12);
}
