//! The embedded motions keep their promises: enough of them, feet that stand, bodies that move as
//! bodies can, evasions that leave in time, and one guard that joins them all.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;

use glam::Vec3;
use sabaki::anim::{
    Clip, EventKind, Facing, JointId, JointKind, JointTransform, Pose, forward_kinematics,
};
use sabaki_app::demo::{Motions, motions};

/// Places of all joints, frame by frame, metres.
fn places(motions: &Motions, clip: &Clip) -> Vec<Vec<JointTransform>> {
    let mut pose = Pose::default();
    let frames = 0..clip.frames();
    frames
        .map(|frame| {
            let mut joints = Vec::new();
            clip.pose(frame, &mut pose);
            forward_kinematics(&motions.skeleton, &pose, &mut joints);
            joints
        })
        .collect()
}

fn joint(motions: &Motions, name: &str) -> usize {
    motions.skeleton.find(name).unwrap().index()
}

/// The root on the ground, the pelvis facing +Z.
fn in_character_frame(motions: &Motions, joints: &[JointTransform]) -> Vec<Vec3> {
    let placement = Facing::of(&motions.skeleton).placement(joints).inverse();
    let points = joints.iter();
    points.map(|j| placement.point(j.translation)).collect()
}

fn rms(a: &[Vec3], b: &[Vec3]) -> f32 {
    let squares = a.iter().zip(b).map(|(a, b)| a.distance_squared(*b));
    (squares.sum::<f32>() / a.len() as f32).sqrt()
}

#[test]
fn there_is_enough_of_them() {
    let motions = motions().unwrap();
    let seconds: f64 = motions.clips.iter().map(Clip::duration).sum();
    let with = |kind: EventKind| -> BTreeSet<&str> {
        let events = motions.events.iter().filter(|event| event.kind == kind);
        events.map(|e| motions.clips[e.clip].name()).collect()
    };
    let names: BTreeSet<&str> = motions.clips.iter().map(Clip::name).collect();
    assert!(seconds >= 160.0, "{seconds} s");
    assert_eq!(names.len(), motions.clips.len(), "two clips share a name");
    assert!(with(EventKind::Evasion).len() >= 20);
    assert!(with(EventKind::Attack).len() >= 9);
}

#[test]
fn the_skeleton_has_24_nodes_and_five_ends() {
    let skeleton = motions().unwrap().skeleton;
    let ends = skeleton
        .joints()
        .iter()
        .filter(|j| j.kind == JointKind::EndSite);
    assert_eq!((skeleton.len(), ends.count()), (24, 5));
    let pose = Pose {
        root: Vec3::Y * 0.97,
        rotations: vec![glam::Quat::IDENTITY; 24],
        translations: Vec::new(),
    };
    let mut joints = Vec::new();
    forward_kinematics(&skeleton, &pose, &mut joints);
    let top = joints.iter().map(|j| j.translation.y).fold(0.0, f32::max);
    assert!((top - 1.75).abs() < 0.01, "{top} m tall");
    let facing = Facing::of(&skeleton).placement(&joints);
    assert!(facing.heading().abs() < 1e-6);
}

#[test]
fn the_same_bits_each_time() {
    let (a, b) = (motions().unwrap(), motions().unwrap());
    assert_eq!(a.clips, b.clips);
    assert_eq!(a.events, b.events);
}

#[test]
fn events_lie_inside_their_clips_and_apart() {
    let motions = motions().unwrap();
    for (clip, c) in motions.clips.iter().enumerate() {
        let mut last = 0.0;
        for event in motions.events.iter().filter(|event| event.clip == clip) {
            let name = c.name();
            assert!(
                last <= event.start && event.start + 0.2 < event.end,
                "{name}: {event:?}"
            );
            // Room for a blend on both sides.
            assert!(
                event.start >= 0.4 && event.end <= c.duration() - 0.4,
                "{name}: {event:?}"
            );
            assert_eq!(
                event.joints.is_empty(),
                event.kind == EventKind::Evasion,
                "{name}"
            );
            last = event.end;
        }
    }
    let order = |event: &sabaki::anim::Event| (event.clip, event.start);
    assert!(motions.events.is_sorted_by_key(order));
}

#[test]
fn planted_feet_stand_still_and_no_foot_sinks() {
    let motions = motions().unwrap();
    let toes = ["LeftFoot_End", "RightFoot_End"].map(|name| joint(&motions, name));
    let mut worst = (0.0, "");
    for clip in &motions.clips {
        let frames = places(&motions, clip);
        for pair in frames.windows(2) {
            for toe in toes {
                let (a, b) = (pair[0][toe].translation, pair[1][toe].translation);
                // Flat toes are 15 mm high.
                if a.y.max(b.y) < 0.0165 && a.distance(b) > worst.0 {
                    worst = (a.distance(b), clip.name());
                }
            }
        }
        let lowest = frames
            .iter()
            .flatten()
            .map(|j| j.translation.y)
            .fold(1.0, f32::min);
        assert!(lowest > 0.005, "{}: {lowest} m", clip.name());
    }
    assert!(worst.0 < 0.002, "{worst:?} metres in a frame");
}

