//! The same motion on skeletons that are written in other ways is the same set of clips, so that every bake of it is the same too.

use std::path::{Path, PathBuf};

use glam::{Quat, Vec3};
use sabaki::anim::{Clip, Joint, JointId, JointKind, Pose, Skeleton};
use sabaki::graph::{BuildReport, ClipSource, EdgeMotion, GraphError, GraphSettings, MotionGraph};
use sabaki::lod::{LevelSettings, Levels};
use sabaki::maps::{BakeSettings, Baker, Body};
use sabaki_fixtures::captures::mocap;
use sabaki_fixtures::clips::{self, clips_apart, evasion, joint, joints_of, most_apart};
use sabaki_fixtures::files::below_root;
use sabaki_fixtures::with;
use sabaki_import::{ClipSet, FileError, ReadOptions, bvh, read_bvh, read_clip, read_clips};

use super::common::{read, refusal, refused_file, write_glb, written};

/// A small file of this test.
fn case(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/rigs");
    folder.join(name)
}

/// The walking figure, and its file.
fn walking() -> (ClipSet, String) {
    let path = case("hips_root.bvh");
    (read(&path), std::fs::read_to_string(path).unwrap())
}

/// The file of the walking figure with other frames, made from its own.
fn with_frames(frames: impl Fn(Vec<&str>) -> Vec<String>) -> String {
    let (_, text) = walking();
    let lines: Vec<&str> = text.lines().collect();
    let (head, motion) = lines.split_at(lines.iter().position(|line| *line == "MOTION").unwrap());
    let frames = frames(motion[3..].to_vec());
    let count = format!("MOTION\nFrames: {}\n{}", frames.len(), motion[2]);
    [head.join("\n"), count, frames.join("\n")].join("\n")
}

fn numbers(line: &str) -> Vec<f64> {
    let words = line.split_whitespace();
    words.map(|word| word.parse().unwrap()).collect()
}

fn line(numbers: &[f64]) -> String {
    let words: Vec<String> = numbers.iter().map(|number| format!("{number:?}")).collect();
    words.join(" ")
}

/// Motion and skeleton are the same to the bit, whatever the files are called.
fn assert_same(a: &ClipSet, b: &ClipSet) {
    assert_eq!(a.scales, b.scales);
    assert_eq!(a.skeleton.joints(), b.skeleton.joints());
    for (a, b) in a.clips.iter().zip(&b.clips) {
        let unnamed = |clip: &Clip| {
            let mut desc = clip.desc();
            desc.name.clear();
            desc
        };
        assert!(unnamed(a) == unnamed(b), "{} and {}", a.name(), b.name());
    }
}

/// Largest distance between joints of one index in all frames, in metres.
fn apart(a: &ClipSet, b: &ClipSet) -> f32 {
    assert_eq!(a.clips.len(), b.clips.len());
    let clips = a.clips.iter().zip(&b.clips);
    let apart = clips.map(|(own, other)| clips_apart((&a.skeleton, own), (&b.skeleton, other)));
    apart.fold(0.0, f32::max)
}

#[test]
fn a_still_joint_above_the_hips_changes_nothing() {
    let (plain, _) = walking();
    let mut under = read(&case("reference_root.bvh"));
    assert_eq!(plain.scales[0].metres_per_unit, 0.01);
    // The place of the hips at rest is the only difference, and nothing reads it.
    let mut joints = under.skeleton.joints().to_vec();
    assert_eq!(joints[0].name, "Hips");
    assert!(joints[0].offset.distance(Vec3::Y * 0.92) < 1e-6);
    joints[0].offset = plain.skeleton.joint(JointId::ROOT).offset;
    under.skeleton = Skeleton::new(joints).unwrap();
    assert_same(&plain, &under);
    let only = read_clip(&case("reference_root.bvh"), &ReadOptions::default()).unwrap();
    let above: Vec<&str> = only.skeleton.file_joints().unwrap().above().collect();
    assert_eq!(above, ["Reference"]);
}

