//! Promise: a crowd's poses are those of its clips for the smallest and the largest skeletons and clips, the fastest turns, and
//! times, speeds and levels that make no sense.

use super::pose::{NEAR, default, stage};
use glam::Vec3;
use sabaki_fixtures::clips::{joint, small_skeleton, swinging_clip};
use sabaki_fixtures::crowd::{Stage, crowd_of, furthest, outputs, posed, settings};
use sabaki_motion::anim::Skeleton;
use sabaki_motion::crowd::{Character, LevelId, Output};
use sabaki_motion::math::Isa;

/// A chain or a comb of so many joints that all turn.
fn long_skeleton(joints: u16) -> Skeleton {
    let of = |index: u16| {
        let parent = (index > 0).then(|| index - 1 - (index % 5).min(index - 1));
        let offset = Vec3::new(0.01, 0.02, 0.005);
        joint(&format!("joint {index}"), parent, offset)
    };
    Skeleton::new((0..joints).map(of).collect()).unwrap()
}

#[test]
fn one_joint_and_255() {
    for joints in [1, 2, 255] {
        let skeleton = long_skeleton(joints);
        let clips = vec![swinging_clip(&skeleton, 40, 0.4)];
        let stage = Stage::new(skeleton, clips, &[]);
        let characters = stage.characters(40, 3);
        for output in outputs() {
            let apart = furthest(&stage, &characters, settings(output, Isa::best(), 2), 0.2);
            assert!(apart < NEAR, "{joints} joints, {output:?}: {apart} m");
        }
    }
}

#[test]
fn a_clip_of_one_frame_and_of_two() {
    for frames in [1, 2] {
        let skeleton = small_skeleton();
        let clips = vec![swinging_clip(&skeleton, frames, 0.4)];
        let stage = Stage::new(skeleton, clips, &[2]);
        let apart = furthest(&stage, &stage.characters(40, 3), default(), 0.2);
        assert!(apart < NEAR, "{frames} frames: {apart} m");
    }
}

#[test]
fn what_is_no_number_is_the_start() {
    let stage = stage();
    let strange = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    let mut characters = stage.characters(9, 4);
    for (index, character) in characters.iter_mut().enumerate() {
        character.fade = None;
        character.time = strange[index % 3];
        character.speed = [1.0, f32::NAN, f32::INFINITY][index / 3];
    }
    let plain = characters.iter().map(|character| Character {
        time: 0.0,
        speed: if character.speed.is_finite() {
            character.speed
        } else {
            0.0
        },
        ..*character
    });
    let plain: Vec<Character> = plain.collect();
    for isa in Isa::available() {
        let settings = settings(Output::default(), isa, 1);
        let (mut crowd, ids) = crowd_of(&stage, &characters, settings);
        let (mut same, plain_ids) = crowd_of(&stage, &plain, settings);
        // Over the moment at which the clocks are set back, too.
        for _ in 0..3 {
            crowd.advance(5.0);
            same.advance(5.0);
            let (out, plain_out) = (posed(&mut crowd), posed(&mut same));
            for (&id, &plain_id) in ids.iter().zip(&plain_ids) {
                let slice = crowd.pose_slice(id).unwrap();
                let expected = same.pose_slice(plain_id).unwrap();
                for joint in 0..slice.joints {
                    let found = slice.number(&out, joint, 3);
                    assert_eq!(found, expected.number(&plain_out, joint, 3), "{isa:?}");
                }
            }
        }
    }
}

#[test]
fn a_level_beyond_the_last_is_the_last() {
    let stage = stage();
    let mut characters = stage.characters(20, 4);
    for character in &mut characters {
        character.level = LevelId(u16::MAX);
    }
    let (mut crowd, ids) = crowd_of(&stage, &characters, default());
    posed(&mut crowd);
    assert_eq!(crowd.pose_slice(ids[0]).unwrap().joints, 6);
    assert!(furthest(&stage, &characters, default(), 0.1) < NEAR);
}