#[test]
fn one_foot_bears_the_body_unless_it_leaps() {
    let motions = motions().unwrap();
    let leaps = [
        "leap_back",
        "jump_left",
        "jump_right",
        "hop_over",
        "switch_stance",
    ];
    let toes = ["LeftFoot_End", "RightFoot_End"].map(|name| joint(&motions, name));
    for clip in &motions.clips {
        let flying = places(&motions, clip)
            .iter()
            .filter(|joints| toes.iter().all(|&toe| joints[toe].translation.y > 0.02))
            .count();
        // Quick steps overlap for some frames.
        let most = if leaps.contains(&clip.name()) { 30 } else { 12 };
        assert!(
            flying <= most,
            "{}: {flying} frames in the air",
            clip.name()
        );
    }
}

#[test]
fn nothing_is_faster_than_a_fighter() {
    let motions = motions().unwrap();
    let most = |name: &str| match name {
        "Hips" | "Spine" | "Chest" | "Neck" => 4.0,
        "Head" | "Head_End" => 5.0,
        _ if name.contains("Foot") => 14.0,
        _ if name.contains("Leg") => 11.0,
        _ => 10.0,
    };
    for clip in &motions.clips {
        let rate = clip.frame_rate() as f32;
        for pair in places(&motions, clip).windows(2) {
            for (index, j) in motions.skeleton.joints().iter().enumerate() {
                let moved = pair[0][index]
                    .translation
                    .distance(pair[1][index].translation);
                let speed = moved * rate;
                assert!(
                    speed <= most(&j.name),
                    "{}: {} at {speed} m/s",
                    clip.name(),
                    j.name
                );
            }
        }
    }
}

/// The inner angle at the middle one of three joints, degrees.
fn inner_angle(joints: &[JointTransform], first: usize) -> f32 {
    let [a, b, c] = [0, 1, 2].map(|k| joints[first + k].translation);
    (a - b).angle_between(c - b).to_degrees()
}

#[test]
fn knees_and_elbows_bend_the_right_way() {
    let motions = motions().unwrap();
    for clip in &motions.clips {
        for (frame, joints) in places(&motions, clip).iter().enumerate() {
            for side in ["Left", "Right"] {
                let at = |name: &str| joint(&motions, &format!("{side}{name}"));
                let name = clip.name();
                let knee = inner_angle(joints, at("UpLeg"));
                assert!(
                    (25.0..172.0).contains(&knee),
                    "{name} {frame}: {side} knee {knee}"
                );
                let elbow = inner_angle(joints, at("Arm"));
                assert!(
                    (15.0..172.0).contains(&elbow),
                    "{name} {frame}: {side} elbow {elbow}"
                );
                // The shin turns about the thigh's own X axis, backwards.
                let mut pose = Pose::default();
                clip.pose(frame, &mut pose);
                let shin = pose.rotations[at("Leg")] * Vec3::NEG_Y;
                assert!(
                    shin.z < 0.0 && shin.x.abs() < 1e-3,
                    "{name} {frame}: {side} {shin}"
                );
            }
        }
    }
}

#[test]
fn every_clip_goes_from_guard_to_guard() {
    let motions = motions().unwrap();
    let first = &places(&motions, &motions.clips[0])[0];
    let guard = in_character_frame(&motions, first);
    for clip in &motions.clips {
        let frames = places(&motions, clip);
        for (what, window) in [
            ("first", &frames[..10]),
            ("last", &frames[frames.len() - 10..]),
        ] {
            for joints in window {
                let off = rms(&in_character_frame(&motions, joints), &guard);
                assert!(off < 0.08, "{}: {what} frames {off} m off", clip.name());
            }
        }
    }
}

#[test]
fn every_evasion_leaves_in_time() {
    let motions = motions().unwrap();
    let watched = [joint(&motions, "Head"), JointId::ROOT.index()];
    for event in &motions.events {
        if event.kind != EventKind::Evasion {
            continue;
        }
        let clip = &motions.clips[event.clip];
        let frames = places(&motions, clip);
        let start = (event.start * clip.frame_rate()).round() as usize;
        let soon = &frames[start..=start + (0.4 * clip.frame_rate()) as usize];
        let moved = |joints: &Vec<JointTransform>, &at: &usize| {
            joints[at].translation.distance(soon[0][at].translation)
        };
        let most = soon
            .iter()
            .flat_map(|joints| watched.iter().map(move |at| moved(joints, at)))
            .fold(0.0, f32::max);
        assert!(
            most >= 0.15,
            "{} at {} s: {most} m",
            clip.name(),
            event.start
        );
    }
}

#[test]
fn attacks_reach_out() {
    let motions = motions().unwrap();
    for event in &motions.events {
        if event.kind != EventKind::Attack {
            continue;
        }
        let clip = &motions.clips[event.clip];
        let end = event.joints.last().unwrap().index();
        let range = [event.start, event.end].map(|t| (t * clip.frame_rate()) as usize);
        let reach = places(&motions, clip)[range[0]..=range[1]]
            .iter()
            .map(|joints| {
                let away = joints[end].translation - joints[0].translation;
                away.with_y(0.0).length()
            })
            .fold(0.0, f32::max);
        assert!(
            reach > 0.4,
            "{} at {} s: {reach} m",
            clip.name(),
            event.start
        );
    }
}