#[test]
fn bones_that_stand_in_the_frames_are_those_of_the_skeleton() {
    let (plain, _) = walking();
    let zero = read(&case("offsets_zero.bvh"));
    assert_eq!(zero.scales, plain.scales);
    let pairs = zero.skeleton.joints().iter().zip(plain.skeleton.joints());
    // The file does not say how long the bones without a joint at their end are.
    let moving = |(zero, _): &(&Joint, &Joint)| zero.kind == JointKind::Moving;
    for (zero, plain) in pairs.skip(1).filter(moving) {
        let away = zero.offset.distance(plain.offset);
        assert!(away < 1e-4, "{}: {away}", zero.name);
    }
    assert!(!zero.clips[0].moves_joints());
    let barest = Body::from_bones(&zero.skeleton).barest_bone(&zero.skeleton, &zero.clips);
    assert!(barest.unwrap().1 < 0.01, "{barest:?}");
    // Spheres that lie on other bones do not cover them.
    let short = clips::changed(&plain.skeleton, |joint| joint.offset *= 0.5);
    let short = Body::from_bones(&short);
    let barest = short.barest_bone(&plain.skeleton, &plain.clips);
    assert!(barest.unwrap().1 > 0.05, "{barest:?}");
}

#[test]
fn a_head_without_a_tip_has_a_sphere() {
    let plain = walking().0.skeleton;
    let joints = plain.joints().iter().cloned();
    let moving = joints.filter(|joint| joint.kind == JointKind::Moving);
    let names: Vec<&str> = moving
        .clone()
        .filter_map(|joint| plain.find(&joint.name))
        .map(|id| &plain.joint(id).name[..])
        .collect();
    let bare = moving.map(|joint| {
        let parent = joint.parent.map(|parent| &plain.joint(parent).name[..]);
        let parent = parent.map(|name| names.iter().position(|other| *other == name).unwrap());
        Joint {
            parent: parent.map(|at| JointId(at as u16)),
            ..joint
        }
    });
    let bare = Skeleton::new(bare.collect()).unwrap();
    let head = |skeleton: &Skeleton| {
        let id = skeleton.find("Head").unwrap();
        let spheres = Body::from_bones(skeleton).spheres.into_iter();
        let own = spheres.filter(|sphere| sphere.joint == id);
        own.max_by(|a, b| a.offset.length().total_cmp(&b.offset.length()))
            .unwrap()
    };
    let (wanted, found) = (head(&plain), head(&bare));
    assert!(wanted.offset.length() > 0.03, "{wanted:?}");
    let away = found.offset.distance(wanted.offset);
    let wider = (found.radius - wanted.radius).abs();
    assert!(away < 0.05 && wider < 0.02, "{found:?} {wanted:?}");
}

#[test]
fn figures_stand_on_the_ground() {
    let folder = tempfile::tempdir().unwrap();
    let (plain, text) = walking();
    assert_eq!(plain.warnings, Vec::<String>::new());
    // As programs write it whose root stays at the origin.
    let sunk = below_root(&text, |_| [0.0, 92.0, 0.0, 0.0, 0.0, 0.0]);
    let sunk = sunk.replace("\n0.0 92.0 0.0 ", "\n0.0 0.0 0.0 ");
    let file = written(folder.path(), "sunk.bvh", sunk);
    let sunk = read(&file);
    let said = &sunk.warnings[0];
    assert!(said.contains("m, which is taken for the ground"), "{said}");
    for frame in 0..plain.clips[0].frames() {
        let raised = sunk.clips[0].root(frame).y - plain.clips[0].root(frame).y;
        assert!(raised.abs() < 0.05, "{frame}: {raised}");
    }
    let alone = read_clip(&file, &ReadOptions::default()).unwrap();
    assert_eq!(alone.clip.root(0), sunk.clips[0].root(0));
}

