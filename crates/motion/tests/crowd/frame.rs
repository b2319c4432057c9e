//! Promise: one call a frame gives every character the level, the blend and the pose that the single calls give it, on every
//! instruction set, whatever the camera does, with and without hysteresis.

use super::pose::default;
use glam::Vec3;
use sabaki_fixtures::clips::{small_skeleton, swinging_clip};
use sabaki_fixtures::crowd::{Stage, apart, crowd_of, settings};
use sabaki_fixtures::with;
use sabaki_motion::crowd::{Character, Crowd, Frame, Layout, MemberId, Output};
use sabaki_motion::lod::{LevelId, Levels, Rule, SwitchSettings, Switching};
use sabaki_motion::math::{F32x16, Isa};
use std::sync::Arc;

pub(super) const SECONDS: f64 = 1.0 / 60.0;

pub(super) fn stage() -> (Stage, Levels) {
    let skeleton = small_skeleton();
    let clips = [
        swinging_clip(&skeleton, 120, 0.3),
        swinging_clip(&skeleton, 47, 1.1),
    ];
    let order = [1, 3, 5].map(|id| (sabaki_motion::anim::JointId(id), f32::from(id)));
    let levels = Levels::in_order(&skeleton, &order).unwrap();
    (Stage::on_levels(&skeleton, &clips, &levels), levels)
}

pub(super) fn switchings(levels: &Levels) -> Vec<Switching> {
    let rules = [None, Some(0.5)];
    let new = |blend_step| {
        let settings = SwitchSettings {
            rule: Rule::Energy { furthest: 6.0 },
            hysteresis: 0.1,
            blend_step,
            ..SwitchSettings::default()
        };
        Switching::new(levels, &settings).unwrap()
    };
    let mut all: Vec<Switching> = rules.map(new).into();
    // Bands with room to blend in, whatever the levels' errors are.
    let mut wide = levels.clone();
    for level in &mut wide.levels {
        level.error.step = 0.05;
    }
    let settings = with(|s: &mut SwitchSettings| s.rule = Rule::Energy { furthest: 6.0 });
    all.push(Switching::new(&wide, &settings).unwrap());
    all
}

/// Walks past, comes back, and jumps.
fn eye(frame: usize) -> Vec3 {
    match frame {
        60..80 => Vec3::new(-3.0, 1.0, 4.0),
        _ => Vec3::new(
            0.02 * frame as f32 - 2.0,
            1.5,
            (0.05 * frame as f32).sin() * 3.0,
        ),
    }
}

/// The crowd of the single calls: levels chosen one by one.
struct Reference {
    characters: Vec<Character>,
    levels: Vec<LevelId>,
}

impl Reference {
    fn choose(&mut self, switching: &Switching, eye: Vec3) {
        for (character, level) in self.characters.iter_mut().zip(&mut self.levels) {
            let distance = character.placement.position().distance(eye);
            let choice = switching.choose(distance, Some(*level));
            *level = choice.level;
            (character.level, character.blend) = (choice.level, choice.blend);
        }
    }
}

#[test]
fn a_frame_is_what_the_single_calls_give() {
    let (stage, levels) = stage();
    for isa in Isa::available() {
        for (index, switching) in switchings(&levels).iter().enumerate() {
            compare(&stage, switching, isa, index);
        }
    }
}

