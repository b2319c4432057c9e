//! The meaning of a set of captures does not depend on joint names or on the start of its clips.
//! Sets that cannot be interpreted cause a warning.

use std::path::{Path, PathBuf};

use glam::{Quat, Vec3};
use sabaki::anim::{Clip, Facing, Skeleton};
use sabaki::maps::Body;
use sabaki_fixtures::clips;
use sabaki_fixtures::with;
use sabaki_import::{ClipSet, LengthUnit, ReadError, ReadOptions, ScaleSource, read_clips};
use serde_json::{Value, json};

use super::common::{refusal, write_glb, written};

/// Names of a pelvis, two legs, a trunk with a head and two arms.
type Names<'a> = [&'a str; 8];

const PLAIN: Names = [
    "Hips", "LeftLeg", "RightLeg", "Chest", "Head", "LeftArm", "RightArm", "Neck",
];

/// The same figure under other names, one a line. Its left is +X. Both legs of one begin with an l.
const NAMED: &str = "\
Bip01, Bip01 L Thigh, Bip01 R Thigh, Bip01 Spine, Bip01 Head, Bip01 L UpperArm, Bip01 R UpperArm, Bip01 Neck
Bip01_Pelvis, Bip01_L_Thigh, Bip01_R_Thigh, Bip01_Spine, Bip01_Head, Bip01_L_Arm, Bip01_R_Arm, Bip01_Neck
hip, lThigh, rThigh, abdomen, head, lShldr, rShldr, neck
mixamorig:Hips, mixamorig:LeftUpLeg, mixamorig:RightUpLeg, mixamorig:Spine, mixamorig:Head, mixamorig:LeftArm, mixamorig:RightArm, mixamorig:Neck
root, rig:l_leg, rig:r_leg, rig:spine, rig:head, rig:l_arm, rig:r_arm, rig:neck
pelvis, leg.L, leg.R, spine, head, arm.L, arm.R, neck
pelvis, LegLeft, LegRight, spine, head, ArmLeft, ArmRight, neck
Pelvis, ThighL, ThighR, Spine, Head, ArmL, ArmR, Neck
";

/// Joints in this order: hips, the right side, the left side, the trunk.
fn skeleton(names: &Names) -> Skeleton {
    let end = |name: &str| format!("{name}_End");
    clips::skeleton(&[
        (names[0], None, Vec3::ZERO),
        (names[2], Some(0), Vec3::new(-0.1, -0.9, 0.0)),
        (&end(names[2]), Some(1), Vec3::new(0.0, 0.0, 0.15)),
        (names[1], Some(0), Vec3::new(0.1, -0.9, 0.0)),
        (&end(names[1]), Some(3), Vec3::new(0.0, 0.0, 0.15)),
        (names[3], Some(0), Vec3::new(0.0, 0.4, 0.0)),
        (names[6], Some(5), Vec3::new(-0.2, 0.0, 0.0)),
        (&end(names[6]), Some(6), Vec3::new(-0.6, 0.0, 0.0)),
        (names[5], Some(5), Vec3::new(0.2, 0.0, 0.0)),
        (&end(names[5]), Some(8), Vec3::new(0.6, 0.0, 0.0)),
        (names[7], Some(5), Vec3::new(0.0, 0.1, 0.0)),
        (names[4], Some(10), Vec3::new(0.0, 0.1, 0.0)),
        (&end(names[4]), Some(11), Vec3::new(0.0, 0.2, 0.0)),
    ])
}

#[test]
fn sides_are_known_by_the_names_of_many_programs() {
    let plain = skeleton(&PLAIN);
    let body = Body::from_bones(&plain);
    let facing = Facing::of(&plain).placement(&clips::at_rest(&plain, Vec3::Y));
    for names in NAMED.lines() {
        let named: Vec<&str> = names.split(", ").collect();
        let named = skeleton(&named.try_into().unwrap());
        assert_eq!(Body::from_bones(&named), body, "{names}");
        let twins = |skeleton: &Skeleton| -> Vec<_> {
            skeleton.ids().map(|id| skeleton.mirror(id)).collect()
        };
        assert_eq!(twins(&named), twins(&plain), "{names}");
        let placement = Facing::of(&named).placement(&clips::at_rest(&named, Vec3::Y));
        assert_eq!(placement, facing, "{names}");
        assert!(placement.heading().abs() < 1e-6, "{names}");
    }
}

