//! Promise: a mirrored clip is the reflection of the clip, with left and right exchanged; both halves lie in one graph; joints whose
//! sides do not pair are named.

use glam::{Quat, Vec3};
use sabaki::anim::{Clip, JointId, Pose};
use sabaki::graph::{self, EdgeMotion, GraphSettings};
use sabaki_fixtures::captures::{captures, source_of};
use sabaki_fixtures::clips::{clip, joints_at};
use sabaki_import::{ClipSet, MirrorError};

fn set(joints: &[(&str, Option<u16>, [f32; 3])]) -> ClipSet {
    let joints = joints.iter();
    let joints = joints.map(|&(name, parent, offset)| (name, parent, offset.into()));
    let skeleton = sabaki_fixtures::clips::skeleton(&joints.collect::<Vec<_>>());
    let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.1, 0.5, 0.2);
    let (root, turns) = (Vec3::new(0.3, 0.9, 0.2), vec![turn; skeleton.len()]);
    ClipSet {
        clips: vec![clip(&skeleton, "still.bvh", 30.0, vec![root], turns)],
        skeleton,
        events: Vec::new(),
        scales: vec![sabaki_import::Scale {
            metres_per_unit: 1.0,
            found: sabaki_import::ScaleSource::Given,
        }],
        repeated_names: Vec::new(),
        figure: String::new(),
        warnings: Vec::new(),
        left_out: Vec::new(),
    }
}

/// Largest distance of a mirrored clip's joints from the reflection of the other side's.
fn difference(set: &ClipSet, clip: usize) -> f32 {
    let count = set.clips.len() / 2;
    let mut most = 0.0f32;
    let clips = [&set.clips[clip], &set.clips[clip + count]];
    for frame in (0..clips[0].frames()).step_by(7) {
        let [joints, twins] = clips.map(|clip| joints_at(&set.skeleton, clip, frame));
        for id in set.skeleton.ids() {
            let twin = set.skeleton.mirror(id).unwrap_or(id);
            let reflected = joints[id.index()].translation * Vec3::new(-1.0, 1.0, 1.0);
            most = most.max(reflected.distance(twins[twin.index()].translation));
        }
    }
    most
}

#[test]
fn a_mirrored_clip_is_the_reflection() {
    let mut set = set(&[
        ("Hips", None, [0.0; 3]),
        ("LeftLeg", Some(0), [0.1, -0.4, 0.0]),
        ("LeftFoot", Some(1), [0.02, -0.4, 0.1]),
        ("Spine", Some(0), [0.0, 0.3, 0.0]),
        ("RightLeg", Some(0), [-0.1, -0.4, 0.0]),
        ("RightFoot", Some(4), [-0.02, -0.4, 0.1]),
    ]);
    set.add_mirrored().unwrap();
    assert_eq!(set.clips[1].name(), "still.bvh:mirrored");
    assert_eq!(Clip::title(set.clips[1].name()), "still mirrored");
    assert!(difference(&set, 0) < 1e-5);
}

#[test]
fn joints_whose_sides_do_not_pair_are_named() {
    let hips = ("Hips", None, [0.0; 3]);
    let left = ("LeftLeg", Some(0), [0.1, -0.4, 0.0]);
    let error = |joints: &[_]| set(joints).add_mirrored().unwrap_err();
    assert_eq!(error(&[hips]), MirrorError::NoSides);
    assert_eq!(error(&[hips, left]), MirrorError::NoTwin("LeftLeg".into()));
    let longer = error(&[hips, left, ("RightLeg", Some(0), [-0.2, -0.9, 0.0])]);
    assert!(longer.to_string().contains("LeftLeg"), "{longer}");
    assert!(matches!(longer, MirrorError::Bones { .. }), "{longer}");
    let hung = error(&[
        hips,
        left,
        ("RightLeg", Some(0), [-0.1, -0.4, 0.0]),
        ("LeftFoot", Some(2), [0.0, -0.4, 0.0]),
        ("RightFoot", Some(2), [0.0, -0.4, 0.0]),
    ]);
    assert!(matches!(hung, MirrorError::Parents { .. }), "{hung}");
}

fn mean_rotation(clips: &[Clip], id: JointId) -> Quat {
    let (mut sum, mut pose) = (glam::Vec4::ZERO, Pose::default());
    for clip in clips {
        for frame in 0..clip.frames() {
            clip.pose(frame, &mut pose);
            let rotation = glam::Vec4::from(pose.rotations[id.index()]);
            sum += rotation * sum.dot(rotation).signum();
        }
    }
    Quat::from_vec4(sum.normalize())
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn both_halves_of_real_capture_lie_in_one_graph() {
    let mut set = captures("fight");
    let (count, events) = (set.clips.len(), set.events.len());
    let seconds = |set: &ClipSet| {
        let (graph, _) = graph::build(source_of(set), &GraphSettings::default()).unwrap();
        let mut seconds = [0.0; 2];
        let mut kept = 0;
        for edge in graph.edges() {
            let clip = graph.node(edge.from).clip.index();
            if edge.motion == EdgeMotion::Clip {
                seconds[usize::from(clip >= count)] += f64::from(edge.frames) / graph.frame_rate();
            }
            kept += usize::from(edge.event.is_some());
        }
        (seconds, kept)
    };
    let (alone, labelled) = seconds(&set);
    set.add_mirrored().unwrap();
    assert_eq!([set.clips.len(), set.events.len()], [2 * count, 2 * events]);
    for clip in 0..count {
        let most = difference(&set, clip);
        assert!(most < 0.12, "clip {clip}: {most} m");
    }
    // Joints are turned alike in the mean: a blend of the two halves does not spin them.
    let (own, mirrored) = set.clips.split_at(count);
    for id in set.skeleton.ids().skip(1) {
        let apart = mean_rotation(own, id).angle_between(mean_rotation(mirrored, id));
        let name = &set.skeleton.joint(id).name;
        assert!(apart < 0.8, "{name}: {apart} radians");
    }
    let (both, doubled) = seconds(&set);
    assert!(both[0] >= 0.95 * alone[0] && both[1] > 0.9 * alone[0]);
    assert!(doubled >= 2 * labelled - 2, "{labelled} {doubled}");
}

/// Each half of the clips is mirrored alone and with the other half.
#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn later_clips_change_no_mirrored_clip() {
    let all = captures("fight");
    let mirrored = |clips: usize| {
        let mut set = all.clone();
        set.clips.truncate(clips);
        set.scales.truncate(clips);
        set.events.retain(|event| event.clip < clips);
        set.add_mirrored().unwrap();
        set.clips.split_off(clips)
    };
    let whole = mirrored(all.clips.len());
    let (mut alone, mut beside) = (Pose::default(), Pose::default());
    for count in [1, all.clips.len() / 2] {
        for (fewer, more) in mirrored(count).iter().zip(&whole) {
            assert_eq!(fewer.name(), more.name());
            for frame in (0..fewer.frames()).step_by(11) {
                fewer.pose(frame, &mut alone);
                more.pose(frame, &mut beside);
                assert_eq!(alone, beside, "{}", fewer.name());
            }
        }
    }
}
