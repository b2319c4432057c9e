//! Skinned animations in glTF are read correctly, and written files are read back unchanged.

use base64::Engine;
use glam::{Quat, Vec3};
use sabaki::anim::{Clip, JointKind, Pose, Skeleton};
use sabaki_fixtures::captures::mocap;
use sabaki_fixtures::clips::joints_at;
use sabaki_fixtures::lod::random_case;
use sabaki_fixtures::random::Random;
use sabaki_fixtures::with;
use sabaki_import::gltf::{self, GltfFile};
use sabaki_import::{ReadOptions, ScaleSource, read_clip, read_clips, read_motions};
use serde_json::{Value, json};

use super::common::{bytes_of, read, refusal, written};

fn parse(bytes: &[u8]) -> GltfFile {
    GltfFile::parse(bytes, |file| panic!("{} is not asked for", file.display())).unwrap()
}

#[test]
fn random_motions_come_back() {
    for seed in 0..60 {
        let (skeleton, clip) = random_case(&mut Random::new(seed));
        let mut bytes = Vec::new();
        gltf::write(&mut bytes, &skeleton, std::slice::from_ref(&clip), &[]).unwrap();
        let file = parse(&bytes);
        let found = &file.skeleton;
        // The file keeps the tree; the order is that of a walk through it, and end sites are known by their names.
        assert_eq!(found.len(), skeleton.len());
        assert_eq!(file.animations.len(), 1);
        let read = &file.animations[0];
        assert_eq!(read.name, clip.name());
        assert_eq!(read.clip.frames(), clip.frames());
        for frame in 0..clip.frames() {
            let joints = joints_at(&skeleton, &clip, frame);
            let others = joints_at(found, &read.clip, frame);
            for id in skeleton.ids() {
                let twin = found.find(&skeleton.joint(id).name).unwrap();
                let (a, b) = (joints[id.index()], others[twin.index()]);
                assert!(a.translation.distance(b.translation) < 1e-4, "seed {seed}");
                assert!(a.rotation.dot(b.rotation).abs() > 1.0 - 1e-5, "seed {seed}");
            }
        }
    }
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn the_samples_are_read_as_they_are() {
    // The fox has two joints above its hips, of which nothing else hangs.
    let samples = [("CesiumMan.glb", 19, 1, 49), ("Fox.glb", 22, 3, 83)];
    for (name, joints, animations, frames) in samples {
        let path = mocap("gltf").join(name);
        let motions = read_motions(&path, &ReadOptions::default()).unwrap();
        assert_eq!(motions.len(), animations);
        let first = &motions[0];
        assert_eq!(first.skeleton.len(), joints);
        assert_eq!(first.clip.frames(), frames);
        assert!((first.clip.frame_rate() - 24.0).abs() < 1e-3);
        let scale = first.scale.found;
        // The fox's file is in centimetres.
        let is_in_metres = name != "Fox.glb";
        assert_eq!(scale == ScaleSource::Format, is_in_metres, "{scale:?}");
        if animations == 1 {
            assert_eq!(first.clip.name(), "CesiumMan.glb");
            assert_eq!(read_clip(&path, &ReadOptions::default()).unwrap(), *first);
            let mut pose = Pose::default();
            first.clip.pose(0, &mut pose);
            let stature = sabaki_import::stature(&first.skeleton, &pose);
            assert!((1.2..1.9).contains(&stature), "{stature} m");
        } else {
            let names: Vec<&str> = motions.iter().map(|motion| motion.clip.name()).collect();
            assert_eq!(names, ["Fox.glb:Survey", "Fox.glb:Walk", "Fox.glb:Run"]);
            let error = refusal(read_clip(&path, &ReadOptions::default()));
            assert!(error.ends_with("it holds several motions: \"Fox.glb:Survey\", \"Fox.glb:Walk\", \"Fox.glb:Run\""), "{error}");
            let options = with(|s: &mut ReadOptions| s.scale = Some(0.01));
            let set = read_clips(&[path], None, &options).unwrap();
            assert_eq!(set.clips.len(), 3);
            let scaled = set.skeleton.joints()[5].offset;
            let expected = first.skeleton.joints()[5].offset;
            assert!(scaled.distance(expected) < 1e-6);
        }
    }
}

/// A buffer, and a document that has it in itself.
#[derive(Default)]
pub(crate) struct Builder {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Builder {
    fn view(&mut self, bytes: &[u8]) -> usize {
        self.views.push(
            json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() }),
        );
        self.bytes.extend(bytes);
        self.views.len() - 1
    }

    fn add(&mut self, bytes: &[u8], mut accessor: Value) -> usize {
        accessor["bufferView"] = json!(self.view(bytes));
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    pub(crate) fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "VEC3" => 3,
            _ => 4,
        };
        let count = values.len() / width;
        let accessor = json!({ "componentType": 5126, "count": count, "type": kind });
        self.add(&bytes_of(values), accessor)
    }

    /// Adds an accessor of three places, the first and the last of which are replaced.
    pub(crate) fn sparse(&mut self, mut places: Value, component: u32, indices: &[u8]) -> usize {
        let own = bytes_of(&[0.0, 7.0, 0.0, 0.0, 9.0, 0.0]);
        places["sparse"] = json!({
            "count": 2,
            "indices": { "bufferView": self.view(indices), "componentType": component },
            "values": { "bufferView": self.view(&own) },
        });
        self.accessors.push(places);
        self.accessors.len() - 1
    }

    /// Root and one child a metre above it, the child moved by one channel.
    pub(crate) fn document(
        &self,
        path: &str,
        interpolation: &str,
        times: usize,
        values: usize,
    ) -> Value {
        let nodes = json!([
            { "name": "root", "children": [1], "translation": [0, 1, 0] },
            { "name": "arm", "translation": [0, 1, 0] },
        ]);
        let animation = json!({
            "name": "move",
            "samplers": [{ "input": times, "output": values, "interpolation": interpolation }],
            "channels": [{ "sampler": 0, "target": { "node": 1, "path": path } }],
        });
        let mut document = self.animated(nodes, vec![animation]);
        document["skins"] = json!([{ "joints": [0, 1] }]);
        document
    }

    pub(crate) fn animated(&self, nodes: Value, animations: Vec<Value>) -> Value {
        let text = base64::engine::general_purpose::STANDARD.encode(&self.bytes);
        json!({
            "asset": { "version": "2.0" },
            "nodes": nodes,
            "animations": animations,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{ "byteLength": self.bytes.len(), "uri": format!("data:application/octet-stream;base64,{text}") }],
        })
    }
}

