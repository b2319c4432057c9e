//! ASF skeletons and AMC motions are read according to their definition. Errors name the line.

use glam::{DMat3, DVec3, Quat, Vec3};
use sabaki::anim::JointKind;
use sabaki_fixtures::clips::joints_at;
use sabaki_fixtures::with;
use sabaki_import::asf::{AsfFile, USUAL_RATE};
use sabaki_import::{
    ChannelFile, FileError, LengthUnit, ReadError, ReadOptions, ScaleSource, Up, read_clip,
};

use super::common::{refusal, refused_file, written};
use super::refused::cases;

/// A skeleton, a line of `---`, and two frames.
const PERSON: &str = include_str!("corpus/asf/person");

fn parts() -> (&'static str, &'static str) {
    PERSON.split_once("\n---\n").unwrap()
}

fn turn(axis: usize, degrees: f64) -> DMat3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    match axis {
        0 => DMat3::from_cols_array(&[1.0, 0.0, 0.0, 0.0, cos, sin, 0.0, -sin, cos]),
        1 => DMat3::from_cols_array(&[cos, 0.0, -sin, 0.0, 1.0, 0.0, sin, 0.0, cos]),
        _ => DMat3::from_cols_array(&[cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0]),
    }
}

/// Turns in this order, the first about X.
fn xyz([x, y, z]: [f64; 3]) -> DMat3 {
    turn(2, z) * turn(1, y) * turn(0, x)
}