/// The figure as BVH in centimetres, standing, rotated about X by an angle in degrees.
fn bvh(names: &Names, turn: f32) -> String {
    let skeleton = skeleton(names);
    let mut rotations = vec![Quat::IDENTITY; skeleton.len()];
    rotations[0] = Quat::from_rotation_x(turn.to_radians());
    let roots = vec![Vec3::Y * 0.9; 2];
    let clip = clips::clip(&skeleton, "figure", 30.0, roots, rotations.repeat(2));
    let mut text = Vec::new();
    sabaki_import::bvh::write(&mut text, &skeleton, &clip, 0.01).unwrap();
    String::from_utf8(text).unwrap()
}

fn read(files: &[(&str, String)]) -> ClipSet {
    let folder = tempfile::tempdir().unwrap();
    let paths = files.iter();
    let paths = paths.map(|(name, text)| written(folder.path(), name, text));
    let paths: Vec<PathBuf> = paths.collect();
    read_clips(&paths, None, &ReadOptions::default()).unwrap()
}

/// With hands and feet by name.
const LIMBS: Names = [
    "Hips",
    "LeftFoot",
    "RightFoot",
    "Chest",
    "Head",
    "LeftHand",
    "RightHand",
    "Neck",
];

#[test]
fn names_that_tell_no_side_are_warned_of() {
    let nameless = ["j0", "j1", "j2", "j3", "j4", "j5", "j6", "j7"];
    let set = read(&[("a.bvh", bvh(&nameless, 0.0))]);
    assert_eq!(set.warnings.len(), 1, "{:?}", set.warnings);
    assert!(set.warnings[0].starts_with("no joint names tell left from right"));
}

#[test]
fn another_axis_than_y_up_is_warned_of() {
    for (turn, axis) in [(90.0, "+Z"), (-90.0, "-Z"), (180.0, "-Y")] {
        let set = read(&[("a.bvh", bvh(&LIMBS, turn))]);
        assert_eq!(set.warnings.len(), 1, "{:?}", set.warnings);
        let start = format!("the figure seems to stand along {axis}");
        assert!(set.warnings[0].starts_with(&start), "{:?}", set.warnings);
    }
    // One clip of many may well lie.
    let lying = [("a.bvh", 0.0), ("b.bvh", 90.0), ("c.bvh", 0.0)];
    let set = read(&lying.map(|(name, turn)| (name, bvh(&LIMBS, turn))));
    assert_eq!(set.warnings, Vec::<String>::new());
}

/// A rig whose root lies on the ground and turns a skeleton that is made with +Z up: it stands, in the space of the scene.
#[test]
fn a_rig_that_its_root_turns_upright_stands() {
    let skeleton = clips::skeleton(&[
        ("root", None, Vec3::ZERO),
        ("hips", Some(0), Vec3::new(0.0, 0.0, 0.9)),
        ("foot.l", Some(1), Vec3::new(0.1, 0.0, -0.82)),
        ("foot.r", Some(1), Vec3::new(-0.1, 0.0, -0.82)),
        ("hand.l", Some(1), Vec3::new(0.4, 0.0, 0.5)),
        ("hand.r", Some(1), Vec3::new(-0.4, 0.0, 0.5)),
    ]);
    let clip = |turn: Quat| {
        let mut rotations = vec![turn];
        rotations.resize(skeleton.len(), Quat::IDENTITY);
        let roots = vec![Vec3::ZERO; 2];
        clips::clip(&skeleton, "rig", 30.0, roots, rotations.repeat(2))
    };
    let folder = tempfile::tempdir().unwrap();
    for (turn, axis) in [(-90.0f32, None), (0.0, Some("+Z")), (90.0, Some("-Y"))] {
        let clip = clip(Quat::from_rotation_x(turn.to_radians()));
        let path = write_glb(folder.path(), "rig.glb", &skeleton, &[clip], &[]);
        let set = super::common::read(&path);
        let mut warnings = set.warnings.iter();
        let told = warnings.find(|note| note.contains("stands along"));
        match axis {
            None => assert_eq!(told, None, "{turn}"),
            Some(axis) => assert!(told.unwrap().contains(axis), "{turn}: {told:?}"),
        }
    }
}