fn clip_of(document: &Value) -> (Skeleton, Clip) {
    let file = parse(document.to_string().as_bytes());
    (file.skeleton.clone(), file.animations[0].clip.clone())
}

#[test]
fn steps_hold_and_splines_follow_their_tangents() {
    let mut builder = Builder::default();
    // Keys on a grid of a tenth of a second, some of them missing.
    let times = builder.floats("SCALAR", &[0.0, 0.1, 0.4]);
    let places = builder.floats("VEC3", &[0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 4.0, 0.0]);
    let (_, clip) = clip_of(&builder.document("translation", "STEP", times, places));
    assert_eq!(clip.frames(), 5);
    let heights = |clip: &Clip| -> Vec<f32> {
        let places = clip.desc().translations;
        places.chunks(2).map(|pair| pair[1].y).collect()
    };
    assert_eq!(heights(&clip), [1.0, 2.0, 2.0, 2.0, 4.0]);
    let (_, clip) = clip_of(&builder.document("translation", "LINEAR", times, places));
    let expected = [1.0, 2.0, 2.0 + 2.0 / 3.0, 2.0 + 4.0 / 3.0, 4.0];
    for (found, expected) in heights(&clip).iter().zip(expected) {
        assert!((found - expected).abs() < 1e-5);
    }
    // Tangent, value, tangent: a parabola y = 1 + 10 t + 5 t², whose spline is exact.
    let height = |t: f32| 1.0 + 10.0 * t + 5.0 * t * t;
    let key = |t: f32| {
        let tangent = 10.0 + 10.0 * t;
        [tangent, height(t), tangent]
            .map(|y| [0.0, y, 0.0])
            .concat()
    };
    let splines: Vec<f32> = [0.0, 0.1, 0.4].into_iter().flat_map(key).collect();
    let splines = builder.floats("VEC3", &splines);
    let (_, clip) = clip_of(&builder.document("translation", "CUBICSPLINE", times, splines));
    for (frame, found) in heights(&clip).iter().enumerate() {
        let t = frame as f32 * 0.1;
        assert!((found - height(t)).abs() < 1e-4, "{frame}: {found}");
    }
}

