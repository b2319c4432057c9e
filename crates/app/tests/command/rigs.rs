//! The same captures on skeletons that other programs write: below a still root, a root that carries the path, an armature of scale 0.01 that
//! mirrors, and as FBX. All that a bake and its queries measure is the same within noise.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use glam::{EulerRot, Quat, Vec3};
use sabaki::anim::{Clip, ClipDesc, JointKind};
use sabaki_fixtures::captures::mocap;
use sabaki_fixtures::clips::{changed, joints_at};
use sabaki_fixtures::files::{below_root, glb, glb_parts};
use sabaki_import::{LoadedClip, ReadOptions, gltf, read_bvh, read_clip};
use serde_json::{Value, json};

use super::run::{command, ended};

/// A GLB file of a clip below a node of this scale, which the skeleton's own numbers undo.
fn below_scale(clip: &LoadedClip, scale: Vec3) -> Vec<u8> {
    let mirrors = scale.x < 0.0;
    let place = |place: Vec3| place / scale;
    let turned = |turn: Quat| match mirrors {
        true => Quat::from_xyzw(turn.x, -turn.y, -turn.z, turn.w),
        false => turn,
    };
    let skeleton = changed(&clip.skeleton, |joint| joint.offset = place(joint.offset));
    let desc = clip.clip.desc();
    let desc = ClipDesc {
        roots: desc.roots.iter().copied().map(place).collect(),
        rotations: desc.rotations.iter().copied().map(turned).collect(),
        ..desc
    };
    let scaled = Clip::new(&skeleton, desc).unwrap();
    let mut bytes = Vec::new();
    gltf::write(&mut bytes, &skeleton, &[scaled], &[]).unwrap();
    let (mut document, binary) = glb_parts(&bytes);
    let nodes = document["nodes"].as_array_mut().unwrap();
    nodes.push(json!({ "name": "Armature", "scale": scale.to_array(), "children": [0] }));
    let top = nodes.len() - 1;
    document["scenes"][0]["nodes"][0] = json!(top);
    glb(&document, &binary)
}

/// A clip as an FBX file in text form, in centimetres.
fn as_fbx(LoadedClip { skeleton, clip, .. }: &LoadedClip) -> String {
    const SECOND: f64 = 46_186_158_000.0;
    let (mut objects, mut links) = (String::new(), String::new());
    let desc = clip.desc();
    let time = |frame: usize| (frame as f64 * SECOND / desc.frame_rate).round() as i64;
    let frames = 0..clip.frames();
    let times: Vec<String> = frames
        .clone()
        .map(|frame| time(frame).to_string())
        .collect();
    let stop = time(clip.frames() - 1);
    let _ = write!(
        objects,
        "AnimationStack: 1, \"AnimStack::Take\", \"\" {{ Properties70: {{\nP: \"LocalStop\", \"KTime\", \"Time\", \"\",{stop}\nP: \"ReferenceStop\", \"KTime\", \"Time\", \"\",{stop}\n}} }}\nAnimationLayer: 2, \"AnimLayer::\", \"\" {{ }}\n"
    );
    links += "C: \"OO\",2,1\n";
    let mut add_curves = |id: usize, joint: usize, kind: &str, values: &dyn Fn(usize) -> Vec3| {
        let _ = write!(
            objects,
            "AnimationCurveNode: {id}, \"AnimCurveNode::{}\", \"\" {{ Properties70: {{\nP: \"d|X\", \"Number\", \"\", \"A\",0\nP: \"d|Y\", \"Number\", \"\", \"A\",0\nP: \"d|Z\", \"Number\", \"\", \"A\",0\n}} }}\n",
            &kind[..1]
        );
        let _ = write!(
            links,
            "C: \"OO\",{id},2\nC: \"OP\",{id},{joint}, \"Lcl {kind}\"\n"
        );
        for (axis, name) in ["X", "Y", "Z"].into_iter().enumerate() {
            let curve = id + 1 + axis;
            let keys: Vec<String> = frames
                .clone()
                .map(|frame| values(frame)[axis].to_string())
                .collect();
            let count = keys.len();
            let _ = write!(
                objects,
                "AnimationCurve: {curve}, \"AnimCurve::\", \"\" {{ Default: 0\nKeyVer: 4008\nKeyTime: *{count} {{ a: {} }}\nKeyValueFloat: *{count} {{ a: {} }}\nKeyAttrFlags: *1 {{ a: 4 }}\nKeyAttrDataFloat: *4 {{ a: 0,0,0,0 }}\nKeyAttrRefCount: *1 {{ a: {count} }}\n}}\n",
                times.join(","),
                keys.join(",")
            );
            let _ = writeln!(links, "C: \"OP\",{curve},{id}, \"d|{name}\"");
        }
    };
    let model = |joint: usize| 1000 + 100 * joint;
    for joint in 0..skeleton.len() {
        if joint == 0 {
            add_curves(model(joint) + 10, model(joint), "Translation", &|frame| {
                100.0 * desc.roots[frame]
            });
        }
        if skeleton.joints()[joint].kind == JointKind::Moving {
            add_curves(model(joint) + 20, model(joint), "Rotation", &|frame| {
                let (z, y, x) =
                    desc.rotations[frame * skeleton.len() + joint].to_euler(EulerRot::ZYX);
                Vec3::new(x.to_degrees(), y.to_degrees(), z.to_degrees())
            });
        }
    }
    for (index, joint) in skeleton.joints().iter().enumerate() {
        let [x, y, z] = (100.0 * joint.offset).to_array();
        let (id, bone) = (model(index), model(index) + 1);
        let _ = write!(
            objects,
            "Model: {id}, \"Model::{}\", \"LimbNode\" {{ Version: 232\nProperties70: {{ P: \"Lcl Translation\", \"Lcl Translation\", \"\", \"A\",{x},{y},{z} }}\n}}\nNodeAttribute: {bone}, \"NodeAttribute::\", \"LimbNode\" {{ TypeFlags: \"Skeleton\" }}\n",
            joint.name
        );
        let parent = joint.parent.map_or(0, |parent| model(parent.index()));
        let _ = write!(links, "C: \"OO\",{id},{parent}\nC: \"OO\",{bone},{id}\n");
    }
    const AXES: &str = r#"P: "UpAxis", "int", "Integer", "",1
P: "UpAxisSign", "int", "Integer", "",1
P: "FrontAxis", "int", "Integer", "",2
P: "FrontAxisSign", "int", "Integer", "",1
P: "CoordAxis", "int", "Integer", "",0
P: "CoordAxisSign", "int", "Integer", "",1
"#;
    format!(
        "; FBX 7.4.0 project file\nFBXHeaderExtension: {{ FBXHeaderVersion: 1003\nFBXVersion: 7400\n}}\nGlobalSettings: {{ Version: 1000\nProperties70: {{ {AXES}P: \"UnitScaleFactor\", \"double\", \"Number\", \"\",1\nP: \"TimeMode\", \"enum\", \"\", \"\",14\nP: \"CustomFrameRate\", \"double\", \"Number\", \"\",{}\n}}\n}}\nObjects: {{\n{objects}}}\nConnections: {{\n{links}}}\n",
        desc.frame_rate
    )
}