/// A first pose from which no height can be read: bent over, head and hands below the hips.
fn folded() -> String {
    let bent = "0 90 0 0 0 0 0 0 0 0 0 0 0 180 0 -90 0 0 90 0 0 0 0 0 0 0 0";
    let text = bvh(&LIMBS, 0.0);
    let mut lines: Vec<&str> = text.lines().collect();
    let first = lines.len() - 2;
    lines[first..].fill(bent);
    lines.join("\n")
}

#[test]
fn clips_with_the_same_bones_have_one_scale() {
    let alone = read(&[("folded.bvh", folded())]);
    let centimetres = ScaleSource::Unit(LengthUnit::Centimetre);
    assert_ne!(alone.scales[0].found, centimetres);
    for files in [
        [("a.bvh", folded()), ("b.bvh", bvh(&LIMBS, 0.0))],
        [("a.bvh", bvh(&LIMBS, 0.0)), ("b.bvh", folded())],
    ] {
        let set = read(&files);
        let found = set.scales.iter().map(|scale| scale.found);
        assert!(found.eq([centimetres; 2]));
        assert_eq!(set.warnings, Vec::<String>::new());
    }
}

fn keep_going() -> ReadOptions {
    with(|s: &mut ReadOptions| s.keep_going = true)
}

/// A folder with three good files, a file that ends early, two that are no BVH, and a good one of another skeleton.
fn untidy_folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let (good, other) = (bvh(&LIMBS, 0.0), bvh(&PLAIN, 0.0));
    let files = [
        ("a.bvh", other.as_str()),
        ("b.bvh", &good),
        ("c.bvh", &good[..good.len() / 2]),
        ("d.bvh", &good),
        ("e.bvh", "HIERARCHY\nnonsense\n"),
        ("f.bvh", ""),
        ("g.bvh", &good),
    ];
    for (name, text) in files {
        written(folder.path(), name, text);
    }
    events_for(folder.path(), &["c.bvh", "d.bvh"]);
    folder
}

#[test]
fn all_files_that_cannot_be_read_are_named() {
    let folder = untidy_folder();
    let paths = [folder.path().to_owned()];
    let refused = read_clips(&paths, None, &ReadOptions::default()).unwrap_err();
    let ReadError::Files { files, errors } = refused else {
        panic!("{refused}");
    };
    assert_eq!(files, 7);
    // The three broken ones, and those whose skeleton is not the first file's.
    let texts: Vec<String> = errors.iter().map(ToString::to_string).collect();
    assert_eq!(texts.len(), 6, "{texts:?}");
    for (text, name) in texts.iter().zip(["b", "c", "d", "e", "f", "g"]) {
        assert!(text.contains(&format!("{name}.bvh: ")), "{texts:?}");
    }
}

#[test]
fn the_largest_group_is_read_and_the_rest_is_left_out() {
    let folder = untidy_folder();
    let paths = [folder.path().to_owned()];
    let events = folder.path().join("events.json");
    let set = read_clips(&paths, Some(&events), &keep_going()).unwrap();
    let names: Vec<&str> = set.clips.iter().map(Clip::name).collect();
    assert_eq!(names, ["b.bvh", "d.bvh", "g.bvh"]);
    assert_eq!(set.left_out.len(), 4, "{:?}", set.left_out);
    for (text, name) in set.left_out.iter().zip(["a", "c", "e", "f"]) {
        assert!(text.contains(&format!("{name}.bvh: ")), "{text}");
    }
    assert!(set.left_out[0].contains("skeleton differs from that of"));
    // The events of a clip that is left out are left out with it.
    assert_eq!(set.events.len(), 1);
    assert_eq!(set.events[0].clip, 1);
    // It is the set that the good files make alone.
    let good = ["b.bvh", "d.bvh", "g.bvh"].map(|name| folder.path().join(name));
    let alone = read_clips(&good, None, &ReadOptions::default()).unwrap();
    assert_eq!((&set.clips, &set.skeleton), (&alone.clips, &alone.skeleton));

    let broken = ["c.bvh", "f.bvh"].map(|name| folder.path().join(name));
    let refused = read_clips(&broken, None, &keep_going()).unwrap_err();
    assert!(matches!(refused, ReadError::Files { files: 2, .. }));
}

/// A glTF file with still animations of this figure, by their names, with the root at a place.
fn write_gltf(folder: &Path, name: &str, skeleton: &Skeleton, animations: &[(&str, Vec3)]) {
    let clip =
        |&(name, root): &(&str, Vec3)| clips::still_clip(skeleton, name, 30.0, vec![root; 3]);
    let clips: Vec<Clip> = animations.iter().map(clip).collect();
    write_glb(folder, name, skeleton, &clips, &[]);
}

