//! Promise: a motion is put on another skeleton by the joints' names: its bones have the captured directions whatever both rest poses are,
//! what that costs is said, and what has other names is refused by name.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::fs::File;
use std::path::{Path, PathBuf};

use glam::{Quat, Vec3};
use sabaki::anim::{Clip, ClipDesc, Joint, JointTransform, Pose, Skeleton, forward_kinematics};
use sabaki_import::{ClipSet, ReadError, ReadOptions, bvh, read_clips};

const RETARGET: ReadOptions = ReadOptions {
    scale: None,
    up: sabaki_import::Up::Y,
    amc_rate: None,
    keep_going: false,
    retarget: true,
};

/// Two clips of one body, and the folder of captures by others.
fn captures() -> Option<([PathBuf; 2], PathBuf)> {
    let Some(root) = std::env::var_os("SABAKI_MOCAP").map(PathBuf::from) else {
        eprintln!("skipped: SABAKI_MOCAP names no folder with motion capture");
        return None;
    };
    let own = ["Male2_E19_DodgeLeft.bvh", "Male2_B3_Walk.bvh"];
    let own = own.map(|name| root.join("fight").join(name));
    Some((own, root.join("dialects")))
}

fn positions(skeleton: &Skeleton, clip: &Clip, frame: usize) -> Vec<Vec3> {
    let (mut pose, mut joints): (Pose, Vec<JointTransform>) = Default::default();
    clip.pose(frame, &mut pose);
    forward_kinematics(skeleton, &pose, &mut joints);
    joints.iter().map(|joint| joint.translation).collect()
}