/// Compares frames with the single calls. `index` is that of the switching.
fn compare(stage: &Stage, switching: &Switching, isa: Isa, index: usize) {
    let mut characters = stage.characters(400, 9);
    // A character that starts between two levels may be on either.
    characters
        .iter_mut()
        .for_each(|character| character.blend = 0.0);
    let (mut crowd, ids) = crowd_of(stage, &characters, settings(Output::default(), isa, 1));
    let mut reference = Reference {
        levels: characters.iter().map(|character| character.level).collect(),
        characters,
    };
    let mut out = vec![F32x16::ZERO; crowd.max_output_len(ids.len())];
    let (mut blended, mut moved) = (0, 0);
    // Without blending hysteresis can be seen.
    let blends = index > 0;
    for step in 0..120 {
        let frame = Frame {
            seconds: SECONDS,
            switching: Some(switching),
            eye: eye(step),
        };
        moved += crowd.frame(&frame, &mut out).unwrap().moved;
        reference.choose(switching, eye(step));
        for (&id, character) in ids.iter().zip(&reference.characters) {
            let found = crowd.character(id).unwrap();
            let expected = f32::from(character.level.0) + character.blend;
            let detail = f32::from(found.level.0) + found.blend;
            if blends {
                assert_eq!(detail, expected.min(3.0), "frame {step}");
            } else {
                assert_eq!(detail, f32::from(character.level.0), "frame {step}");
            }
            blended += usize::from(character.blend > 0.0);
            if step % 13 == 0 {
                let slice = crowd.pose_slice(id).unwrap();
                let apart = apart(stage, &found, 0.0, &slice, &out);
                assert!(apart < 4e-4, "frame {step}, {apart} m");
            }
        }
    }
    assert!(moved > 400, "{moved}");
    assert!(index < 2 || blended > 100, "{blended}");
}

#[test]
fn time_is_exact_after_a_day() {
    let (stage, _) = stage();
    let characters = stage.characters(60, 5);
    let (mut crowd, ids) = crowd_of(&stage, &characters, default());
    let mut out = vec![F32x16::ZERO; crowd.max_output_len(ids.len())];
    crowd.pose(&mut out).unwrap();
    let (step, frames) = (0.5, 2 * 3600 * 24);
    for _ in 0..frames {
        crowd.advance(step);
    }
    let seconds = step * f64::from(frames);
    assert_eq!(crowd.time(), seconds);
    let by_steps = ids.iter().map(|&id| crowd.character(id).unwrap());
    let by_steps: Vec<Character> = by_steps.collect();
    let (mut at_once, _) = crowd_of(&stage, &characters, default());
    at_once.set_time(seconds);
    for ((&id, character), start) in ids.iter().zip(&by_steps).zip(&characters) {
        // Exactly: the clips have 119 and 46 intervals, 30 a second.
        let duration = [119.0, 46.0][start.clip.index()] / 30.0;
        let exact = f64::from(start.time) + f64::from(start.speed) * seconds;
        let exact = exact.rem_euclid(duration);
        for found in [*character, at_once.character(id).unwrap()] {
            let apart = (f64::from(found.time) - exact).abs();
            let apart = apart.min((duration - apart).abs());
            assert!(apart < 1e-4, "{apart} s, {start:?}");
        }
        assert_eq!(character.time, at_once.character(id).unwrap().time);
    }
}

#[test]
fn instances_stay_in_their_places() {
    let (stage, levels) = stage();
    let switching = switchings(&levels).remove(2);
    let characters = stage.characters(300, 9);
    for layout in [Layout::Instances, Layout::Blocks] {
        let output = with(|s: &mut Output| s.layout = layout);
        let settings = settings(output, Isa::best(), 2);
        let mut crowd = Crowd::with_capacity(Arc::clone(&stage.animations), settings, 400);
        let ids: Vec<MemberId> = characters.iter().map(|c| crowd.add(c).unwrap()).collect();
        assert_eq!(crowd.capacity(), 400);
        let most = crowd.max_output_len(crowd.capacity());
        let mut out = vec![F32x16::ZERO; most];
        for frame in 0..60 {
            let input = Frame {
                seconds: SECONDS,
                switching: Some(&switching),
                eye: eye(frame),
            };
            assert!(crowd.output_len() <= most);
            crowd.frame(&input, &mut out).unwrap();
            for (index, &id) in ids.iter().enumerate() {
                let slice = crowd.pose_slice(id).unwrap();
                if layout == Layout::Instances {
                    let row = output.row_len(crowd.animations().joints(LevelId(0)));
                    assert_eq!(slice.start, 16 * row * index);
                }
            }
        }
    }
}
