//! Promise: posing a crowd allocates nothing, from the second time on, on no thread; nor does sorting it.

use super::frame::stage;
use glam::Vec3;
use sabaki_fixtures::crowd::{crowd_of, outputs, posed, settings};
use sabaki_fixtures::memory::{all_allocations, alone};
use sabaki_fixtures::with;
use sabaki_motion::crowd::{Crowd, Frame, LevelId};
use sabaki_motion::lod::{Rule, SwitchSettings, Switching};
use sabaki_motion::math::{F32x16, Isa};
use std::sync::Arc;

#[test]
fn frames_allocate_nothing() {
    alone(poses_of_all_outputs);
}

#[test]
fn frames_in_which_levels_change_allocate_nothing() {
    alone(whole_frames_while_levels_change);
}

fn poses_of_all_outputs() {
    let (stage, _) = stage();
    let characters = stage.characters(1000, 7);
    for output in outputs() {
        for threads in [1, 3] {
            let settings = settings(output, Isa::best(), threads);
            let (mut crowd, ids) = crowd_of(&stage, &characters, settings);
            // All are put on level 0 and back: the most memory that any order takes.
            let mut out = posed(&mut crowd);
            for &id in &ids {
                crowd.set_level(id, LevelId(0)).unwrap();
            }
            out.resize(out.len().max(crowd.output_len()) * 2, out[0]);
            for (&id, character) in ids.iter().zip(&characters) {
                crowd.set_level(id, character.level).unwrap();
            }
            crowd.pose(&mut out).unwrap();
            let before = all_allocations();
            for frame in 0..300 {
                crowd.advance(1.0 / 30.0);
                if frame % 50 == 0 {
                    let level = LevelId(frame % 4);
                    crowd.set_level(ids[usize::from(frame)], level).unwrap();
                    let blend = f32::from(frame % 7) / 6.0;
                    crowd.set_detail(ids[1], level, blend).unwrap();
                }
                crowd.pose(&mut out).unwrap();
            }
            assert_eq!(all_allocations(), before, "{output:?}, {threads} threads");
        }
    }
}

/// Positions in front of a camera that walks past: levels change, and the crowd is sorted again and again.
fn whole_frames_while_levels_change() {
    let (stage, levels) = stage();
    let settings_of_levels = with(|s: &mut SwitchSettings| s.rule = Rule::Energy { furthest: 6.0 });
    let switching = Switching::new(&levels, &settings_of_levels).unwrap();
    let characters = stage.characters(1000, 7);
    for threads in [1, 3] {
        let settings = settings(outputs()[0], Isa::best(), threads);
        let capacity = characters.len();
        let mut crowd = Crowd::with_capacity(Arc::clone(&stage.animations), settings, capacity);
        for character in &characters {
            crowd.add(character).unwrap();
        }
        let mut out = vec![F32x16::ZERO; crowd.max_output_len(capacity)];
        let mut moved = 0;
        let mut run = |frames: std::ops::Range<u16>| {
            for frame in frames {
                let walked = 0.02 * f32::from(frame);
                let frame = Frame {
                    seconds: 1.0 / 60.0,
                    switching: Some(&switching),
                    eye: Vec3::new(4.0 * walked.sin(), 1.5, 4.0 * (0.7 * walked).cos()),
                };
                let report = crowd.frame(&frame, &mut out).unwrap();
                moved += report.moved + usize::from(report.sorted);
            }
        };
        run(0..60);
        let before = all_allocations();
        run(60..600);
        assert_eq!(all_allocations() - before, 0, "{threads} threads");
        assert!(moved > 1000, "{moved}");
    }
}