/// The same motion of a body that is larger by `scale`, with the axes of each joint turned and with other names.
fn disguised(skeleton: &Skeleton, clip: &Clip, scale: f32) -> (Skeleton, Clip) {
    let turn = |index: usize| {
        let angle = |factor: f32| 0.8 * (factor * (index + 1) as f32).sin();
        Quat::from_euler(glam::EulerRot::XYZ, angle(1.7), angle(2.9), angle(4.3))
    };
    let turns: Vec<Quat> = (0..skeleton.len()).map(turn).collect();
    let above = |joint: &Joint| joint.parent.map_or(Quat::IDENTITY, |p| turns[p.index()]);
    let joints = skeleton.joints().iter().map(|joint| Joint {
        name: format!("other:{}", joint.name.to_uppercase()),
        offset: scale * (above(joint).inverse() * joint.offset),
        ..joint.clone()
    });
    let other = Skeleton::new(joints.collect()).unwrap();
    let mut desc = clip.desc().clone();
    desc.roots.iter_mut().for_each(|root| *root *= scale);
    for rotations in desc.rotations.chunks_mut(skeleton.len()) {
        for ((rotation, joint), turn) in rotations.iter_mut().zip(skeleton.joints()).zip(&turns) {
            if joint.kind == sabaki::anim::JointKind::Moving {
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
    notes.find(of_file).unwrap().clone()
}

#[test]
fn a_body_of_other_size_axes_and_names_moves_as_it_did() {
    let Some((files, _)) = captures() else { return };
    let plain = read_clips(&files, None, &ReadOptions::default()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("disguised.bvh");
    let (other, clip) = disguised(&plain.skeleton, &plain.clips[0], 1.25);
    write(&file, &other, &clip);
    let paths = [files[0].clone(), files[1].clone(), file];
    let refused = read_clips(&paths, None, &ReadOptions::default()).unwrap_err();
    assert!(
        matches!(refused, ReadError::SkeletonDiffers { .. }),
        "{refused}"
    );

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
    assert!(
        note.contains("22 of 22 joints") && note.contains("times 0.800"),
        "{note}"
    );
    assert!(note.contains("0.0 cm from where"), "{note}");
}

#[test]
fn captures_by_others_walk_on_the_same_skeleton() {
    let Some((own, others)) = captures() else {
        return;
    };
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
        let alone = read_clips(std::slice::from_ref(path), None, &ReadOptions::default()).unwrap();
        let plain = |name: &str| {
            let own = name.rsplit(':').next().unwrap();
            own.to_lowercase().replace(['_', '-', '.', ' '], "")
        };
        let pairs: Vec<(usize, usize)> = { set.skeleton.joints().iter().enumerate() }
            .filter_map(|(to, joint)| {
                let mut own = alone.skeleton.joints().iter();
                Some((
                    to,
                    own.position(|own| plain(&own.name) == plain(&joint.name))?,
                ))
            })
            .collect();
        assert!(pairs.len() > 16, "{note}");
        let mut most = 0f32;
        for frame in 0..clip.frames() {
            let moved = positions(&set.skeleton, clip, frame);
            let own = positions(&alone.skeleton, &alone.clips[0], frame);
            let away = pairs
                .iter()
                .map(|&(to, from)| moved[to].distance(scale * own[from]));
            most = away.fold(most, f32::max);
        }
        // What the note says, and far less than a limb.
        assert!(
            (100.0 * most - number("on average, ")).abs() < 0.5,
            "{note}: {most} m"
        );
        assert!(number("joints are ") < 15.0 && most < 0.35, "{note}");
    }
}

#[test]
fn a_motion_that_ends_too_far_away_is_refused_with_that_reason() {
    let Some((files, _)) = captures() else { return };
    let plain = read_clips(&files, None, &ReadOptions::default()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let far = folder.path().join("far.bvh");
    let (other, clip) = disguised(&plain.skeleton, &plain.clips[0], 0.5);
    let mut desc = clip.desc().clone();
    desc.roots.iter_mut().for_each(|root| root.x += 600e3);
    write(&far, &other, &Clip::new(&other, desc).unwrap());
    let paths = [files[0].clone(), files[1].clone(), far.clone()];
    let centimetres = ReadOptions {
        scale: Some(0.01),
        ..RETARGET
    };
    let refused = read_clips(&paths, None, &centimetres).unwrap_err();
    let ReadError::Retargeted { path, error } = &refused else {
        panic!("{refused}");
    };
    assert_eq!(path, &far);
    assert!(error.to_string().contains("within 1000000 m"), "{refused}");
}

#[test]
fn other_names_are_refused_and_told() {
    let Some((own, others)) = captures() else {
        return;
    };
    let paths = [&own[..], &[others.join("tpose.bvh")]].concat();
    let refused = read_clips(&paths, None, &RETARGET).unwrap_err();
    let ReadError::NotRetargeted { path, missing, .. } = &refused else {
        panic!("{refused}");
    };
    assert_eq!(path, &paths[2]);
    assert!(
        missing.iter().any(|name| name == "LeftUpLeg"),
        "{missing:?}"
    );
    let options = ReadOptions {
        keep_going: true,
        ..RETARGET
    };
    let set = read_clips(&paths, None, &options).unwrap();
    assert_eq!((set.clips.len(), set.left_out.len()), (2, 1));
}

#[test]
fn a_motion_without_bones_is_no_motion_of_this_skeleton() {
    let Some((own, _)) = captures() else { return };
    let plain = read_clips(&own, None, &ReadOptions::default()).unwrap();
    let joints = plain.skeleton.joints().iter().map(|joint| Joint {
        name: format!("flat:{}", joint.name),
        offset: Vec3::ZERO,
        ..joint.clone()
    });
    let flat = Skeleton::new(joints.collect()).unwrap();
    let desc = ClipDesc {
        name: "flat.bvh".into(),
        ..plain.clips[0].desc().clone()
    };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("flat.bvh");
    write(&file, &flat, &Clip::new(&flat, desc).unwrap());
    let options = ReadOptions {
        scale: Some(0.01),
        ..RETARGET
    };
    let paths = [&own[..], &[file]].concat();
    let set = read_clips(&paths, None, &options).unwrap();
    // Its rotations are all that it has; they are played on the bones of the others.
    let last = set.clips.last().unwrap();
    let places = positions(&set.skeleton, last, 0);
    assert!(places.iter().all(|place| place.is_finite()));
}