/// Where the bones of the second frame end, by the matrices of the definition: end = start + length M direction, M = parent C T C⁻¹.
fn ends_of_second_frame() -> [(&'static str, DVec3); 3] {
    let root = xyz([0.0, 90.0, 0.0]);
    let start = DVec3::new(1.0, 17.0, 2.0);
    let (c, t) = (xyz([0.0, 0.0, 20.0]), xyz([10.0, 20.0, 30.0]));
    let back = root * c * t * c.transpose();
    let shoulders = start + 8.0 * (back * DVec3::Y);
    // The head has no freedom: its own axes cancel out.
    let head = shoulders + 4.0 * (back * DVec3::Y);
    let left = root * c * xyz([-10.0, 0.0, 5.0]) * c.transpose();
    let left_way = DVec3::new(0.34202, -0.93969, 0.0).normalize();
    // Of axes in the order Z, Y, X only Z is turned about.
    let c = turn(2, -20.0);
    let right = root * c * xyz([10.0, 2.0, 3.0]) * c.transpose();
    let right_way = DVec3::new(-0.34202, -0.93969, 0.0).normalize();
    [
        ("head_End", head),
        ("lfemur_End", start + 16.0 * (left * left_way)),
        ("rfemur_End", start + 16.0 * (right * right_way)),
    ]
}

#[test]
fn bones_stand_where_the_definition_puts_them() {
    let (skeleton, motion) = parts();
    let asf = AsfFile::parse(skeleton.as_bytes()).unwrap();
    let amc = asf.motion(motion.as_bytes()).unwrap();
    assert_eq!(amc.frames(), 2);
    let (skeleton, clip) = amc.motion("person", 1.0).unwrap();
    assert_eq!((skeleton.len(), clip.frame_rate()), (8, USUAL_RATE));
    let ends = skeleton.joints().iter();
    let ends = ends.filter(|joint| joint.kind == JointKind::EndSite);
    assert_eq!(ends.count(), 3);
    let joints = joints_at(&skeleton, &clip, 1);
    for (name, place) in ends_of_second_frame() {
        let found = joints[skeleton.find(name).unwrap().index()].translation;
        let away = found.as_dvec3().distance(place);
        assert!(away < 1e-5, "{name}: {found} and {place}");
    }
}

/// A folder with the skeleton under one name and the motion under another.
fn folder(skeleton_name: &str, motion_name: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let (skeleton, motion) = parts();
    written(folder.path(), skeleton_name, skeleton);
    written(folder.path(), motion_name, motion.replace('\n', "\r\n"));
    folder
}

#[test]
fn a_motion_finds_its_skeleton_and_its_unit() {
    for (skeleton, motion) in [
        ("a.asf", "a.amc"),
        ("02.asf", "02_01.amc"),
        ("some.ASF", "else.AMC"),
    ] {
        let folder = folder(skeleton, motion);
        let read = read_clip(&folder.path().join(motion), &ReadOptions::default()).unwrap();
        assert_eq!(read.scale.found, ScaleSource::Unit(LengthUnit::Cmu));
        assert_eq!(read.clip.frame_rate(), USUAL_RATE);
        let options = with(|s: &mut ReadOptions| s.amc_rate = Some(30.0));
        let slow = read_clip(&folder.path().join(motion), &options).unwrap();
        assert_eq!(slow.clip.frame_rate(), 30.0);
    }
    let folder = folder("one.asf", "walk.amc");
    written(folder.path(), "two.asf", parts().0);
    let walk = folder.path().join("walk.amc");
    let (_, error) = refused_file(read_clip(&walk, &ReadOptions::default()));
    let is_named = matches!(&error, FileError::NoSkeleton(names) if names[0] == "walk.asf");
    assert!(is_named, "{error}");
    let options = with(|s: &mut ReadOptions| s.amc_rate = Some(f64::NAN));
    let refused = read_clip(&walk, &options);
    assert!(matches!(refused, Err(ReadError::Rate(_))));
}

#[test]
fn what_lies_is_stood_up() {
    let folder = folder("a.asf", "a.amc");
    let path = folder.path().join("a.amc");
    let places = |up: Up| -> Vec<Vec3> {
        let options = with(|s: &mut ReadOptions| s.up = Some(up));
        let read = read_clip(&path, &options).unwrap();
        let joints = joints_at(&read.skeleton, &read.clip, 1);
        joints.iter().map(|joint| joint.translation).collect()
    };
    let as_it_is = places(Up::Y);
    for (axis, turned) in [
        (Up::Z, Quat::from_rotation_x(-90f32.to_radians())),
        (Up::X, Quat::from_rotation_z(90f32.to_radians())),
    ] {
        for (stood, lying) in places(axis).into_iter().zip(&as_it_is) {
            assert!(stood.distance(turned * *lying) < 1e-5);
        }
    }
    // What pointed along Z points up.
    let up = Quat::from_rotation_x(-90f32.to_radians()) * Vec3::Z;
    assert!(up.distance(Vec3::Y) < 1e-6);
}

#[test]
fn lines_are_counted_whatever_ends_them() {
    let (skeleton, _) = parts();
    for end in ["\n", "\r\n", "\r"] {
        let text = skeleton.replace('\n', end);
        assert!(AsfFile::parse(text.as_bytes()).is_ok(), "{end:?}");
        let text = text.replacen("direction 0 1 0", "direction 0 x 0", 1);
        let error = refusal(AsfFile::parse(text.as_bytes()));
        let expected = "line 19: expected a number, found \"x\"";
        assert_eq!(error, expected, "{end:?}");
    }
}

#[test]
fn what_is_wrong_is_named_with_its_line() {
    let (skeleton, motion) = parts();
    let damage = |from: &str, to: &str| {
        assert!(PERSON.contains(from), "{from}");
        let read = AsfFile::parse(skeleton.replacen(from, to, 1).as_bytes());
        let read = read.and_then(|asf| asf.motion(motion.replacen(from, to, 1).as_bytes()));
        refusal(read)
    };
    for [from, to, error] in cases(include_str!("refused/asf.txt")) {
        let found = damage(&from, &to);
        assert!(found.contains(&error), "{from:?} to {to:?}: {found}");
    }
    for empty in ["", "# nothing\n", ":bonedata\n"] {
        let error = refusal(AsfFile::parse(empty.as_bytes()));
        assert!(error.contains("the file has no"), "{error}");
    }
    let asf = AsfFile::parse(skeleton.as_bytes()).unwrap();
    for empty in ["", ":DEGREES\n"] {
        let error = refusal(asf.motion(empty.as_bytes()));
        assert!(error.contains("no frames"), "{error}");
    }
    let error = refusal(AsfFile::parse(b"a\nb\xff"));
    assert_eq!(error, "line 2: not a text file");
}

#[test]
fn gaps_in_a_motion_are_filled_and_named() {
    let (skeleton, motion) = parts();
    let asf = AsfFile::parse(skeleton.as_bytes()).unwrap();
    let whole = asf.motion(motion.as_bytes()).unwrap();
    assert!(whole.notes.is_empty());
    // The second frame is the fifth: three are missing.
    let gap = asf
        .motion(motion.replace("\n2\n", "\n5\n").as_bytes())
        .unwrap();
    assert_eq!(gap.frames(), 5);
    let note = "3 frames are missing, the first after frame 1: they are filled";
    assert_eq!(gap.notes, [note]);
    let roots = |amc: &ChannelFile| -> Vec<Vec3> {
        let (_, clip) = amc.motion("person", 1.0).unwrap();
        (0..clip.frames()).map(|frame| clip.root(frame)).collect()
    };
    let ends = roots(&whole);
    for (frame, root) in roots(&gap).into_iter().enumerate() {
        let wanted = ends[0].lerp(ends[1], frame as f32 / 4.0);
        assert!(root.distance(wanted) < 1e-5, "{frame}: {root} {wanted}");
    }
    let less = motion.replacen("rfemur 0 0 0\n", "", 1);
    let held = asf.motion(less.as_bytes()).unwrap();
    assert_eq!(held.frames(), 2);
    let note =
        "frames leave out bones, which keep their values: 1 times, first \"rfemur\" in frame 1";
    assert_eq!(held.notes, [note]);
    let far = motion.replace("\n2\n", "\n99999999999\n");
    let error = refusal(asf.motion(far.as_bytes()));
    assert!(error.contains("rotations in all"), "{error}");
}