#[test]
fn clips_far_from_the_origin_are_put_there() {
    let folder = tempfile::tempdir().unwrap();
    let (plain, _) = walking();
    let first = plain.clips[0].root(0).with_y(0.0);
    let moved = |name: &str, away: &dyn Fn(usize) -> [f64; 2]| {
        let text = with_frames(|frames| {
            let rows = frames.into_iter().enumerate().map(|(frame, row)| {
                let (mut values, [x, z]) = (numbers(row), away(frame));
                (values[0], values[2]) = (values[0] + x, values[2] + z);
                line(&values)
            });
            rows.collect()
        });
        read(&written(folder.path(), name, text))
    };
    let torn = moved("torn.bvh", &|frame| {
        [0.0, if frame == 9 { 80.0 } else { 0.0 }]
    });
    let said = &torn.warnings[0];
    let words = ["torn.bvh: the body jumps by 0.8", "to frame 9"];
    assert!(words.iter().all(|word| said.contains(word)), "{said}");
    let far = moved("far.bvh", &|_| [50_000.0, -30_000.0]);
    let said = &far.warnings[0];
    assert!(
        said.contains("50 m from the origin") && said.contains("far.bvh"),
        "{said}"
    );
    for frame in 0..plain.clips[0].frames() {
        let away = far.clips[0]
            .root(frame)
            .distance(plain.clips[0].root(frame) - first);
        assert!(away < 2e-4, "{frame}: {away}");
    }
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn a_root_above_the_hips_of_captures_changes_nothing() {
    let folder = mocap("fight");
    let read = |folder: &Path| {
        let events = folder.join("events.json");
        let folder = [folder.to_owned()];
        read_clips(&folder, Some(&events), &ReadOptions::default()).unwrap()
    };
    let plain = read(&folder);
    let still = |_: &[f64]| [0.0; 6];
    let path = |values: &[f64]| [values[0], 0.0, values[2], 0.0, 0.0, 0.0];
    for (name, above) in [("still", &still as &dyn Fn(&[f64]) -> _), ("path", &path)] {
        let other = tempfile::tempdir().unwrap();
        for entry in std::fs::read_dir(&folder).unwrap() {
            let file = entry.unwrap().path();
            let mut text = std::fs::read_to_string(&file).unwrap();
            if file.extension().unwrap() == "bvh" {
                text = below_root(&text, above);
            }
            std::fs::write(other.path().join(file.file_name().unwrap()), text).unwrap();
        }
        let under = read(other.path());
        assert_eq!(under.warnings, Vec::<String>::new());
        assert_eq!(under.events, plain.events);
        match name {
            "still" => assert_same(&plain, &under),
            _ => assert!(apart(&plain, &under) < 1e-5),
        }
    }
}

#[test]
fn joints_above_the_hips_come_back_as_they_were() {
    let folder = tempfile::tempdir().unwrap();
    let (_, text) = walking();
    type Above = fn(&[f64]) -> [f64; 6];
    let still: Above = |_| [0.0; 6];
    let path: Above = |values| [values[0], 0.0, values[2], 0.0, 0.0, 0.0];
    let whole: Above = |values| [values[0], values[1], values[2], 0.0, 0.0, 0.0];
    let forms = [
        ("still", still, false),
        ("path", path, true),
        ("whole", whole, true),
    ];
    for (name, above, moves) in forms {
        let file = written(
            folder.path(),
            &format!("{name}.bvh"),
            below_root(&text, above),
        );
        let set = read(&file);
        let stored = serde_json::to_string(&set.skeleton).unwrap();
        let skeleton: Skeleton = serde_json::from_str(&stored).unwrap();
        assert_eq!(skeleton, set.skeleton);
        let of_file = skeleton.file_joints().unwrap();
        assert_eq!(of_file.carrier.is_some(), moves, "{name}");
        let whole = skeleton.whole().unwrap();
        let raw = read_bvh(&file).unwrap();
        let in_file = raw.skeleton(0.01).unwrap();
        assert_eq!(whole.skeleton.differences(&in_file), Vec::<String>::new());
        // Written files have them too, and are read as the same set.
        let mut bytes = Vec::new();
        bvh::write(&mut bytes, &skeleton, &set.clips[0], 0.01).unwrap();
        let again = written(folder.path(), &format!("written_{name}.bvh"), bytes);
        assert_eq!(read_bvh(&again).unwrap().joints.len(), in_file.len());
        assert!(apart(&set, &read(&again)) < 1e-4, "{name}");
        let again = format!("written_{name}.glb");
        let again = read(&write_glb(
            folder.path(),
            &again,
            &skeleton,
            &set.clips,
            &[],
        ));
        let of_file = again.skeleton.file_joints().unwrap();
        assert!(of_file.above().eq(["Armature"]));
        assert_eq!(of_file.carrier.is_some(), moves);
        assert!(apart(&set, &again) < 1e-4, "{name}");
        let (mut pose, mut places) = (Pose::default(), Vec::new());
        let mut back = Pose::default();
        for frame in 0..raw.frames() {
            raw.pose(frame, 0.01, &mut pose);
            let original = joints_of(&in_file, &pose);
            set.clips[0].pose(frame, &mut pose);
            whole.places(&joints_of(&set.skeleton, &pose), &mut places);
            assert!(most_apart(&original, &places) < 1e-4, "{name} {frame}");
            whole.pose(&pose, &mut back);
            let again = joints_of(&whole.skeleton, &back);
            assert!(most_apart(&original, &again) < 1e-4, "{name} {frame}");
        }
    }
}

/// The walking figure with every length times a factor.
fn changed(scale: f64) -> String {
    let frames = with_frames(|frames| {
        let scaled = frames.into_iter().map(|row| {
            let mut values = numbers(row);
            values[..3].iter_mut().for_each(|value| *value *= scale);
            line(&values)
        });
        scaled.collect()
    });
    let rows = frames.lines().map(|row| match row.split_once("OFFSET ") {
        Some((before, offset)) => {
            let offset = numbers(offset).into_iter().map(|value| value * scale);
            format!("{before}OFFSET {}", line(&offset.collect::<Vec<_>>()))
        }
        None => row.to_owned(),
    });
    rows.collect::<Vec<_>>().join("\n")
}

#[test]
fn files_of_one_skeleton_in_two_units_are_refused_with_both_names() {
    let folder = tempfile::tempdir().unwrap();
    let paths = [("a.bvh", 1.0), ("b.bvh", 1.05), ("metres.bvh", 0.01)];
    let paths = paths.map(|(name, scale)| written(folder.path(), name, changed(scale)));
    let two = read_clips(&paths[..2], None, &ReadOptions::default()).unwrap();
    assert!(two.scales.iter().all(|scale| scale.metres_per_unit == 0.01));
    let (path, error) = refused_file(read_clips(&paths, None, &ReadOptions::default()));
    assert_eq!(path, paths[2]);
    let is_of_both = matches!(&error, FileError::UnitDiffers { first, .. } if *first == paths[0]);
    assert!(is_of_both, "{error}");
}

/// Hands and feet.
const ENDS: [&str; 4] = ["LeftHand", "RightHand", "LeftFoot", "RightFoot"];

/// The names of a file's joints replaced by numbers.
fn nameless(file: &str) -> (String, Vec<String>) {
    let text = std::fs::read_to_string(case(file)).unwrap();
    let mut names = Vec::new();
    let lines = text.lines().map(|line| {
        let mut words = line.split_whitespace();
        match (words.next(), words.next()) {
            (Some(kind @ ("ROOT" | "JOINT")), Some(name)) => {
                names.push(name.to_owned());
                format!("{kind} j{}", names.len() - 1)
            }
            _ => line.to_owned(),
        }
    });
    let text = lines.collect::<Vec<_>>().join("\n");
    (text, names)
}

#[test]
fn limbs_and_sides_are_found_without_names() {
    let folder = tempfile::tempdir().unwrap();
    for file in ["hips_root.bvh", "reference_root.bvh"] {
        let (text, names) = nameless(file);
        let set = read(&written(folder.path(), "nameless.bvh", text));
        let named = |joint: JointId| {
            let number = &set.skeleton.joint(joint).name[1..];
            names[number.parse::<usize>().unwrap()].as_str()
        };
        assert_eq!(named(JointId::ROOT), "Hips", "{}", set.figure);
        let ends = set.skeleton.ends().unwrap().map(named);
        assert_eq!(ends, ENDS, "{}", set.figure);
        // They are kept in files.
        let stored = serde_json::to_string(&set.skeleton).unwrap();
        let again: Skeleton = serde_json::from_str(&stored).unwrap();
        assert_eq!(again, set.skeleton);
        let hip = set.skeleton.ids().find(|&id| named(id) == "LeftUpLeg");
        let other = set.skeleton.mirror(hip.unwrap());
        assert_eq!(other.map(named), Some("RightUpLeg"));
        assert!(apart(&walking().0, &set) < 1e-6);
    }
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn people_of_gltf_face_where_they_walk() {
    let set = read(&mocap("gltf/CesiumMan.glb"));
    let ends = set.skeleton.ends().unwrap();
    let sides = ends.map(|end| set.skeleton.joint(end).name.contains("_L_"));
    assert_eq!(sides, [true, false, true, false], "{}", set.figure);
}

#[test]
fn a_file_of_joints_overrides_what_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let (text, names) = nameless("reference_root.bvh");
    let clip = written(folder.path(), "nameless.bvh", text);
    let own = |name: &str| format!("j{}", names.iter().position(|own| own == name).unwrap());
    let mut set = read(&clip);
    let take = |set: &mut ClipSet, root: Option<&str>, ends: [&str; 4]| {
        let [left_hand, right_hand, left_foot, right_foot] = ends;
        let text = serde_json::json!({
            "root": root, "left_hand": left_hand, "right_hand": right_hand, "left_foot": left_foot, "right_foot": right_foot
        });
        set.take_joints(&written(folder.path(), "joints.json", text.to_string()))
    };
    let lower = ["LeftForeArm", "RightForeArm", "LeftLeg", "RightLeg"].map(own);
    take(&mut set, None, lower.each_ref().map(|name| &name[..])).unwrap();
    let ends = set.skeleton.ends().unwrap();
    assert_eq!(set.skeleton.joint(ends[0]).name, own("LeftForeArm"));
    // A root above the hips, and the hips again.
    let ends = ENDS.map(own);
    for root in ["Reference", "Hips"] {
        let ends = ends.each_ref().map(|name| &name[..]);
        take(&mut set, Some(&own(root)), ends).unwrap();
        assert_eq!(set.skeleton.joint(JointId::ROOT).name, own(root));
        assert_eq!(set.skeleton.file_joints().is_some(), root == "Hips");
    }
    assert!(apart(&walking().0, &set) < 1e-5);
    let refused = refusal(take(&mut read(&clip), None, ["x", "y", "z", "w"]));
    assert!(refused.contains("no joint \"x\""), "{refused}");
}

/// The loop, and a part of a walk that leans far forward, begins and ends at speed, and is near nothing.
fn library(folder: &Path) -> ClipSet {
    let text = with_frames(|frames| {
        let leaning = frames[30..50].iter().map(|row| {
            let mut values = numbers(row);
            values[4] += 50.0;
            line(&values)
        });
        leaning.collect()
    });
    let path = written(folder, "short.bvh", text);
    let paths = [case("loop_one_cycle.bvh"), path];
    read_clips(&paths, None, &ReadOptions::default()).unwrap()
}

fn built(
    set: &ClipSet,
    settings: &GraphSettings,
) -> Result<(MotionGraph, BuildReport), GraphError> {
    let source = ClipSource {
        skeleton: &set.skeleton,
        clips: &set.clips,
        events: &set.events,
    };
    sabaki::graph::build(source, settings)
}

#[test]
fn a_loop_joins_itself_and_nothing_is_lost() {
    let settings = GraphSettings::default();
    let (graph, report) = built(&read(&case("loop_one_cycle.bvh")), &settings).unwrap();
    graph.validate().unwrap();
    let kept = graph.seconds_kept();
    assert!((kept - 1.2).abs() < 0.04, "{kept}");
    assert!(report.joined[0].is_loop && report.dropped.clips.is_empty());
    // The seam is exact: the pose after the last frame is the first one.
    let seam = graph.edges().iter().find_map(|edge| match edge.motion {
        EdgeMotion::Transition { distance, .. } => Some((edge.frames, distance)),
        EdgeMotion::Clip => None,
    });
    let (frames, distance) = seam.unwrap();
    let is_exact = frames == 1 && distance < 1e-3;
    assert!(is_exact, "{frames} frames, {distance} m");

    let folder = tempfile::tempdir().unwrap();
    let mut set = library(folder.path());
    // An event from the first frame to the last has no frames before it to blend in.
    set.events = vec![evasion(1, 0.0, set.clips[1].duration())];
    let (graph, report) = built(&set, &settings).unwrap();
    graph.validate().unwrap();
    assert_eq!(report.dropped.clips, Vec::<String>::new());
    assert_eq!(graph.events().len(), 1, "{:?}", report.links.unlinked);
    let told = graph.describe_event(&graph.events()[0]);
    assert!(told.starts_with("short.bvh 0.00-0."), "{told}");
    let kept = graph.seconds_kept();
    assert!(kept > 1.1 + 0.55, "{kept}");
    let mut limited = settings;
    limited.farthest_join = Some(1e-3);
    set.events.clear();
    let (_, report) = built(&set, &limited).unwrap();
    assert_eq!(report.dropped.clips, ["short.bvh"]);
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn no_clip_of_captures_is_lost() {
    let folder = mocap("fight");
    let sets: [(&[&str], _); 2] = [
        // The walk alone has transitions, but the stand is a loop that lasts longer.
        (&["A1_Stand", "B3_Walk"], 2),
        // Only the end of the first clip is near the others.
        (&["D2_WalkToReady", "D16_SwitchStanceMore", "E8_Bounce"], 1),
    ];
    for (names, joined) in sets {
        let paths = names
            .iter()
            .map(|name| folder.join(format!("Male2_{name}.bvh")));
        let paths: Vec<PathBuf> = paths.collect();
        let set = read_clips(&paths, None, &ReadOptions::default()).unwrap();
        let (graph, report) = built(&set, &GraphSettings::default()).unwrap();
        graph.validate().unwrap();
        assert_eq!(report.joined.len(), joined, "{:?}", report.joined);
        let most = report.dropped.parts.iter();
        let most = most.map(|part| part.start + part.end).fold(0.0, f64::max);
        assert_eq!(report.dropped.clips, Vec::<String>::new());
        assert!(most < 1.2, "{:?}", report.dropped);
    }
}

#[test]
fn frames_of_rest_are_left_out_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let text = with_frames(|frames| {
        let values = frames[0].split_whitespace().count();
        let rest = format!("0 92 0{}", " 0".repeat(values - 3));
        let own = frames.into_iter().map(str::to_owned);
        let rest = |frames| std::iter::repeat_n(rest.clone(), frames);
        rest(2).chain(own).chain(rest(3)).collect()
    });
    let path = written(folder.path(), "rest.bvh", text);
    let text = r#"{"clips": [{"file": "rest.bvh", "events": [{"kind": "evasion", "start": 1.0, "end": 2.0}]}]}"#;
    let events = written(folder.path(), "events.json", text);
    let set = read_clips(&[path], Some(&events), &ReadOptions::default()).unwrap();
    assert_eq!(set.warnings.len(), 1, "{:?}", set.warnings);
    let said = &set.warnings[0];
    assert!(
        said.contains("2 frames at the start and 3 at the end"),
        "{said}"
    );
    assert!(apart(&walking().0, &set) < 1e-6);
    assert!((set.events[0].start - (1.0 - 2.0 / 30.0)).abs() < 1e-4);
}

#[test]
fn of_two_figures_the_first_is_the_body() {
    let folder = tempfile::tempdir().unwrap();
    let (plain, _) = walking();
    let count = plain.skeleton.len();
    let mut joints = vec![joint("Scene", None, Vec3::ZERO)];
    for (first, before) in [(1, ""), (1 + count as u16, "Other")] {
        let below = |parent: JointId| JointId(parent.0 + first);
        joints.extend(plain.skeleton.joints().iter().map(|joint| Joint {
            name: format!("{before}{}", joint.name),
            parent: Some(joint.parent.map_or(JointId::ROOT, below)),
            ..joint.clone()
        }));
    }
    let skeleton = Skeleton::new(joints).unwrap();
    let mut desc = plain.clips[0].desc();
    let still = desc.rotations[..count].to_vec();
    let rotations = desc.rotations.chunks_exact(count);
    desc.rotations = rotations
        .flat_map(|own| [&[Quat::IDENTITY], own, &still[..]].concat())
        .collect();
    for root in &mut desc.roots {
        let places = skeleton.joints().iter().map(|joint| joint.offset);
        let first = desc.translations.len();
        desc.translations.extend(places);
        desc.translations[first + 1] = *root;
        *root = Vec3::ZERO;
    }
    let clip = Clip::new(&skeleton, desc).unwrap();
    let set = read(&write_glb(
        folder.path(),
        "two.glb",
        &skeleton,
        &[clip],
        &[],
    ));
    let said = "root Hips (with the motion of Scene); hands LeftHand, RightHand;";
    assert!(set.figure.starts_with(said), "{}", set.figure);
    let (said, warning) = (
        "joints beside the body do not move: \"OtherHips\"",
        &set.warnings[0],
    );
    assert!(warning.contains(said), "{warning}");
    assert!(apart(&plain, &set) < 1e-4);
}

#[test]
fn frames_in_which_the_figure_has_no_size_are_left_out_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let (plain, _) = walking();
    let mut desc = plain.clips[0].desc();
    let whole = 5..plain.clips[0].frames() - 3;
    for (frame, root) in desc.roots.iter().enumerate() {
        let size = if whole.contains(&frame) { 1.0 } else { 0.01 };
        let offsets = plain.skeleton.joints().iter().skip(1);
        desc.translations.push(*root);
        desc.translations
            .extend(offsets.map(|joint| size * joint.offset));
    }
    let clip = Clip::new(&plain.skeleton, desc).unwrap();
    let path = write_glb(folder.path(), "appears.glb", &plain.skeleton, &[clip], &[]);
    let set = read(&path);
    let said = &set.warnings[0];
    assert!(
        said.contains("5 frames at the start and 3 at the end"),
        "{said}"
    );
    assert_eq!(set.clips[0].frames(), whole.len());
    assert!(!set.clips[0].moves_joints());
    let (first, wanted) = (set.clips[0].root(0), plain.clips[0].root(whole.start));
    assert!(first.distance(wanted) < 1e-4);
}