/// Parts of the names of the captures that are measured: what stands, walks, attacks by jabs, and evades.
const TAKEN: [&str; 6] = ["Stand", "Walk", "Jab", "SideStep", "Dodge", "Duck"];

/// Writes captures in another form to a folder, with their events.
fn write_set(folder: &Path, ending: &str, form: impl Fn(&Path) -> Vec<u8>) {
    fs::create_dir(folder).unwrap();
    let is_taken = |stem: &str| TAKEN.iter().any(|part| stem.contains(part));
    for entry in fs::read_dir(mocap("fight")).unwrap() {
        let file = entry.unwrap().path();
        let stem = file.file_stem().unwrap().to_str().unwrap();
        if file.extension().unwrap() == "bvh" && is_taken(stem) {
            fs::write(folder.join(format!("{stem}.{ending}")), form(&file)).unwrap();
        }
    }
    let events = fs::read_to_string(mocap("fight").join("events.json")).unwrap();
    let mut events: Value = serde_json::from_str(&events).unwrap();
    let clips = events["clips"].as_array_mut().unwrap();
    clips.retain(|clip| is_taken(clip["file"].as_str().unwrap()));
    let events = events
        .to_string()
        .replace(".bvh\"", &format!(".{ending}\""));
    fs::write(folder.join("events.json"), events).unwrap();
}

/// Joints of an exported motion, in the world and in metres, by their names: the parent's name, and the places frame by frame.
fn exported(path: &Path) -> Vec<(String, Option<String>, Vec<Vec3>)> {
    let (skeleton, clip) = read_bvh(path).unwrap().motion("", 0.01).unwrap();
    let named = skeleton.joints().iter().map(|joint| {
        let parent = joint
            .parent
            .map(|parent| skeleton.joint(parent).name.clone());
        (joint.name.clone(), parent, Vec::new())
    });
    let mut all: Vec<(String, Option<String>, Vec<Vec3>)> = named.collect();
    for frame in 0..clip.frames() {
        let joints = joints_at(&skeleton, &clip, frame);
        for (one, joint) in all.iter_mut().zip(&joints) {
            one.2.push(joint.translation);
        }
    }
    all
}

/// The figures that are compared, with the largest difference that is noise: a share of the value, and a number.
const FIGURES: [(&str, &str, f64, f64); 9] = [
    // One link of the walks lies at the threshold: clips that it links lose their ends, clips that are joined without it do not.
    ("bake", "/seconds_kept", 0.08, 0.0),
    ("bake", "/evasions", 0.0, 0.0),
    ("bake", "/scale", 0.0, 0.0),
    ("bake", "/transitions", 0.1, 0.0),
    // A tenth of the balls hits: of 300, two samples differ by this in one case of twenty.
    ("dodge", "/avoided", 0.0, 14.5),
    ("play", "/avoided/one", 0.0, 0.2),
    ("play", "/steer/path_error_m", 0.0, 0.03),
    ("play", "/steer/speed_error", 0.0, 0.03),
    ("play", "/pops_over_5mm", 0.0, 1.0),
];

