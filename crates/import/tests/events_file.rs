//! Valid events files, attack files and clip sets are read. Errors in invalid ones name the
//! position.

use std::path::PathBuf;

use glam::Vec3;
use sabaki::anim::{Clip, EventKind, JointId, Skeleton};
use sabaki_fixtures::clips::still_clip;
use sabaki_import::{AttackFile, EventsFile, ReadOptions, read_clips};

use serde_json::json;

use super::common::refusal;
use super::refused::cases;

fn skeleton() -> Skeleton {
    sabaki_fixtures::clips::skeleton(&[("Hips", None, Vec3::Y), ("Head", Some(0), Vec3::Y)])
}

/// Two clips of 3 s at 10 frames per second.
fn clips() -> Vec<Clip> {
    clips_of(&["a.bvh", "b.bvh"])
}

/// Clips of 3 s at 10 frames per second, by name.
fn clips_of(names: &[&str]) -> Vec<Clip> {
    let clip = |name: &&str| still_clip(&skeleton(), name, 10.0, vec![Vec3::ZERO; 31]);
    names.iter().map(clip).collect()
}

/// Clips of the events of an entry with this name, or the error.
fn found(names: &[&str], entry: &str) -> Result<Vec<usize>, String> {
    let event = r#"{"kind": "evasion", "start": 1, "end": 2}"#;
    let entry = serde_json::to_string(entry).unwrap();
    let text = format!("{{\"clips\": [{{\"file\": {entry}, \"events\": [{event}]}}]}}");
    let file = EventsFile::parse(text.as_bytes()).unwrap();
    let events = file.resolve(&clips_of(names), &skeleton());
    let events = events.map_err(|error| error.to_string())?;
    Ok(events.iter().map(|event| event.clip).collect())
}

/// The error of one event of `a.bvh`.
fn error_of(event: &str) -> String {
    let text = format!("{{\"clips\":[{{\"file\":\"a.bvh\",\"events\":[\n{event}]}}]}}");
    let file = match EventsFile::parse(text.as_bytes()) {
        Ok(file) => file,
        Err(error) => return error.to_string(),
    };
    refusal(file.resolve(&clips(), &skeleton()))
}

#[test]
fn events_find_their_clips_and_joints() {
    let text = br#"{"about": 1, "clips": [
        {"file": "some/folder/b.bvh", "events": [
            {"kind": "attack", "start": 2.0, "end": 3.04, "joints": ["Head"], "contact": 2.5},
            {"kind": "evasion", "start": 1, "end": 2.5}]},
        {"file": "a.bvh"}]}"#;
    let file = EventsFile::parse(text).unwrap();
    let events = file.resolve(&clips(), &skeleton()).unwrap();
    assert_eq!(events.len(), 2);
    assert_eq!((events[0].clip, events[0].kind), (1, EventKind::Evasion));
    assert!(events[0].joints.is_empty());
    assert_eq!(events[1].joints, [JointId(1)]);
    assert_eq!(events[1].end, 3.0, "the slack is cut off");
    let again = EventsFile::of(&events, &clips(), &skeleton()).unwrap();
    let text = serde_json::to_string(&again).unwrap();
    let read = EventsFile::parse(text.as_bytes()).unwrap();
    assert_eq!(read.resolve(&clips(), &skeleton()).unwrap(), events);
}

#[test]
fn names_of_animations_keep_their_slashes() {
    let all = [
        "walk.bvh",
        "Walk",
        "slash.glb:idle/Walk",
        "slash.glb:run\\Walk",
        "slash.GLTF:run/Walk",
    ];
    for (entry, clip) in [
        ("slash.glb:idle/Walk", 2),
        ("some/folder/slash.glb:idle/Walk", 2),
        ("C:\\some\\folder\\slash.glb:idle/Walk", 2),
        ("slash.glb:run\\Walk", 3),
        ("folder/slash.GLTF:run/Walk", 4),
        ("Walk", 1),
        ("C:\\walk.bvh", 0),
        ("a:b/walk.bvh", 0),
    ] {
        assert_eq!(found(&all, entry), Ok(vec![clip]), "{entry}");
    }
    for entry in ["slash.glb:Walk", "slash.glb:other/Walk", "idle/walk"] {
        let none = format!("events for \"{entry}\", but there is no such clip");
        assert_eq!(found(&all, entry), Err(none));
    }
    let text = r#"{"clips": [{"file": "x/slash.glb:idle/Walk", "events": [{"kind": "evasion", "start": 1, "end": 2}]}]}"#;
    let file = EventsFile::parse(text.as_bytes()).unwrap();
    for (clip, count) in [
        ("slash.glb:idle/Walk", 1),
        ("slash.glb:run/Walk", 0),
        ("Walk", 0),
    ] {
        assert_eq!(file.events_of(clip).len(), count, "{clip}");
    }
}

#[test]
fn a_name_of_several_clips_is_refused_and_a_whole_one_is_taken() {
    let all = ["left/jab.bvh", "right/jab.bvh", "jab.glb:a", "x/jab.glb:a"];
    assert_eq!(found(&all, "right/jab.bvh"), Ok(vec![1]));
    assert_eq!(found(&all, "jab.glb:a"), Ok(vec![2]));
    let several =
        "events for \"jab.bvh\", which may be any of the clips \"left/jab.bvh\", \"right/jab.bvh\"";
    assert_eq!(found(&all, "jab.bvh"), Err(several.into()));
}