#[test]
fn rotations_may_be_normalised_integers() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let shorts = [0i16, 0, 0, 32767, 23170, 0, 0, 23170].map(i16::to_le_bytes);
    let words = [0u16, 0, 0, 65535, 46341, 0, 0, 46341].map(u16::to_le_bytes);
    for (component, bytes) in [
        (5122, shorts.as_flattened()),
        (5120, &[0, 0, 0, 127, 90, 0, 0, 90]),
        (5123, words.as_flattened()),
        (5121, &[0, 0, 0, 255, 180, 0, 0, 180]),
    ] {
        let mut builder = Builder::default();
        let turns =
            json!({ "componentType": component, "count": 2, "type": "VEC4", "normalized": true });
        let turns = builder.add(bytes, turns);
        let times = builder.floats("SCALAR", &[0.0, 0.5]);
        let (_, clip) = clip_of(&builder.document("rotation", "LINEAR", times, turns));
        assert_eq!(clip.frames(), 2);
        let turned = clip.desc().rotations[3];
        assert!(turned.dot(Quat::from_xyzw(half, 0.0, 0.0, half)) > 0.9999);
    }
}

#[test]
fn sparse_accessors_replace_elements_of_a_view_or_of_zeros() {
    for (component, indices) in [
        (5121, vec![0, 2]),
        (5123, vec![0, 0, 2, 0]),
        (5125, vec![0, 0, 0, 0, 2, 0, 0, 0]),
    ] {
        for (has_view, expected) in [(true, [7.0, 2.0, 9.0]), (false, [7.0, 0.0, 9.0])] {
            let mut builder = Builder::default();
            let times = builder.floats("SCALAR", &[0.0, 0.1, 0.2]);
            let mut places = json!({ "componentType": 5126, "count": 3, "type": "VEC3" });
            if has_view {
                let own = bytes_of(&[0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 3.0, 0.0]);
                places["bufferView"] = json!(builder.view(&own));
            }
            let places = builder.sparse(places, component, &indices);
            let document = builder.document("translation", "STEP", times, places);
            let (_, clip) = clip_of(&document);
            let places = clip.desc().translations;
            let arms = places.chunks(2).map(|pair| pair[1].y);
            assert_eq!(arms.collect::<Vec<_>>(), expected, "{component} {has_view}");
        }
    }
}

#[test]
fn scale_and_what_stands_above_the_root_go_into_places() {
    let mut builder = Builder::default();
    let times = builder.floats("SCALAR", &[0.0, 1.0]);
    let turns = builder.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    let mut document = builder.document("rotation", "LINEAR", times, turns);
    // A turn from Z up to Y up and a scale of a half stand above; the root's own scale is 3.
    let half = std::f32::consts::FRAC_1_SQRT_2;
    document["nodes"][0]["scale"] = json!([3, 3, 3]);
    let nodes = document["nodes"].as_array_mut().unwrap();
    nodes.push(json!({
        "children": [0], "rotation": [-half, 0, 0, half], "scale": [0.5, 0.5, 0.5],
    }));
    let (skeleton, clip) = clip_of(&document);
    // The same as a matrix, column by column.
    let columns = [
        0.5, 0.0, 0.0, 0.0, 0.0, 0.0, -0.5, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0,
    ];
    document["nodes"][2] = json!({ "children": [0], "matrix": columns });
    let (same, again) = clip_of(&document);
    let tip = skeleton.joints()[1].offset;
    assert!(same.joints()[1].offset.distance(tip) < 1e-6);
    assert!(again.desc().roots[0].distance(clip.desc().roots[0]) < 1e-6);
    assert!(again.desc().rotations[0].angle_between(clip.desc().rotations[0]) < 1e-3);
    // The tip is 3 · 0.5 m from the root along the root's Y, the root 0.5 m along what was Y and is -Z now.
    assert!(tip.distance(Vec3::new(0.0, 1.5, 0.0)) < 1e-6);
    assert!(clip.desc().roots[0].distance(Vec3::new(0.0, 0.0, -0.5)) < 1e-6);
    assert!(clip.desc().translations.is_empty());
    let up = clip.desc().rotations[0] * Vec3::Z;
    assert!(up.distance(Vec3::Y) < 1e-6, "{up}");
}

