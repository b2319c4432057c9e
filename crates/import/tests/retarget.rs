//! Promise: a motion is put on another skeleton by the joints' names: its bones have the captured directions whatever both rest poses are,
//! what that costs is said, and what has other names is refused by name.

use std::fs::File;
use std::path::{Path, PathBuf};

use glam::{Quat, Vec3};
use sabaki::anim::{Clip, ClipDesc, Joint, JointId, JointKind, Pose, Skeleton};
use sabaki_fixtures::captures::mocap;
use sabaki_fixtures::clips;
use sabaki_import::{ClipSet, FileError, ReadOptions, bvh, read_clip, read_clips};

use super::common::{refusal, refused_file, write_glb, written};

const RETARGET: ReadOptions = ReadOptions {
    scale: None,
    up: Some(sabaki_import::Up::Y),
    amc_rate: None,
    keep_going: false,
    retarget: true,
};
const KEEP_GOING: ReadOptions = ReadOptions {
    keep_going: true,
    ..RETARGET
};
const CENTIMETRES: ReadOptions = ReadOptions {
    scale: Some(0.01),
    ..RETARGET
};

/// Two clips of one body, and the folder of captures by others.
fn captures() -> ([PathBuf; 2], PathBuf) {
    let own = ["Male2_E19_DodgeLeft.bvh", "Male2_B3_Walk.bvh"];
    let own = own.map(|name| mocap("fight").join(name));
    (own, mocap("dialects"))
}

fn positions(skeleton: &Skeleton, clip: &Clip, frame: usize) -> Vec<Vec3> {
    let joints = clips::joints_at(skeleton, clip, frame).into_iter();
    joints.map(|joint| joint.translation).collect()
}

/// The same motion of a body that is larger by `scale`, with the axes of each joint turned and with other names.
fn disguised(skeleton: &Skeleton, clip: &Clip, scale: f32) -> (Skeleton, Clip) {
    let turn = |index: usize| {
        let angle = |factor: f32| 0.8 * (factor * (index + 1) as f32).sin();
        Quat::from_euler(glam::EulerRot::XYZ, angle(1.7), angle(2.9), angle(4.3))
    };
    let turns: Vec<Quat> = (0..skeleton.len()).map(turn).collect();
    let above = |joint: &Joint| joint.parent.map_or(Quat::IDENTITY, |p| turns[p.index()]);
    let other = clips::changed(skeleton, |joint| {
        joint.offset = scale * (above(joint).inverse() * joint.offset);
        joint.name = format!("other:{}", joint.name.to_uppercase());
    });
    let mut desc = clip.desc().clone();
    desc.roots.iter_mut().for_each(|root| *root *= scale);
    for rotations in desc.rotations.chunks_mut(skeleton.len()) {
        for ((rotation, joint), turn) in rotations.iter_mut().zip(skeleton.joints()).zip(&turns) {
            if joint.kind == JointKind::Moving {
                *rotation = (above(joint).inverse() * *rotation * *turn).normalize();
            }
        }
    }
    desc.name = "disguised.bvh".into();
    (other.clone(), Clip::new(&other, desc).unwrap())
}

fn write(path: &Path, skeleton: &Skeleton, clip: &Clip) {
    bvh::write(&mut File::create(path).unwrap(), skeleton, clip, 0.01).unwrap();
}

