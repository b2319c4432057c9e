//! Promise: joints as rotations and positions are where their matrices have them, whatever way a character faces.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_fixtures as common;

use common::clips::small_skeleton;
use common::crowd::{Stage, crowd_of, forms, joint_of, posed, settings};
use glam::{DVec3, Quat, Vec3};
use sabaki_motion::anim::{Clip, ClipDesc};
use sabaki_motion::crowd::{Character, Form, Placement};
use sabaki_motion::math::{Isa, Rigid2};
use std::f32::consts::{FRAC_PI_2, PI};

/// Metres.
const NEAR: f64 = 1e-4;

/// Stands 5 m from the origin of its clip.
fn far_clip() -> Clip {
    let skeleton = small_skeleton();
    let frames = 3;
    let desc = ClipDesc {
        name: "far".into(),
        frame_rate: 30.0,
        roots: vec![Vec3::new(3.0, 0.95, 4.0); frames],
        rotations: vec![Quat::IDENTITY; frames * skeleton.len()],
        translations: Vec::new(),
    };
    Clip::new(&skeleton, desc).unwrap()
}

/// Small ones, and small ones off the other quarters.
fn headings() -> Vec<f32> {
    let mut all = vec![0.0, -0.0, PI, -PI, FRAC_PI_2, -FRAC_PI_2];
    for step in 1..=40 {
        let small = 2.5e-5 * step as f32;
        for quarter in [0.0, PI, FRAC_PI_2] {
            for sign in [1.0, -1.0] {
                all.extend([quarter - small, quarter + small].map(|heading| sign * heading));
            }
        }
    }
    all
}

#[test]
fn small_headings_are_exact() {
    let stage = Stage::new(small_skeleton(), vec![far_clip()], &[]);
    let facing = |heading| Character {
        placement: Placement {
            ground: Rigid2::new(heading, 0.0, 0.0),
            height: 0.0,
        },
        ..Character::default()
    };
    let characters: Vec<Character> = headings().into_iter().map(facing).collect();
    for isa in Isa::available() {
        for output in forms() {
            let form = output.form;
            let other = sabaki_motion::crowd::Output {
                form: Form::Matrices,
                ..output
            };
            let [(mut crowd, ids), (mut exact, _)] = [output, other]
                .map(|output| crowd_of(&stage, &characters, settings(output, isa, 1)));
            let (out, exact_out) = (posed(&mut crowd), posed(&mut exact));
            for (&id, heading) in ids.iter().zip(headings()) {
                let slice = crowd.pose_slice(id).unwrap();
                let exact = exact.pose_slice(id).unwrap();
                for joint in 0..slice.joints {
                    let found = joint_of(&out, &slice, form, joint);
                    let exact = joint_of(&exact_out, &exact, Form::Matrices, joint);
                    for point in [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z] {
                        let apart = found.transform_point3(point);
                        let apart = apart.distance(exact.transform_point3(point));
                        assert!(apart < NEAR, "{isa:?} {form:?}, {heading} rad: {apart} m");
                    }
                }
            }
        }
    }
}
