//! Evasions out of a movement, after one another, and before a blow.

use glam::Vec3;

use super::super::choreography::Choreography;
use super::super::locomotion::{Shuffle, shuffle};
use super::super::rhythm::Rhythm;
use super::super::skeleton::{LEFT, RIGHT, striking_arm};
use super::trunk::{duck, slip, slipped, sway_back, weave};

/// All clips of this family.
pub(super) fn choreographies(choreographies: &mut Vec<Choreography>) {
    choreographies.push(sway_and_counter());
    choreographies.push(slip_slip());
    choreographies.push(advance_and_slip());
    choreographies.push(circle_and_duck());
    choreographies.push(retreat_and_weave());
    choreographies.push(bounce_and_sway());
}

/// Back out of reach of a blow, and forward again behind it.
fn sway_and_counter() -> Choreography {
    let mut s = Choreography::new("sway_and_counter", Rhythm::varied(140));
    s.guard(0.55);
    for size in [0.9, 1.0] {
        s.begin(0.0);
        sway_back(&mut s, size);
        s.evaded();
        s.begin(0.04);
        s.foot(RIGHT, 0.04, 0.17).pivot(0.6);
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
        s.foot(RIGHT, 0.0, 0.26).pivot(0.0);
        s.pose(0.3, |_| {});
        s.struck(striking_arm(RIGHT));
        s.guard(0.6);
    }
    s
}

/// A slip to one side, then straight to the other side, as against two blows.
fn slip_slip() -> Choreography {
    let mut s = Choreography::new("slip_slip", Rhythm::varied(141));
    s.guard(0.55);
    for sides in [[LEFT, RIGHT], [RIGHT, LEFT]] {
        s.begin(0.0);
        s.pose(0.22, |b| slipped(b, sides[0], 0.95)).hold(0.03);
        s.pose(0.27, |b| slipped(b, sides[1], 0.95)).hold(0.06);
        s.guard(0.32).evaded();
        s.guard(0.75);
    }
    s
}

fn advance_and_slip() -> Choreography {
    let mut s = Choreography::new("advance_and_slip", Rhythm::varied(142));
    s.guard(0.5);
    for side in [RIGHT, LEFT] {
        shuffle(
            &mut s,
            Shuffle {
                forward: 0.24,
                quick: 0.95,
                ..Shuffle::default()
            },
        );
        s.guard(0.2).begin(0.0);
        slip(&mut s, side, 0.9);
        s.evaded().guard(0.6);
    }
    s
}

fn circle_and_duck() -> Choreography {
    let mut s = Choreography::new("circle_and_duck", Rhythm::varied(143));
    s.guard(0.5);
    for (left, turn) in [(0.27, -0.2), (-0.27, 0.2)] {
        shuffle(
            &mut s,
            Shuffle {
                left,
                forward: 0.02,
                turn,
                quick: 0.95,
            },
        );
        s.guard(0.2).begin(0.0);
        duck(&mut s, 0.85);
        s.evaded().guard(0.6);
    }
    s
}

fn retreat_and_weave() -> Choreography {
    let mut s = Choreography::new("retreat_and_weave", Rhythm::varied(144));
    s.guard(0.5);
    for side in [LEFT, RIGHT] {
        shuffle(
            &mut s,
            Shuffle {
                forward: -0.25,
                quick: 0.95,
                ..Shuffle::default()
            },
        );
        s.guard(0.2).begin(0.0);
        weave(&mut s, side, 0.95);
        s.evaded().guard(0.6);
    }
    s
}

fn bounce_and_sway() -> Choreography {
    let bounce = Rhythm::varied(145).bouncing(0.014, 2.0, 0.08);
    let mut s = Choreography::new("bounce_and_sway", bounce);
    s.guard(0.9);
    for size in [1.0, 0.85] {
        s.begin(0.0);
        sway_back(&mut s, size);
        s.evaded().guard(1.1);
    }
    s
}