#[test]
fn without_a_skin_what_is_animated_is_the_skeleton() {
    let mut builder = Builder::default();
    let times = builder.floats("SCALAR", &[0.0, 1.0]);
    let turns = builder.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    let mut document = builder.document("rotation", "LINEAR", times, turns);
    document.as_object_mut().unwrap().remove("skins");
    document["nodes"][1]["children"] = json!([2]);
    let nodes = document["nodes"].as_array_mut().unwrap();
    nodes.push(json!({ "name": "tip_End", "translation": [0, 0, 1] }));
    let (skeleton, clip) = clip_of(&document);
    let names = skeleton.joints().iter().map(|joint| joint.name.as_str());
    assert!(names.eq(["arm", "tip_End"]));
    assert_eq!(skeleton.joints()[1].kind, JointKind::EndSite);
    // The root's frame is that of the node above: it stands 2 m high.
    assert!(clip.desc().roots[0].distance(Vec3::new(0.0, 2.0, 0.0)) < 1e-6);
}

#[test]
fn buffers_may_lie_in_files_beside() {
    let folder = tempfile::tempdir().unwrap();
    let mut builder = Builder::default();
    let times = builder.floats("SCALAR", &[0.0, 1.0]);
    let turns = builder.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    let mut document = builder.document("rotation", "LINEAR", times, turns);
    document["buffers"][0]["uri"] = json!("data/my%20keys.bin");
    std::fs::create_dir(folder.path().join("data")).unwrap();
    std::fs::write(folder.path().join("data/my keys.bin"), &builder.bytes).unwrap();
    let path = written(folder.path(), "arm.GLTF", document.to_string());
    let loaded = read_clip(&path, &ReadOptions::default()).unwrap();
    assert_eq!((loaded.clip.name(), loaded.clip.frames()), ("arm.GLTF", 2));

    // A folder of clips takes it too.
    assert_eq!(read(folder.path()).clips.len(), 1);

    std::fs::remove_file(folder.path().join("data/my keys.bin")).unwrap();
    let error = refusal(read_clip(&path, &ReadOptions::default()));
    let is_named = error.contains("arm.GLTF: buffer 0: ") && error.contains("my keys.bin");
    assert!(is_named, "{error}");
}

/// The clip of a file in which each track moves a joint of its own, by keys at these times.
fn clip_of_tracks(tracks: &[&[f32]]) -> Clip {
    let mut builder = Builder::default();
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    for (node, times) in tracks.iter().enumerate() {
        let places = builder.floats("VEC3", &vec![node as f32; 3 * times.len()]);
        let times = builder.floats("SCALAR", times);
        samplers.push(json!({ "input": times, "output": places }));
        channels
            .push(json!({ "sampler": node, "target": { "node": node, "path": "translation" } }));
    }
    let nodes = json!([{ "children": [1, 2] }, {}, {}]);
    let animation = json!({ "samplers": samplers, "channels": channels });
    clip_of(&builder.animated(nodes, vec![animation])).1
}

#[test]
fn frames_lie_on_the_grid_of_all_keys() {
    for rate in [15.0, 23.976, 24.0, 30.0, 60.0, 120.0, 240.0] {
        for count in [2u32, 3, 50, 5000] {
            let key = |key: u32| (f64::from(7 + key) / rate) as f32;
            let times: Vec<f32> = (0..count).map(key).collect();
            let sparse: Vec<f32> = times.iter().copied().step_by(3).collect();
            let clip = clip_of_tracks(&[&times, &sparse, &times[..1]]);
            assert_eq!(clip.frames() as u32, count + 7, "{rate}");
            let found = clip.frame_rate();
            assert!((found / rate - 1.0).abs() < 1e-4, "{rate}: {found}");
        }
    }
    // With gaps in every track.
    let on = |frames: [u8; 4]| frames.map(|frame| (f64::from(frame) / 30.0) as f32);
    let clip = clip_of_tracks(&[&on([0, 1, 5, 90]), &on([0, 40, 42, 47])]);
    assert_eq!(clip.frames(), 91);
    assert!((clip.frame_rate() - 30.0).abs() < 1e-3);
}

#[test]
fn keys_on_no_grid_are_sampled_sixty_times_a_second() {
    let cases: [(&[&[f32]], usize); 5] = [
        (&[&[0.0, 0.31, 0.4567, 2.0]], 121),
        (&[&[0.0, 1e-20, 2.0]], 121),
        (&[&[1.0], &[2.0]], 121),
        // Of a grid that 0 is not on; and a pose.
        (&[&[0.55, 0.65, 0.75]], 46),
        (&[&[3.0], &[3.0]], 1),
    ];
    for (tracks, frames) in cases {
        let clip = clip_of_tracks(tracks);
        assert_eq!(clip.frames(), frames, "{tracks:?}");
        assert!(frames == 1 || clip.frame_rate() == 60.0, "{tracks:?}");
    }
}

