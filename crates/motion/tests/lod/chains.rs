//! Promise: skeletons and distances at the ends of the range give finite bands in bounded time, or an error.

use glam::{Quat, Vec3};
use sabaki_fixtures::lod::{build, rules};
use sabaki_motion::anim::{Clip, ClipDesc, Joint, JointId, JointKind, Skeleton};
use sabaki_motion::lod::{LevelSettings, Levels, LodError, Order, Switching};

/// A chain of short bones that ends in a long one.
fn chain(joints: usize) -> Skeleton {
    let joint = |index: usize| Joint {
        name: format!("j{index}"),
        parent: index.checked_sub(1).map(|parent| JointId(parent as u16)),
        offset: Vec3::Y * if index == joints { 1.0 } else { 0.03 },
        kind: if index == joints {
            JointKind::EndSite
        } else {
            JointKind::Moving
        },
    };
    Skeleton::new((0..=joints).map(joint).collect()).unwrap()
}

/// A clip of a chain in which all joints swing by `angle` radians.
fn swinging(skeleton: &Skeleton, frames: usize, angle: f32) -> Clip {
    let turn = |at: usize| {
        let (frame, joint) = (at / skeleton.len(), at % skeleton.len());
        let is_end = joint + 1 == skeleton.len();
        let phase = 0.3 * frame as f32 + 0.1 * joint as f32;
        Quat::from_rotation_x(if is_end { 0.0 } else { angle * phase.sin() })
    };
    let desc = ClipDesc {
        name: "chain".into(),
        frame_rate: 30.0,
        roots: vec![Vec3::ZERO; frames],
        rotations: (0..frames * skeleton.len()).map(turn).collect(),
        translations: Vec::new(),
    };
    Clip::new(skeleton, desc).unwrap()
}

/// Without motion the errors are rounding, and the room that blending needs is less than the distance can show.
#[test]
fn a_chain_without_motion_has_finite_bands() {
    for (joints, angle) in [(12, 0.0), (12, 1e-6), (12, 0.05), (100, 0.0), (300, 0.0)] {
        let skeleton = chain(joints);
        let clip = swinging(&skeleton, 20, angle);
        let levels = build(&skeleton, std::slice::from_ref(&clip), Order::Energy);
        for settings in rules() {
            let switching = Switching::new(&levels, &settings).unwrap();
            let mut before = 0.0;
            for band in switching.bands() {
                let [start, full, end] = [band.start, band.full, band.end];
                assert!(end.is_finite(), "{joints} joints: {band:?}");
                assert!(before <= start && start <= full && full <= end, "{band:?}");
                before = end;
            }
        }
    }
}

#[test]
fn skeletons_and_clips_that_would_take_hours_are_refused() {
    for (joints, frames) in [(1024, 2), (400, 30_000)] {
        let skeleton = chain(joints);
        let clip = swinging(&skeleton, frames, 0.0);
        let error = Levels::build(&skeleton, &[clip], &LevelSettings::default()).unwrap_err();
        let LodError::TooMuch {
            joints: of,
            frames: over,
            ..
        } = error
        else {
            panic!("{error}")
        };
        assert_eq!((of, over), (joints + 1, frames));
        let words = format!("{} joints in {frames} frames: 1024 joints", joints + 1);
        assert!(error.to_string().contains(&words), "{error}");
    }
}
