//! Strikes: fists and feet, alone and together.

mod fists;
mod kicks;

use super::choreography::Choreography;
use super::locomotion::{Shuffle, shuffle};
use super::rhythm::Rhythm;
use super::skeleton::{LEFT, RIGHT};
use fists::{backfist, body_jab, cross, hook, jab, uppercut};
use kicks::{front_kick, low_kick, roundhouse};

/// All clips of this family.
pub(super) fn choreographies(choreographies: &mut Vec<Choreography>) {
    type Strike = fn(&mut Choreography, f32);
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
        let mut s = Choreography::new(name, Rhythm::varied(number));
        s.guard(0.6);
        strike(&mut s, 1.0);
        s.guard(0.7);
        strike(&mut s, 0.93);
        s.guard(0.7);
        choreographies.push(s);
    }
    choreographies.push(one_two());
    choreographies.push(step_in_jab());
}

fn one_two() -> Choreography {
    let mut s = Choreography::new("one_two", Rhythm::varied(70));
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

fn step_in_jab() -> Choreography {
    let mut s = Choreography::new("step_in_jab", Rhythm::varied(71));
    s.guard(0.5);
    s.travel(0.0, 0.32, 0.0);
    s.step(LEFT, 0.06, 0.24).step(RIGHT, 0.34, 0.24);
    s.partway(0.12, 0.1, |b| b.pelvis.y -= 0.03);
    jab(&mut s, 1.0);
    s.guard(0.5);
    shuffle(
        &mut s,
        Shuffle {
            forward: -0.3,
            ..Shuffle::default()
        },
    );
    s.guard(0.8);
    s
}