/// The child is at x = k from key k on.
fn stepping(times: &[f32]) -> Value {
    let mut builder = Builder::default();
    let places = (0..times.len()).flat_map(|key| [key as f32, 1.0, 0.0]);
    let places = builder.floats("VEC3", &places.collect::<Vec<_>>());
    let times = builder.floats("SCALAR", times);
    builder.document("translation", "STEP", times, places)
}

/// The x of the child in each frame.
fn steps(document: &Value) -> Vec<f32> {
    let places = clip_of(document).1.desc().translations;
    places.chunks(2).map(|joints| joints[1].x).collect()
}

#[test]
fn a_step_comes_in_the_frame_of_its_key() {
    for rate in [15.0, 23.976, 24.0, 29.97, 30.0, 60.0, 120.0, 144.0, 240.0] {
        for first in [0, 1, 7, 1000] {
            let times: Vec<f32> = (first..first + 300)
                .map(|frame| (f64::from(frame) / rate) as f32)
                .collect();
            // The first key's value holds from time 0 on.
            let expected: Vec<f32> = (0..first + 300)
                .map(|frame| (frame - first).max(0) as f32)
                .collect();
            assert_eq!(steps(&stepping(&times)), expected, "{rate} {first}");
        }
    }
    // Times of whole milliseconds.
    let times: Vec<f32> = (0..300)
        .map(|frame| (f64::from(frame) / 30.0 * 1000.0).round() as f32 / 1000.0)
        .collect();
    let expected: Vec<f32> = (0..300).map(|key| key as f32).collect();
    assert_eq!(steps(&stepping(&times)), expected);
}

#[test]
fn a_step_does_not_come_early() {
    let times = [0.0, 0.1, 0.35, 0.4, 0.5];
    let found = steps(&stepping(&times));
    assert_eq!(
        found,
        [0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 2.0, 3.0, 3.0, 4.0]
    );
}

#[test]
fn of_keys_of_one_time_the_last_counts_from_it_on() {
    let mut builder = Builder::default();
    let places = [
        [0.0, 1.0, 0.0],
        [2.0, 1.0, 0.0],
        [8.0, 1.0, 0.0],
        [9.0, 1.0, 0.0],
    ];
    let places = builder.floats("VEC3", places.as_flattened());
    let times = builder.floats("SCALAR", &[0.0, 0.2, 0.2, 0.3]);
    let document = builder.document("translation", "LINEAR", times, places);
    let found = steps(&document);
    assert_eq!(found, [0.0, 1.0, 8.0, 9.0]);
    let file = parse(document.to_string().as_bytes());
    assert_eq!(file.notes.len(), 1, "{:?}", file.notes);
    assert!(
        file.notes[0].contains("\"move\": 1 keys of a node"),
        "{}",
        file.notes[0]
    );
}

#[test]
fn channels_without_a_node_are_ignored() {
    let document = stepping(&[0.0, 0.1, 0.2]);
    let expected = parse(document.to_string().as_bytes());
    let mut pointing = document.clone();
    let pointer = json!({ "KHR_animation_pointer": { "pointer": "/materials/0/alphaCutoff" } });
    let pointer = json!({ "sampler": 0, "target": { "path": "pointer", "extensions": pointer } });
    let channels = &mut pointing["animations"][0]["channels"];
    let channels = channels.as_array_mut().unwrap();
    channels.insert(0, pointer);
    channels.push(json!({ "sampler": 0, "target": { "path": "translation" } }));
    let mut only_pointers = pointing["animations"][0].clone();
    only_pointers["channels"].as_array_mut().unwrap().remove(1);
    let animations = pointing["animations"].as_array_mut().unwrap();
    animations.push(only_pointers);
    pointing["extensionsUsed"] = json!(["KHR_animation_pointer"]);
    let found = parse(pointing.to_string().as_bytes());
    assert_eq!(found.animations, expected.animations);
    let note = "animation \"move_2\" moves no joint and is left out";
    assert_eq!(found.notes, [note]);
    // Other errors of such a file are told as those of all files.
    pointing["nodes"] = json!(7);
    let text = pointing.to_string();
    let error = refusal(GltfFile::parse(text.as_bytes(), |_| Err(String::new())));
    assert!(error.contains("invalid type"), "{error}");
}