/// Bakes and measures a set.
fn measured(folder: &Path, name: &str) -> Vec<f64> {
    let run = |line: &str| ended(command(folder, line)).json(0);
    let bake = run(&format!(
        "bake --clips {name} --events {name}/events.json --out {name}.sabaki --json"
    ));
    let first = fs::read_dir(folder.join(name))
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let first = first
        .filter(|path| path.extension().unwrap() != "json")
        .min()
        .unwrap();
    let read = run(&format!("inspect {} --json", first.display()));
    let dodge = run(&format!(
        "dodge {name}.sabaki --attacks 300 --seed 3 --json"
    ));
    let play = run(&format!("play {name}.sabaki --threats 10 --json"));
    let figure = |&(document, key, ..): &(&str, &str, f64, f64)| {
        let document = match (document, key) {
            (_, "/scale") => return read["stature"].as_f64().unwrap(),
            ("bake", _) => &bake,
            ("dodge", _) => &dodge,
            _ => &play,
        };
        document
            .pointer(key)
            .and_then(Value::as_f64)
            .unwrap_or_else(|| panic!("{key}"))
    };
    FIGURES.iter().map(figure).collect()
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn the_same_captures_on_other_rigs_give_the_same_figures() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let text = |file: &Path| fs::read_to_string(file).unwrap();
    let clip = |file: &Path| read_clip(file, &ReadOptions::default()).unwrap();
    let still = |file: &Path| below_root(&text(file), |_| [0.0; 6]).into_bytes();
    let path = |file: &Path| {
        let text = below_root(&text(file), |hips| [hips[0], 0.0, hips[2], 0.0, 0.0, 0.0]);
        text.into_bytes()
    };
    write_set(&folder.join("plain"), "bvh", |file| text(file).into_bytes());
    write_set(&folder.join("still"), "bvh", still);
    write_set(&folder.join("path"), "bvh", path);
    write_set(&folder.join("mirrored"), "glb", |file| {
        below_scale(&clip(file), Vec3::new(-0.01, 0.01, 0.01))
    });
    write_set(&folder.join("fbx"), "fbx", |file| {
        as_fbx(&clip(file)).into_bytes()
    });
    // Below a still root a set is the same to the bit, which the tests of the import hold.
    let names = ["plain", "path", "mirrored", "fbx"];
    let all: Vec<Vec<f64>> = names.iter().map(|name| measured(folder, name)).collect();
    let mut table = format!(
        "{:28}{}\n",
        "",
        names.map(|name| format!("{name:>10}")).concat()
    );
    let mut off = Vec::new();
    for (row, (document, key, share, noise)) in FIGURES.iter().enumerate() {
        let values = all.iter().map(|figures| format!("{:10.3}", figures[row]));
        let _ = writeln!(
            table,
            "{:28}{}",
            format!("{document} {key}"),
            values.collect::<String>()
        );
        for (name, figures) in names.iter().zip(&all) {
            if (figures[row] - all[0][row]).abs() > share * all[0][row] + noise + 1e-3 {
                off.push(format!("{name}: {document} {key}"));
            }
        }
    }
    println!("{table}");
    assert!(off.is_empty(), "{off:#?}");

    let bake = "bake --clips still --events still/events.json --out still.sabaki --json";
    ended(command(folder, bake)).json(0);
    let export = |name: &str| {
        let line = format!("dodge {name}.sabaki --attacks 3 --seed 3 --export {name}.out --json");
        ended(command(folder, &line));
        let file = |index: usize| folder.join(format!("{name}.out/attack_{index:04}.bvh"));
        [0, 1, 2].map(|index| exported(&file(index)))
    };
    let [plain, still, path] = ["plain", "still", "path"].map(export);
    for (plain, still) in plain.iter().zip(&still) {
        assert_eq!((still[0].0.as_str(), &still[0].1), ("Armature", &None));
        assert_eq!(
            (still[1].0.as_str(), still[1].1.as_deref()),
            ("Hips", Some("Armature"))
        );
        assert!(still[0].2.iter().all(|place| place.length() < 1e-6));
        assert_eq!(still.len(), plain.len() + 1);
        for (own, (name, parent, places)) in plain.iter().zip(&still[1..]) {
            assert!(own.0 == *name && (own.1 == *parent || name == "Hips"));
            for (a, b) in own.2.iter().zip(places) {
                assert!(a.distance(*b) < 1e-4, "{name}: {a} and {b}");
            }
        }
    }
    for path in &path {
        let pairs = path[0].2.iter().zip(&path[1].2);
        for (root, hips) in pairs {
            assert!(
                root.y.abs() < 1e-6 && root.with_y(hips.y).distance(*hips) < 1e-4,
                "{root} {hips}"
            );
        }
    }
}
