//! Getting out of the way: by the trunk alone, by a hair, or with the feet.
//!
//! An evasion starts when the first of it can be seen, and is out of the way 0.2 to 0.35 s later.

use glam::Vec3;

use super::keys::Body;
use super::rhythm::Rhythm;
use super::score::Score;
use super::skeleton::{LEFT, RIGHT, sign, striking_arm};

/// All clips of this family: each evasion twice, the second time wider or tighter.
pub(super) fn scores(scores: &mut Vec<Score>) {
    type Dodge = fn(&mut Score, f32);
    let dodges: [(&str, Dodge, [f32; 2]); 23] = [
        ("duck", duck, [1.0, 0.75]),
        ("duck_step_left", |s, k| duck_step(s, LEFT, k), [1.0, 1.25]),
        (
            "duck_step_right",
            |s, k| duck_step(s, RIGHT, k),
            [1.0, 1.25],
        ),
        ("slip_left", |s, k| slip(s, LEFT, k), [1.0, 0.75]),
        ("slip_right", |s, k| slip(s, RIGHT, k), [1.0, 0.75]),
        ("sway_back", sway_back, [1.0, 0.75]),
        ("side_step_left", |s, k| side_step(s, LEFT, k), [0.6, 0.75]),
        (
            "side_step_right",
            |s, k| side_step(s, RIGHT, k),
            [0.6, 0.75],
        ),
        ("leap_back", leap_back, [0.75, 0.9]),
        ("quick_retreat", quick_retreat, [0.6, 0.72]),
        ("bob_and_weave_left", |s, k| weave(s, LEFT, k), [1.0, 0.9]),
        ("bob_and_weave_right", |s, k| weave(s, RIGHT, k), [1.0, 0.9]),
        ("pivot_away", pivot_away, [1.0, 0.8]),
        ("fade_turn", fade_turn, [1.0, 0.85]),
        ("low_crouch", low_crouch, [1.0, 0.92]),
        ("jump_left", |s, k| jump_side(s, LEFT, k), [0.8, 0.9]),
        ("jump_right", |s, k| jump_side(s, RIGHT, k), [0.8, 0.9]),
        ("angle_back_left", |s, k| angle_back(s, LEFT, k), [1.0, 1.2]),
        (
            "angle_back_right",
            |s, k| angle_back(s, RIGHT, k),
            [1.0, 1.2],
        ),
        ("draw_leg_back", draw_leg_back, [1.0, 0.85]),
        ("hop_over", hop_over, [1.0, 0.85]),
        ("lean_left", |s, k| lean(s, LEFT, k), [1.0, 0.8]),
        ("lean_right", |s, k| lean(s, RIGHT, k), [1.0, 0.8]),
    ];
    for (number, (name, dodge, sizes)) in (100..).zip(dodges) {
        let mut s = Score::new(name, Rhythm::varied(number));
        s.guard(0.55);
        for size in sizes {
            s.begin(0.0);
            dodge(&mut s, size);
            s.evaded();
            s.guard(0.75);
        }
        scores.push(s);
    }
    scores.push(sway_and_counter());
}

/// Hands close to the face.
fn shell(b: &mut Body) {
    b.hands[LEFT] = Vec3::new(0.085, 0.22, 0.22);
    b.hands[RIGHT] = Vec3::new(-0.08, 0.22, 0.2);
    b.elbows = [0.22, 0.22];
}

fn duck(s: &mut Score, k: f32) {
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

fn duck_step(s: &mut Score, side: usize, k: f32) {
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

/// By a hair: the head goes off the line, the weight onto that foot.
fn slip(s: &mut Score, side: usize, k: f32) {
    let d = sign(side);
    s.pose(0.22, |b| {
        b.pelvis += Vec3::new(0.07 * d * k, -0.07 * k, 0.02 * d);
        b.hips += Vec3::new(0.02, -0.14 * d, 0.04 * d);
        b.chest += Vec3::new(0.14, -0.34 * d, 0.46 * d * k);
        b.head += Vec3::new(0.03, 0.0, 0.2 * d * k);
        b.heels[1 - side] = 0.22;
        b.hands[side] += Vec3::new(0.0, 0.03, -0.04);
        b.elbows = [0.25, 0.25];
    });
    s.hold(0.09);
    s.guard(0.32);
}

/// The trunk goes back, the feet stay.
fn sway_back(s: &mut Score, k: f32) {
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
fn lean(s: &mut Score, side: usize, k: f32) {
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

fn side_step(s: &mut Score, side: usize, far: f32) {
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

fn leap_back(s: &mut Score, far: f32) {
    s.travel(0.0, -far, 0.0);
    s.leap(LEFT, 0.10, 0.36, 0.10).leap(RIGHT, 0.13, 0.38, 0.08);
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
fn quick_retreat(s: &mut Score, far: f32) {
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

/// Under a round blow: down on one side, along below, up on the other.
fn weave(s: &mut Score, side: usize, k: f32) {
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

/// Round the front foot, out to the left, facing back in.
fn pivot_away(s: &mut Score, k: f32) {
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
fn fade_turn(s: &mut Score, k: f32) {
    s.travel(-0.04, -0.16 * k, 0.0);
    s.step_off(RIGHT, 0.0, 0.26, Vec3::new(0.12, -0.6, -0.14));
    s.pivot(LEFT, 0.06, 0.22, -0.55);
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

/// Nearly to the ground, a hand at it.
fn low_crouch(s: &mut Score, k: f32) {
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

fn jump_side(s: &mut Score, side: usize, far: f32) {
    let d = sign(side);
    s.travel(far * d, -0.03, -0.1 * d);
    s.leap(side, 0.10, 0.36, 0.11)
        .leap(1 - side, 0.15, 0.37, 0.10);
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
fn angle_back(s: &mut Score, side: usize, k: f32) {
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
fn draw_leg_back(s: &mut Score, k: f32) {
    s.travel(-0.02, -0.13 * k, 0.0);
    s.step_off(LEFT, 0.0, 0.24, Vec3::new(0.0, 0.05, -0.24 * k));
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
fn hop_over(s: &mut Score, k: f32) {
    s.leap(LEFT, 0.13, 0.42, 0.30 * k)
        .leap(RIGHT, 0.15, 0.42, 0.30 * k);
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

/// Back out of reach of a blow, and forward again behind it.
fn sway_and_counter() -> Score {
    let mut s = Score::new("sway_and_counter", Rhythm::varied(140));
    s.guard(0.55);
    for size in [0.9, 1.0] {
        s.begin(0.0);
        sway_back(&mut s, size);
        s.evaded();
        s.begin(0.04);
        s.pivot(RIGHT, 0.04, 0.17, 0.6);
        s.pose(0.22, |b| {
            b.pelvis += Vec3::new(0.03, -0.03, 0.1);
            b.hips.y += 0.6;
            b.chest += Vec3::new(0.12, 0.9, 0.03);
            b.heels[RIGHT] = 0.5;
            b.reach[RIGHT] = Vec3::new(0.0, 1.44, 0.84);
            b.reaching[RIGHT] = 1.0;
            b.elbows[RIGHT] = 0.7;
            b.hands[LEFT] = Vec3::new(0.09, 0.2, 0.2);
        });
        s.hold(0.04);
        s.pivot(RIGHT, 0.0, 0.26, 0.0);
        s.pose(0.3, |_| {});
        s.struck(striking_arm(RIGHT));
        s.guard(0.6);
    }
    s
}