/// The walking figure with fingers, a sword and a cape that turn by an angle from frame to frame. A part of it counts as an evasion.
fn with_details(angle: f32) -> ClipSet {
    let (mut set, _) = walking();
    let mut joints = set.skeleton.joints().to_vec();
    let body = joints.len();
    let mut add = |name: &str, parent: &str, offset: Vec3| {
        let parent = joints.iter().position(|joint| joint.name == parent);
        joints.push(joint(name, parent.map(|parent| parent as u16), offset));
    };
    for hand in ["LeftHand", "RightHand"] {
        for finger in 0..3 {
            let name = format!("{hand}Finger{finger}");
            add(&name, hand, Vec3::new(0.02 * finger as f32, -0.08, 0.0));
            add(&format!("{name}Tip"), &name, Vec3::new(0.0, -0.05, 0.0));
        }
    }
    add("sword_r", "RightHand", Vec3::Z * 0.1);
    add("blade_r", "sword_r", Vec3::Z * 0.9);
    add("cape_01", "Spine", Vec3::Z * -0.1);
    add("tail_of_it", "cape_01", Vec3::Y * -0.7);
    // Names that tell nothing: what hangs on the hips is loose, and a long bone in a hand is a weapon.
    add("loose", "Hips", Vec3::Z * -0.2);
    add("looser", "loose", Vec3::Y * -0.6);
    add("item", "LeftHand", Vec3::Z * 0.1);
    add("item_tip", "item", Vec3::Z * 0.9);
    set.skeleton = Skeleton::new(joints).unwrap();
    let count = set.skeleton.len();
    for clip in &mut set.clips {
        let mut desc = clip.desc();
        let frames = desc.rotations.chunks_exact(body).enumerate();
        let frames = frames.flat_map(|(frame, own)| {
            let turn = Quat::from_rotation_x(angle * frame as f32);
            [own, &vec![turn; count - body]].concat()
        });
        desc.rotations = frames.collect();
        *clip = Clip::new(&set.skeleton, desc).unwrap();
    }
    let seconds = set.clips[0].duration();
    set.events = vec![evasion(0, 0.4 * seconds, 0.6 * seconds)];
    set
}

