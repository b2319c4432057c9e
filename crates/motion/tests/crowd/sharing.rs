//! Promise: characters that share their loads of keys are posed as those that are read one by one, however far apart they are in
//! time, and wherever a clip has more keys than frames.

use glam::Quat;
use sabaki_fixtures::clips::{small_skeleton, swinging_clip};
use sabaki_fixtures::crowd::{Stage, furthest, outputs, settings};
use sabaki_motion::anim::{Clip, Skeleton};
use sabaki_motion::crowd::{Character, ClipId, ClipMix, LevelId, Output};
use sabaki_motion::math::Isa;

use super::pose::{NEAR, stage};

/// A swing in which a joint turns by more than a radian from one frame to the next, twice.
fn jerking_clip(skeleton: &Skeleton, seed: f32) -> Clip {
    let mut desc = swinging_clip(skeleton, 120, seed).desc();
    for frame in 40..80 {
        desc.rotations[frame * skeleton.len() + 1] *= Quat::from_rotation_x(1.3);
    }
    Clip::new(skeleton, desc).unwrap()
}

#[test]
fn fast_turns_take_keys_where_they_are_and_nowhere_else() {
    let skeleton = small_skeleton();
    let even = vec![
        swinging_clip(&skeleton, 120, 0.3),
        swinging_clip(&skeleton, 120, 1.1),
    ];
    let uneven = vec![jerking_clip(&skeleton, 0.3), even[1].clone()];
    let even = Stage::new(skeleton.clone(), even, &[1, 3, 5]);
    let stage = Stage::new(skeleton, uneven, &[1, 3, 5]);
    let [few, more] = [&even, &stage].map(|stage| stage.animations.bytes() as f64);
    assert!(more < 1.2 * few, "{more} bytes, {few} without fast turns");
    let mut characters = stage.characters(400, 7);
    // Some near each other, around the fast turns.
    for (index, character) in characters.iter_mut().enumerate().take(160) {
        (character.clip, character.level) = (ClipId(0), LevelId(0));
        (character.time, character.speed) = (1.2 + 0.01 * index as f32, 1.0);
        character.fade = None;
    }
    for isa in Isa::available() {
        for output in outputs() {
            for seconds in [0.0, 0.02, 0.37] {
                let apart = furthest(&stage, &characters, settings(output, isa, 1), seconds);
                assert!(apart < NEAR, "{isa:?} {output:?} {seconds} s: {apart} m");
            }
        }
    }
}

#[test]
fn sixteen_are_as_far_apart_as_windows_reach_and_further() {
    let stage = stage();
    // Sixteen of them span up to 12, 20, 42 and 60 frames of 119: they play the whole clip in turn.
    for step in [0.025, 0.042, 0.087, 0.125] {
        let mut characters = stage.characters(320, 5);
        for (index, character) in characters.iter_mut().enumerate() {
            (character.clip, character.level) = (ClipId(0), LevelId(0));
            (character.time, character.speed) = (step * index as f32, 1.0);
            character.fade = None;
        }
        for isa in Isa::available() {
            let settings = settings(Output::default(), isa, 1);
            let apart = furthest(&stage, &characters[..48], settings, 0.37);
            assert!(apart < NEAR, "{isa:?}, every {step} s: {apart} m");
            let apart = furthest(&stage, &characters, settings, 0.37);
            assert!(apart < NEAR, "{isa:?}, every {step} s, all: {apart} m");
        }
    }
}

#[test]
fn cross_fades_in_step_share_the_loads_of_both_clips() {
    let stage = stage();
    let at = |index: usize, clip: u32, step: f32| {
        let time = 0.4 + step * index as f32;
        let fade = ClipMix {
            clip: ClipId(clip),
            time,
            speed: 1.0,
            weight: index as f32 / 160.0,
        };
        Character {
            clip: ClipId(1),
            time: 0.002 * index as f32,
            fade: Some(fade),
            ..Character::default()
        }
    };
    for step in [0.0, 0.003, 0.1] {
        let mut characters: Vec<Character> = (0..160).map(|index| at(index, 0, step)).collect();
        for isa in Isa::available() {
            for output in outputs() {
                let apart = furthest(&stage, &characters, settings(output, isa, 1), 0.37);
                assert!(apart < NEAR, "{isa:?} {output:?}, {step}: {apart} m");
            }
        }
        // One of a group fades to another clip.
        for index in (5..160).step_by(16) {
            characters[index] = at(index, 2, step);
        }
        for isa in Isa::available() {
            let settings = settings(Output::default(), isa, 1);
            let apart = furthest(&stage, &characters, settings, 0.37);
            assert!(apart < NEAR, "{isa:?}, {step}, two clips: {apart} m");
        }
    }
}