fn note(set: &ClipSet, name: &str) -> String {
    let mut notes = set.warnings.iter();
    let of_file = |note: &&String| note.starts_with(name) && note.contains("retargeted");
    notes.find(of_file).cloned().unwrap_or_default()
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn a_body_of_other_size_axes_and_names_moves_as_it_did() {
    let (files, _) = captures();
    let plain = read_clips(&files, None, &ReadOptions::default()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("disguised.bvh");
    let (other, clip) = disguised(&plain.skeleton, &plain.clips[0], 1.25);
    write(&file, &other, &clip);
    let paths = [files[0].clone(), files[1].clone(), file];
    let (_, error) = refused_file(read_clips(&paths, None, &ReadOptions::default()));
    let is_named = matches!(error, FileError::SkeletonDiffers { .. });
    assert!(is_named, "{error}");

    let set = read_clips(&paths, None, &RETARGET).unwrap();
    assert_eq!((set.clips.len(), &set.skeleton), (3, &plain.skeleton));
    let (was, is) = (&plain.clips[0], &set.clips[2]);
    assert_eq!(was.frames(), is.frames());
    let mut most = 0f32;
    for frame in 0..was.frames() {
        let pair = [was, is].map(|clip| positions(&set.skeleton, clip, frame));
        let away = pair[0].iter().zip(&pair[1]).map(|(a, b)| a.distance(*b));
        most = away.fold(most, f32::max);
    }
    // The file has two digits of a centimetre and of a degree.
    assert!(most < 4e-3, "{most} m");
    let note = note(&set, "disguised.bvh");
    for said in ["22 of 22 joints", "times 0.800", "0.0 cm from where"] {
        assert!(note.contains(said), "{note}");
    }
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn captures_by_others_walk_on_the_same_skeleton() {
    let (own, others) = captures();
    let names = ["bvh_example.bvh", "dab.bvh", "test_freebvh.bvh"];
    let others = names.map(|name| others.join(name));
    let paths = [&own[..], &others[..]].concat();
    let set = read_clips(&paths, None, &RETARGET).unwrap();
    assert_eq!(set.clips.len(), 5);
    for (clip, path) in set.clips[2..].iter().zip(&others) {
        let note = note(&set, clip.name());
        let number = |before: &str| -> f32 {
            let rest = &note[note.find(before).unwrap() + before.len()..];
            let digits = rest.find(|c: char| c != '.' && !c.is_ascii_digit());
            rest[..digits.unwrap()].parse().unwrap()
        };
        let scale = number("times ");
        let alone = read_clip(path, &RETARGET).unwrap();
        let plain = |name: &str| {
            let own = name.rsplit(':').next().unwrap();
            own.to_lowercase().replace(['_', '-', '.', ' '], "")
        };
        let twin = |joint: &Joint| {
            let mut own = alone.skeleton.joints().iter();
            own.position(|own| plain(&own.name) == plain(&joint.name))
        };
        let joints = set.skeleton.joints().iter().enumerate();
        let pairs = joints.filter_map(|(to, joint)| Some((to, twin(joint)?)));
        let pairs: Vec<(usize, usize)> = pairs.collect();
        assert!(pairs.len() > 16, "{note}");
        // Frames of rest at the start and at the end may be left out.
        let apart = |start: usize| {
            let frames = (0..clip.frames()).map(|frame| {
                let moved = positions(&set.skeleton, clip, frame);
                let own = positions(&alone.skeleton, &alone.clip, start + frame);
                let away = pairs.iter();
                let away = away.map(|&(to, from)| moved[to].distance(scale * own[from]));
                away.fold(0.0, f32::max)
            });
            frames.fold(0.0, f32::max)
        };
        let starts = 0..=alone.clip.frames() - clip.frames();
        let most = starts.map(apart).fold(f32::INFINITY, f32::min);
        // What the note says, and far less than a limb.
        let said = number("on average, ");
        assert!((100.0 * most - said).abs() < 0.5, "{note}: {most} m");
        assert!(number("joints are ") < 15.0 && most < 0.35, "{note}");
    }
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn other_names_are_refused_and_told() {
    let (own, others) = captures();
    let paths = [&own[..], &[others.join("tpose.bvh")]].concat();
    let (path, error) = refused_file(read_clips(&paths, None, &RETARGET));
    let FileError::NotRetargeted { missing, .. } = &error else {
        panic!("{error}");
    };
    assert_eq!(path, paths[2]);
    let is_told = missing.iter().any(|name| name == "LeftUpLeg");
    assert!(is_told, "{missing:?}");
    let set = read_clips(&paths, None, &KEEP_GOING).unwrap();
    assert_eq!((set.clips.len(), set.left_out.len()), (2, 1));
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn a_motion_without_bones_is_no_motion_of_this_skeleton() {
    let (own, _) = captures();
    let plain = read_clips(&own, None, &ReadOptions::default()).unwrap();
    let flat = clips::changed(&plain.skeleton, |joint| {
        joint.name.insert_str(0, "flat:");
        joint.offset = Vec3::ZERO;
    });
    let desc = ClipDesc {
        name: "flat.bvh".into(),
        ..plain.clips[0].desc().clone()
    };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("flat.bvh");
    write(&file, &flat, &Clip::new(&flat, desc).unwrap());
    let paths = [&own[..], &[file]].concat();
    let set = read_clips(&paths, None, &CENTIMETRES).unwrap();
    // Its rotations are all that it has; they are played on the bones of the others.
    let last = set.clips.last().unwrap();
    let places = positions(&set.skeleton, last, 0);
    assert!(places.iter().all(|place| place.is_finite()));
}

/// A person of seven joints who walks a step beside the axis Z.
fn small_person() -> (Skeleton, Clip) {
    let skeleton = clips::skeleton(&[
        ("Hips", None, Vec3::ZERO),
        ("LeftUpLeg", Some(0), Vec3::X * 0.1),
        ("LeftFoot", Some(1), Vec3::Y * -0.8),
        ("RightUpLeg", Some(0), Vec3::X * -0.1),
        ("RightFoot", Some(3), Vec3::Y * -0.8),
        ("Spine", Some(0), Vec3::Y * 0.3),
        ("Head", Some(5), Vec3::Y * 0.4),
    ]);
    let angle = |index: usize| 0.4 * (1.3 * index as f32).sin();
    let roots = (0..6).map(|frame| Vec3::new(0.3, 0.9, 0.1 * frame as f32));
    let turn = |index| Quat::from_euler(glam::EulerRot::YXZ, angle(index), angle(index + 3), 0.1);
    let turns = (0..6 * 7).map(turn).collect();
    let clip = clips::clip(&skeleton, "small.bvh", 30.0, roots.collect(), turns);
    (skeleton, clip)
}

/// The same motion below a joint that stands still, turned, beside the path: the former root has the whole motion.
fn wrapped(skeleton: &Skeleton, clip: &Clip, name: &str) -> (Skeleton, Clip) {
    let (place, turn) = (Vec3::new(0.2, 0.0, -0.4), Quat::from_rotation_y(0.7));
    let inside = |root: Vec3| turn.inverse() * (root - place);
    let below = |id: JointId| JointId(id.0 + 1);
    let mut joints = vec![clips::joint(name, None, Vec3::ZERO)];
    joints.extend(skeleton.joints().iter().map(|joint| Joint {
        parent: Some(joint.parent.map_or(JointId::ROOT, below)),
        ..joint.clone()
    }));
    joints[1].offset = inside(clip.root(0));
    let offsets: Vec<Vec3> = joints.iter().map(|joint| joint.offset).collect();
    let other = Skeleton::new(joints).unwrap();
    let pose = |frame: usize, pose: &mut Pose| {
        clip.pose(frame, pose);
        pose.rotations[0] = (turn.inverse() * pose.rotations[0]).normalize();
        pose.rotations.insert(0, turn);
        pose.translations.clone_from(&offsets);
        pose.translations[1] = inside(pose.root);
        pose.root = place;
    };
    let name = format!("wrapped-{}", clip.name());
    let desc = ClipDesc::of_poses(&name, clip.frame_rate(), clip.frames(), pose);
    (other.clone(), Clip::new(&other, desc).unwrap())
}

/// Reads two copies of the first motion and one of the second, so that the second is put on the skeleton of the first. Returns the note and
/// the largest distance between joints of one name, in metres, without the root `Reference`.
fn put_on(to: &(Skeleton, Clip), from: &(Skeleton, Clip)) -> (String, f32) {
    let folder = tempfile::tempdir().unwrap();
    let paths = ["a.bvh", "b.bvh", "other.bvh"].map(|name| folder.path().join(name));
    for (path, (skeleton, clip)) in paths.iter().zip([to, to, from]) {
        write(path, skeleton, clip);
    }
    let set = read_clips(&paths, None, &CENTIMETRES).unwrap();
    let mut most = 0f32;
    for frame in 0..from.1.frames() {
        let moved = positions(&set.skeleton, &set.clips[2], frame);
        let own = positions(&from.0, &from.1, frame);
        for (joint, place) in set.skeleton.joints().iter().zip(moved) {
            let twin = from.0.find(&joint.name);
            let twin = twin.filter(|_| joint.name != "Reference");
            let away = twin.map(|twin| own[twin.index()].distance(place));
            most = most.max(away.unwrap_or(0.0));
        }
    }
    (note(&set, "other.bvh"), most)
}

/// Two copies of a small person, and a glTF file of it under other names, with an attack by a joint.
fn labelled(folder: &Path, joint: u16) -> [PathBuf; 3] {
    let (skeleton, clip) = small_person();
    let mut joints = skeleton.joints().to_vec();
    for joint in &mut joints {
        joint.name = format!("mixamorig:{}", joint.name);
    }
    joints.push(clips::joint("mixamorig:Tail", Some(0), Vec3::Z * -0.2));
    let other = Skeleton::new(joints).unwrap();
    let mut desc = clip.desc();
    let frames = desc.rotations.chunks(7);
    desc.rotations = frames
        .flat_map(|of_frame| [of_frame, &[Quat::IDENTITY]].concat())
        .collect();
    let event = clips::attack(0, 0.05, 0.125, vec![JointId(joint)]);
    let [a, b] = ["a.bvh", "b.bvh"].map(|name| folder.join(name));
    for path in [&a, &b] {
        write(path, &skeleton, &clip);
    }
    let clips = [Clip::new(&other, desc).unwrap()];
    [
        a,
        b,
        write_glb(folder, "other.glb", &other, &clips, &[event]),
    ]
}

#[test]
fn events_of_a_file_keep_their_joints() {
    let folder = tempfile::tempdir().unwrap();
    let paths = labelled(folder.path(), 4);
    let set = read_clips(&paths, None, &RETARGET).unwrap();
    let event = &set.events[0];
    assert_eq!((set.events.len(), event.clip, event.start), (1, 2, 0.05));
    assert_eq!(set.skeleton.joint(event.joints[0]).name, "RightFoot");
    // The events file has the word here too, and the names of the set's skeleton.
    let text = r#"{"clips":[{"file":"other.glb","events":[{"kind":"attack","start":0.0,"end":0.1,"joints":["Head"]}]},
        {"file":"a.bvh","events":[{"kind":"evasion","start":0.0,"end":0.1}]}]}"#;
    let beside = written(folder.path(), "events.json", text);
    let set = read_clips(&paths, Some(&beside), &RETARGET).unwrap();
    let clips: Vec<usize> = set.events.iter().map(|event| event.clip).collect();
    assert_eq!(clips, [0, 2]);
    assert_eq!(set.skeleton.joint(set.events[1].joints[0]).name, "Head");
}

#[test]
fn a_file_with_an_event_of_a_joint_that_the_others_lack_is_refused_by_its_own_name() {
    let folder = tempfile::tempdir().unwrap();
    let paths = labelled(folder.path(), 7);
    let text =
        r#"{"clips":[{"file":"a.bvh","events":[{"kind":"evasion","start":0.0,"end":0.1}]}]}"#;
    let beside = written(folder.path(), "events.json", text);
    let (path, error) = refused_file(read_clips(&paths, Some(&beside), &RETARGET));
    assert_eq!(path, paths[2]);
    let problem = "the skeleton has no joint \"mixamorig:Tail\"";
    assert!(error.to_string().ends_with(problem), "{error}");
    let set = read_clips(&paths, Some(&beside), &KEEP_GOING).unwrap();
    assert_eq!((set.clips.len(), set.events.len()), (2, 1));
    let [left_out] = &set.left_out[..] else {
        panic!("{:?}", set.left_out);
    };
    let is_named = left_out.contains("other.glb: ") && left_out.ends_with(problem);
    assert!(is_named, "{left_out}");
    // Alone, there is nothing to go on with.
    let bytes = std::fs::read(&paths[2]).unwrap();
    let at = bytes.windows(5).position(|word| word == b"0.125").unwrap();
    let wrong = [&bytes[..at], b"9.125", &bytes[at + 5..]].concat();
    let wrong = written(folder.path(), "wrong.glb", wrong);
    let refused = refusal(read_clips(&[wrong], None, &KEEP_GOING));
    assert!(refused.contains("ends at 9.125 s"), "{refused}");
}

#[test]
fn a_joint_above_the_hips_changes_nothing() {
    wraps_without_change(small_person(), 7);
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn a_joint_above_the_hips_of_a_capture_changes_nothing() {
    let (files, _) = captures();
    let plain = read_clips(&files[..1], None, &ReadOptions::default()).unwrap();
    wraps_without_change((plain.skeleton, plain.clips[0].clone()), 22);
}

/// The joint above the hips is part of their motion, so that nothing is left to retarget.
fn wraps_without_change(person: (Skeleton, Clip), joints: usize) {
    let above = wrapped(&person.0, &person.1, "Reference");
    for (to, from) in [(&person, &above), (&above, &person)] {
        let (note, most) = put_on(to, from);
        assert!(note.is_empty() && most < 1e-3, "{most} m: {note}");
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("above.bvh");
    write(&path, &above.0, &above.1);
    let read = read_clips(&[path], None, &CENTIMETRES).unwrap();
    assert_eq!(read.skeleton.joint(JointId::ROOT).name, "Hips");
    let all = read.skeleton.joints().iter();
    let moving = all.filter(|joint| joint.kind == JointKind::Moving);
    assert_eq!(moving.count(), joints);
    assert!(!read.clips[0].moves_joints());
}

#[test]
fn a_root_of_another_name_is_not_counted_as_found_by_name() {
    let person = small_person();
    let other = clips::changed(&person.0, |joint| {
        joint.name = joint.name.replace("Hips", "pelvis");
    });
    let other = (other, person.1.clone());
    let (note, most) = put_on(&person, &other);
    assert!(note.contains("6 of 7 joints by name"), "{note}");
    let end = "; its root \"pelvis\" is taken for \"Hips\"";
    assert!(note.ends_with(end), "{note}");
    assert!(most < 1e-3, "{most} m: {note}");
}