#[test]
fn events_that_are_wrong() {
    for [event, expected] in cases(include_str!("refused/events.txt")) {
        assert_eq!(error_of(&event), expected);
    }
    let file = EventsFile::parse(br#"{"clips":[{"file":"x/c.bvh"}]}"#).unwrap();
    let error = refusal(file.resolve(&clips(), &skeleton()));
    let expected = "events for \"x/c.bvh\", but there is no such clip";
    assert_eq!(error, expected);
}

#[test]
fn an_attack_file_has_one_sphere_or_several() {
    let one = br#"{"attacks":[{"name":"jab","spheres":[{"t":0.5,"center":[0,1,2],"radius":0.1},{"t":0.8,"center":[0,1,0],"radius":0.1}]}]}"#;
    let file = AttackFile::parse(one).unwrap();
    assert_eq!(file.attacks[0].spheres().len(), 1);
    let center = file.attacks[0].spheres()[0].keys()[0].center;
    assert_eq!(center, Vec3::new(0.0, 1.0, 2.0));
    let two = br#"{"attacks":[{"spheres":[[{"t":0,"center":[0,1,2],"radius":0.1}],[{"t":0,"center":[0,1,2],"radius":0.1}]]}]}"#;
    let file = AttackFile::parse(two).unwrap();
    assert_eq!(file.attacks[0].spheres().len(), 2);
    let text = json!({ "attacks": [{ "spheres": file.attacks[0] }] }).to_string();
    assert_eq!(AttackFile::parse(text.as_bytes()).unwrap(), file);
}

#[test]
fn attacks_that_are_wrong() {
    for [spheres, expected] in cases(include_str!("refused/attacks.txt")) {
        let text = format!("{{\"attacks\":[{{\"spheres\":[\n{spheres}]}}]}}");
        assert_eq!(refusal(AttackFile::parse(text.as_bytes())), expected);
    }
    let none = refusal(AttackFile::parse(br#"{"attacks":[]}"#));
    assert_eq!(none, "the file holds no attack");
}

#[test]
fn a_byte_order_mark_does_not_matter() {
    let events = "\u{FEFF}{\"clips\":[]}";
    assert!(EventsFile::parse(events.as_bytes()).is_ok());
    let folder = folder(&[("events.json", events)]);
    let path = folder.path().join("events.json");
    assert_eq!(EventsFile::read(&path).unwrap(), EventsFile::default());
    let attacks =
        "\u{FEFF}{\"attacks\":[{\"spheres\":[[{\"t\":1,\"center\":[0,1,0],\"radius\":0.1}]]}]}";
    assert!(AttackFile::parse(attacks.as_bytes()).is_ok());
}

const BVH: &str =
    "HIERARCHY ROOT Hips\n{ OFFSET 0 0 0 CHANNELS 4 Xposition Yposition Zposition Yrotation
JOINT Head\n{ OFFSET 0 70 0 }\nJOINT Foot\n{ OFFSET 0 -100 0 } }
MOTION Frames: 2 Frame Time: 0.1\n0 100 0 0\n0 100 10 90\n";

/// A folder with these files.
fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    folder
}

fn read(folder: &tempfile::TempDir, paths: &[&str]) -> Result<sabaki_import::ClipSet, String> {
    let paths: Vec<PathBuf> = paths.iter().map(|path| folder.path().join(path)).collect();
    let base = format!("{}/", folder.path().display());
    let set = read_clips(&paths, None, &ReadOptions::default());
    set.map_err(|error| error.to_string().replace(&base, ""))
}

#[test]
fn a_folder_gives_its_files_by_name() {
    let longer = BVH.replace("0 70 0", "0 75 0");
    let one = BVH
        .replace("Frames: 2", "Frames: 1")
        .replace("0 100 10 90\n", "");
    let folder = folder(&[
        ("set/b.bvh", &longer),
        ("set/A.BVH", BVH),
        ("set/c.txt", ""),
        ("one.bvh", &one),
        ("two.bvh", &one),
    ]);
    let set = read(&folder, &["one.bvh", "set", "two.bvh"]).unwrap();
    let names: Vec<_> = set.clips.iter().map(Clip::name).collect();
    assert_eq!(names, ["one.bvh", "A.BVH", "b.bvh", "two.bvh"]);
    let head = set.skeleton.joint(JointId(1));
    assert_eq!(head.offset, Vec3::new(0.0, 0.7, 0.0));
    let [single, bones] = &set.warnings[..] else {
        panic!("{:?}", set.warnings);
    };
    assert_eq!(single, "one.bvh and 1 more: a single frame is no motion");
    assert!(bones.ends_with("bones differ by more than 1% from the first clip's: \"Head\""));
}

#[test]
fn sets_that_are_wrong() {
    let other = BVH.replace("Head", "Skull");
    let slow = BVH
        .replace("0.1", "3600")
        .replace("Frames: 2", "Frames: 12")
        + &"0 100 0 0\n".repeat(10);
    let folder = folder(&[
        ("a.bvh", BVH),
        ("more/a.bvh", BVH),
        ("other.bvh", &other),
        ("slow.bvh", &slow),
        ("bad.bvh", "HIERARCHY"),
        ("empty/readme", ""),
    ]);
    for [paths, expected] in cases(include_str!("refused/sets.txt")) {
        let paths: Vec<&str> = paths.split_whitespace().collect();
        assert_eq!(read(&folder, &paths).unwrap_err(), expected);
    }
}
