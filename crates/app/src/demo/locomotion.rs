//! Going from place to place in guard: shuffles, walks, turns, retreat and return.

use glam::Vec3;

use super::choreography::Choreography;
use super::rhythm::Rhythm;
use super::skeleton::{LEFT, RIGHT, sign};

/// All clips of this family.
pub(super) fn choreographies(choreographies: &mut Vec<Choreography>) {
    let ways = [
        ("shuffle_forward", [0.0, 0.28]),
        ("shuffle_back", [0.0, -0.28]),
        ("shuffle_left", [0.28, 0.0]),
        ("shuffle_right", [-0.28, 0.0]),
    ];
    for (number, (name, way)) in (20..).zip(ways) {
        choreographies.push(shuffles(name, number, way));
    }
    choreographies.push(walk("walk_forward", 24, 0.36));
    choreographies.push(walk("walk_back", 25, -0.30));
    choreographies.push(turns("turn_left", 26, 0.8));
    choreographies.push(turns("turn_right", 27, -0.8));
    choreographies.push(circle("circle_left", 28, LEFT));
    choreographies.push(circle("circle_right", 29, RIGHT));
    choreographies.push(retreat_and_return());
}

/// One shuffle.
#[derive(Clone, Copy)]
pub(super) struct Shuffle {
    /// Distance to the left, in metres.
    pub(super) left: f32,
    /// Distance forwards, in metres.
    pub(super) forward: f32,
    /// Rotation to the left, in radians.
    pub(super) turn: f32,
    /// Factor of its times. Default: 1.
    pub(super) quick: f32,
}

impl Default for Shuffle {
    fn default() -> Self {
        Self {
            left: 0.0,
            forward: 0.0,
            turn: 0.0,
            quick: 1.0,
        }
    }
}

/// Adds a shuffle: the foot on the side of the way goes first, the other follows.
pub(super) fn shuffle(s: &mut Choreography, shuffle: Shuffle) {
    let Shuffle {
        left,
        forward,
        turn,
        quick,
    } = shuffle;
    let leads_left = if left.abs() > forward.abs() {
        left > 0.0
    } else {
        forward > 0.0
    };
    let (first, second) = if leads_left {
        (LEFT, RIGHT)
    } else {
        (RIGHT, LEFT)
    };
    s.travel(left, forward, turn);
    s.step(first, 0.04 * quick, 0.22 * quick);
    s.step(second, 0.21 * quick, 0.22 * quick);
    s.partway(0.2 * quick, 0.5, |b| {
        b.pelvis.y -= 0.02;
        b.chest += Vec3::new(0.12 * forward, 0.0, 0.12 * left);
    });
    s.pose(0.24 * quick, |b| b.pelvis.y -= 0.012);
}

/// Three shuffles of different sizes, by (left, forward) metres.
fn shuffles(name: &str, number: u32, [left, forward]: [f32; 2]) -> Choreography {
    let mut s = Choreography::new(name, Rhythm::varied(number));
    s.guard(0.6);
    for size in [1.0, 1.25, 0.8] {
        shuffle(
            &mut s,
            Shuffle {
                left: left * size,
                forward: forward * size,
                ..Shuffle::default()
            },
        );
        s.guard(0.45);
    }
    s.guard(0.7);
    s
}

/// Loose steps, the hands lower, as between two rounds.
fn walk(name: &str, number: u32, stride: f32) -> Choreography {
    const STEP: f32 = 0.52;
    let mut s = Choreography::new(name, Rhythm::varied(number));
    s.guard(0.7);
    for step in 0..6_usize {
        // Backwards the front foot goes first.
        let first = if stride > 0.0 { RIGHT } else { LEFT };
        let side = if step % 2 == 0 { first } else { 1 - first };
        let last = step == 5;
        let share = [0.6, 1.0, 1.0, 1.0, 0.6, 0.0][step];
        s.travel(0.0, stride * share, 0.0);
        // In mid-walk the feet go straight, beside each other's line.
        let ahead = 0.5 * stride + if side == LEFT { -0.2 } else { 0.15 };
        let straight = if side == LEFT { 0.1 } else { 0.45 };
        let narrow = -0.015 * sign(side);
        let off = if step >= 4 {
            Vec3::ZERO
        } else {
            Vec3::new(narrow, straight, ahead)
        };
        s.foot(side, 0.06, STEP - 0.1).step_off(off);
        let swing = 0.5 * sign(side) * stride;
        s.pose(STEP, |b| {
            if !last {
                b.pelvis += Vec3::new(0.0, 0.012, 0.0);
                b.hips.y = 0.35 * b.hips.y - 0.25 * swing;
                b.chest.y = 0.35 * b.chest.y + 0.25 * swing;
                b.chest.x -= 0.06;
                b.hands[LEFT] += Vec3::new(0.02, -0.12, -0.05 - 0.2 * swing);
                b.hands[RIGHT] += Vec3::new(-0.05, -0.12, 0.02 + 0.2 * swing);
            }
        });
    }
    s.guard(0.4).guard(0.7);
    s
}

/// Two turns in place and a wider one, all to one side.
fn turns(name: &str, number: u32, angle: f32) -> Choreography {
    let mut s = Choreography::new(name, Rhythm::varied(number));
    s.guard(0.6);
    let (first, second) = if angle > 0.0 {
        (RIGHT, LEFT)
    } else {
        (LEFT, RIGHT)
    };
    for size in [1.0, 0.6, 1.3] {
        s.travel(0.0, 0.0, angle * size);
        s.step(first, 0.06, 0.28).step(second, 0.36, 0.28);
        s.partway(0.36, 0.5, |b| {
            b.pelvis.y -= 0.015;
            b.head.y += 0.25 * angle;
            b.chest.y += 0.12 * angle;
        });
        s.pose(0.34, |_| {});
        s.guard(0.45);
    }
    s.guard(0.6);
    s
}

/// Round an opponent 1.3 m ahead.
fn circle(name: &str, number: u32, side: usize) -> Choreography {
    let mut s = Choreography::new(name, Rhythm::varied(number));
    s.guard(0.6);
    let (left, turn) = (0.3 * sign(side), -0.23 * sign(side));
    for quick in [1.0, 0.95, 1.1, 1.0] {
        shuffle(
            &mut s,
            Shuffle {
                left,
                forward: 0.03,
                turn,
                quick,
            },
        );
        s.guard(0.3);
    }
    s.guard(0.7);
    s
}

fn retreat_and_return() -> Choreography {
    let mut s = Choreography::new("retreat_and_return", Rhythm::varied(30));
    s.guard(0.6);
    for back in [0.3, 0.34] {
        shuffle(
            &mut s,
            Shuffle {
                forward: -back,
                quick: 0.85,
                ..Shuffle::default()
            },
        );
        s.guard(0.15);
    }
    s.guard(0.6);
    for forward in [0.26, 0.3, 0.2] {
        shuffle(
            &mut s,
            Shuffle {
                forward,
                quick: 0.95,
                ..Shuffle::default()
            },
        );
        s.guard(0.22);
    }
    s.guard(0.7);
    s
}
