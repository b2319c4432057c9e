//! Files that contradict their format or the names of their joints are read as their motion shows, with a note.

use std::path::Path;

use glam::{Quat, Vec3};
use sabaki::anim::{Clip, Facing, Skeleton};
use sabaki_fixtures::clips::{changed, clips_apart, joints_at, skeleton, still_clip};
use sabaki_import::{ClipSet, ReadOptions, read_clip};

use super::common::{read, write_glb};

/// The walking figure.
fn walking() -> ClipSet {
    read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/rigs/hips_root.bvh"))
}

/// A motion in turned space; on joints whose axes are turned too, or not.
fn turned(set: &ClipSet, turn: Quat, with_joints: bool) -> (Skeleton, Clip) {
    let mut desc = set.clips[0].desc();
    desc.roots.iter_mut().for_each(|root| *root = turn * *root);
    let joints = set.skeleton.len();
    for (index, own) in desc.rotations.iter_mut().enumerate() {
        *own = match with_joints {
            true => turn * *own * turn.conjugate(),
            false if index % joints == 0 => turn * *own,
            false => *own,
        };
    }
    let skeleton = match with_joints {
        true => changed(&set.skeleton, |joint| joint.offset = turn * joint.offset),
        false => set.skeleton.clone(),
    };
    let clip = Clip::new(&skeleton, desc).unwrap();
    (skeleton, clip)
}

#[test]
fn a_gltf_figure_that_stands_along_z_is_turned() {
    let folder = tempfile::tempdir().unwrap();
    let plain = walking();
    let to_z = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
    let (skeleton, clip) = turned(&plain, to_z, true);
    let path = write_glb(folder.path(), "along_z.glb", &skeleton, &[clip], &[]);
    let set = read(&path);
    let said = &set.warnings[0];
    assert!(said.contains("stands along +Z"), "{said}");
    let apart = clips_apart(
        (&plain.skeleton, &plain.clips[0]),
        (&set.skeleton, &set.clips[0]),
    );
    assert!(apart < 1e-4, "{apart}");
    // The joints keep their frames, so that a mesh that is bound to them stays bound.
    let offset = |skeleton: &Skeleton| skeleton.joint(skeleton.find("LeftLeg").unwrap()).offset;
    assert!(offset(&set.skeleton).distance(offset(&skeleton)) < 1e-6);
    let only = read_clip(&path, &ReadOptions::default()).unwrap();
    assert_eq!(only.clip.root(3), set.clips[0].root(3));

    // A figure that lies, and would stand without motion, is left as it is.
    let (skeleton, clip) = turned(&plain, to_z, false);
    let path = write_glb(
        folder.path(),
        "lies.glb",
        &skeleton,
        std::slice::from_ref(&clip),
        &[],
    );
    let set = read(&path);
    let apart = clips_apart((&skeleton, &clip), (&set.skeleton, &set.clips[0]));
    assert!(apart < 1e-4, "{apart}");
}

#[test]
fn toes_and_knees_contradict_names_of_sides() {
    let folder = tempfile::tempdir().unwrap();
    let plain = walking();
    let exchanged = |name: &str| match name.strip_prefix("Left") {
        Some(rest) => format!("Right{rest}"),
        None => name.replace("Right", "Left"),
    };
    let skeleton = changed(&plain.skeleton, |joint| joint.name = exchanged(&joint.name));
    let path = write_glb(folder.path(), "exchanged.glb", &skeleton, &plain.clips, &[]);
    let set = read(&path);
    let said = &set.warnings[0];
    let is_named = said.contains("\"RightFoot\" is on the left, \"LeftFoot\" on the right");
    assert!(is_named, "{said}");
    let heading = |set: &ClipSet| {
        let joints = joints_at(&set.skeleton, &set.clips[0], 0);
        Facing::of(&set.skeleton).placement(&joints).heading()
    };
    assert!((heading(&set) - heading(&plain)).abs() < 1e-3);
    let note = &read_clip(&path, &ReadOptions::default()).unwrap().notes[0];
    assert!(said.ends_with(note.as_str()), "{note}");
    assert_eq!(plain.warnings, Vec::<String>::new());
}

#[test]
fn a_figure_on_four_legs_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let trunk = [
        ("Hips", None, Vec3::ZERO),
        ("Spine", Some(0), Vec3::Z * 0.5),
        ("Head", Some(1), Vec3::Z * 0.3),
    ];
    let of_hands = [
        "LeftArm",
        "LeftForeArm",
        "LeftHand",
        "RightArm",
        "RightForeArm",
        "RightHand",
    ];
    let of_feet = [
        "LeftUpLeg",
        "LeftLeg",
        "LeftFoot",
        "RightUpLeg",
        "RightLeg",
        "RightFoot",
    ];
    let feet_in_front = of_feet.map(|name| format!("Front{name}"));
    let read = |name: &str, front: [&str; 6]| {
        let mut joints = trunk.to_vec();
        for (names, top) in [(front, 1), (of_feet, 0)] {
            for (index, name) in names.into_iter().enumerate() {
                let (side, last) = ([0.1, -0.1][index / 3], joints.len() as u16 - 1);
                joints.push(match index % 3 {
                    0 => (name, Some(top), Vec3::X * side),
                    _ => (name, Some(last), Vec3::Y * -0.3),
                });
            }
        }
        let skeleton = skeleton(&joints);
        let roots = (0..30).map(|frame| Vec3::new(0.0, 0.6, 0.03 * frame as f32));
        let clip = still_clip(&skeleton, "walk", 30.0, roots.collect());
        read(&write_glb(folder.path(), name, &skeleton, &[clip], &[])).warnings
    };
    let said = read("hands.glb", of_hands);
    let is_named = said[0].contains("four legs: \"LeftHand\", \"RightHand\" are taken for hands");
    assert!(is_named, "{said:?}");
    let said = read("feet.glb", feet_in_front.each_ref().map(String::as_str));
    assert!(said[0].contains("the figure has 4 legs"), "{said:?}");
}