/// Writes the figure under some names.
fn write_figures(folder: &Path, names: &[&str]) {
    for name in names {
        written(folder, name, bvh(&LIMBS, 0.0));
    }
}

#[test]
fn the_largest_group_is_that_of_most_files() {
    let folder = tempfile::tempdir().unwrap();
    let animations = [
        ("Walk", Vec3::Y),
        ("Run", 2.0 * Vec3::Y),
        ("Idle", 3.0 * Vec3::Y),
    ];
    write_gltf(folder.path(), "a.glb", &skeleton(&PLAIN), &animations);
    write_figures(folder.path(), &["b.bvh", "c.bvh"]);
    let read = |paths: &[PathBuf]| {
        let set = read_clips(paths, None, &keep_going()).unwrap();
        let names = set.clips.iter().map(|clip| clip.name().to_owned());
        (names.collect::<Vec<_>>(), set.left_out.len())
    };
    let (names, left_out) = read(&[folder.path().to_owned()]);
    assert_eq!((names, left_out), (vec!["b.bvh".into(), "c.bvh".into()], 1));
    // Of groups of as many files the first is read.
    let (names, left_out) = read(&["c.bvh", "a.glb"].map(|name| folder.path().join(name)));
    assert_eq!((names, left_out), (vec!["c.bvh".into()], 1));
}

/// An events file with an evasion for each of these names.
fn events_for(folder: &Path, names: &[&str]) -> PathBuf {
    let events = json!([{ "kind": "evasion", "start": 0.0, "end": 0.02 }]);
    let entries = names
        .iter()
        .map(|name| json!({ "file": name, "events": events }));
    let clips: Vec<Value> = entries.collect();
    written(folder, "events.json", json!({ "clips": clips }).to_string())
}

#[test]
fn events_of_the_animations_of_a_file_are_left_out_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let animations = [("Walk", Vec3::Y), ("a/Run", 2.0 * Vec3::Y)];
    write_gltf(folder.path(), "Fox.glb", &skeleton(&PLAIN), &animations);
    write_figures(folder.path(), &["a.bvh", "b.bvh", "c.bvh"]);
    let paths = [folder.path().to_owned()];
    let names = ["Fox.glb:Walk", "b.bvh", "clips/Fox.glb:a/Run", "Fox.glb"];
    let events = events_for(folder.path(), &names);
    let set = read_clips(&paths, Some(&events), &keep_going()).unwrap();
    assert_eq!((set.clips.len(), set.left_out.len()), (3, 1));
    assert_eq!(set.events.len(), 1);
    assert_eq!(set.clips[set.events[0].clip].name(), "b.bvh");
    // Names of clips that never were are errors, as ever.
    let events = events_for(folder.path(), &["Fix.glb:Walk"]);
    let refused = refusal(read_clips(&paths, Some(&events), &keep_going()));
    assert!(refused.contains("no such clip"), "{refused}");
}

#[test]
fn events_of_an_animation_that_is_read_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    // Half as large, so that its path is doubled.
    let half = clips::changed(&skeleton(&LIMBS), |joint| {
        joint.offset *= 0.5;
        joint.name = joint.name.to_lowercase();
    });
    let animations = [("near", Vec3::Y), ("far", Vec3::new(600e3, 1.0, 0.0))];
    write_gltf(folder.path(), "half.glb", &half, &animations);
    write_figures(folder.path(), &["a.bvh", "b.bvh"]);
    let mut options = keep_going();
    options.retarget = true;
    let events = events_for(folder.path(), &["half.glb:near", "half.glb:far"]);
    let paths = [folder.path().to_owned()];
    let set = read_clips(&paths, Some(&events), &options).unwrap();
    assert_eq!(set.left_out.len(), 1, "{:?}", set.left_out);
    let left_out = &set.left_out[0];
    assert!(left_out.contains("within 1000000 m"), "{left_out}");
    let names: Vec<&str> = set.clips.iter().map(Clip::name).collect();
    assert_eq!(names, ["a.bvh", "b.bvh", "half.glb:near"]);
    assert_eq!(set.events.len(), 1);
    assert_eq!(set.events[0].clip, 2);
}
