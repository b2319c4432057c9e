//! Getting out of the way: by the trunk alone, by a hair, or with the feet.
//!
//! An evasion starts when the first of it can be seen, and is out of the way 0.2 to 0.35 s later.

mod combined;
mod steps;
mod trunk;

use super::choreography::Choreography;
use super::rhythm::Rhythm;
use super::skeleton::{LEFT, RIGHT};
use steps::{
    angle_back, draw_leg_back, duck_step, fade_turn, hop_over, jump_side, leap_back, pivot_away,
    quick_retreat, side_step,
};
use trunk::{duck, lean, low_crouch, slip, sway_back, weave};

/// All clips of this family: each evasion twice, the second time wider or tighter.
pub(super) fn choreographies(choreographies: &mut Vec<Choreography>) {
    type Dodge = fn(&mut Choreography, f32);
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
        let mut s = Choreography::new(name, Rhythm::varied(number));
        s.guard(0.55);
        for size in sizes {
            s.begin(0.0);
            dodge(&mut s, size);
            s.evaded();
            s.guard(0.75);
        }
        choreographies.push(s);
    }
    combined::choreographies(choreographies);
}