#[test]
fn fingers_and_carried_things_decide_nothing() {
    let settings = with(|s: &mut GraphSettings| s.compression = None);
    let [still, wild] = [0.0, 1.3].map(with_details);
    let [a, b] = [&still, &wild].map(|set| built(set, &settings).unwrap().0);
    assert_eq!(a.nodes(), b.nodes());
    let ends = |graph: &MotionGraph| -> Vec<_> {
        let edges = graph.edges().iter();
        edges
            .map(|edge| (edge.from, edge.to, edge.frames))
            .collect()
    };
    assert_eq!(ends(&a), ends(&b));
    // Limits: those of the body are the same, and the others have none.
    let limits = |graph: MotionGraph| {
        let baker = Baker::new(graph, BakeSettings::default()).unwrap();
        baker.finish_on_cpu().unwrap().entry_joint_speeds().to_vec()
    };
    let [a, b] = [a, b].map(limits);
    assert_eq!(a, b);
    assert_eq!(a.len(), wild.skeleton.len());
    let details = sabaki::anim::details(&wild.skeleton);
    let mut limits = a.iter().zip(&details);
    assert!(limits.all(|(limit, is_detail)| limit.is_infinite() == *is_detail));
    assert!(details[wild.skeleton.find("tail_of_it").unwrap().index()]);
    // The body has no sphere on sword and cape, and is not higher for them.
    let body = Body::from_bones(&wild.skeleton);
    let name = |joint: JointId| wild.skeleton.joint(joint).name.as_str();
    let on = |part: &str| {
        let mut spheres = body.spheres.iter();
        spheres.any(|sphere| name(sphere.joint).starts_with(part))
    };
    assert!(on("LeftHand"));
    for part in ["sword", "blade", "cape", "tail", "loose", "item_tip"] {
        assert!(!on(part), "{part}");
    }
    let plain = Body::from_bones(&walking().0.skeleton);
    let most = |body: &Body| {
        let radii = body.spheres.iter().map(|sphere| sphere.radius);
        radii.fold(0.0, f32::max)
    };
    assert_eq!(most(&body), most(&plain));
    // Levels: the order of the body's joints is the same, and the hands' fingers go before the body's joints do.
    let order = |set: &ClipSet| -> Vec<JointId> {
        let levels = Levels::build(&set.skeleton, &set.clips, &LevelSettings::default()).unwrap();
        levels
            .levels
            .iter()
            .filter_map(|level| level.removed)
            .collect()
    };
    let [a, b] = [&still, &wild].map(order);
    assert_eq!(a, b);
    let count = details.iter().filter(|is_detail| **is_detail).count();
    assert!(a[..count].iter().all(|joint| details[joint.index()]));
    assert!(!a.contains(&wild.skeleton.find("LeftHand").unwrap()));
}
