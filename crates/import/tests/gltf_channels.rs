//! Channels of glTF animations: steps come in the frames of their keys, and channels without a node are ignored.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use base64::Engine;
use sabaki_import::gltf::GltfFile;
use serde_json::{Value, json};

/// A root, and a child a metre above it that is at x = k from key k on.
fn stepping(times: &[f32]) -> Value {
    let places = (0..times.len()).flat_map(|key| [key as f32, 1.0, 0.0]);
    let floats: Vec<f32> = times.iter().copied().chain(places).collect();
    let bytes: Vec<u8> = floats
        .iter()
        .flat_map(|float| float.to_le_bytes())
        .collect();
    let text = base64::engine::general_purpose::STANDARD.encode(&bytes);
    let of_times = 4 * times.len();
    json!({
        "asset": { "version": "2.0" },
        "nodes": [
            { "name": "root", "children": [1] },
            { "name": "arm", "translation": [0, 1, 0] },
        ],
        "skins": [{ "joints": [0, 1] }],
        "animations": [{
            "name": "move",
            "samplers": [{ "input": 0, "output": 1, "interpolation": "STEP" }],
            "channels": [{ "sampler": 0, "target": { "node": 1, "path": "translation" } }],
        }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": times.len(), "type": "SCALAR" },
            { "bufferView": 1, "componentType": 5126, "count": times.len(), "type": "VEC3" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": of_times },
            { "buffer": 0, "byteOffset": of_times, "byteLength": 3 * of_times },
        ],
        "buffers": [{
            "byteLength": bytes.len(),
            "uri": format!("data:application/octet-stream;base64,{text}"),
        }],
    })
}

fn parse(document: &Value) -> GltfFile {
    let load = |file: &std::path::Path| panic!("{} is not asked for", file.display());
    GltfFile::parse(document.to_string().as_bytes(), load).unwrap()
}

/// The x of the child in each frame.
fn steps(file: &GltfFile) -> Vec<f32> {
    let places = file.animations()[0].clip.desc().translations;
    places.chunks(2).map(|joints| joints[1].x).collect()
}

#[test]
fn a_step_comes_in_the_frame_of_its_key() {
    for rate in [15.0, 23.976, 24.0, 29.97, 30.0, 60.0, 120.0, 144.0, 240.0] {
        for first in [0, 1, 7, 1000] {
            let times: Vec<f32> = (first..first + 300)
                .map(|frame| (f64::from(frame) / rate) as f32)
                .collect();
            let expected: Vec<f32> = (0..300).map(|key| key as f32).collect();
            assert_eq!(steps(&parse(&stepping(&times))), expected, "{rate} {first}");
        }
    }
    // Times of whole milliseconds.
    let times: Vec<f32> = (0..300)
        .map(|frame| (f64::from(frame) / 30.0 * 1000.0).round() as f32 / 1000.0)
        .collect();
    let expected: Vec<f32> = (0..300).map(|key| key as f32).collect();
    assert_eq!(steps(&parse(&stepping(&times))), expected);
}

#[test]
fn a_step_does_not_come_early() {
    let times = [0.0, 0.1, 0.35, 0.4, 0.5];
    let found = steps(&parse(&stepping(&times)));
    assert_eq!(
        found,
        [0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 2.0, 3.0, 3.0, 4.0]
    );
}

#[test]
fn channels_without_a_node_are_ignored() {
    let document = stepping(&[0.0, 0.1, 0.2]);
    let expected = parse(&document);
    let mut pointing = document.clone();
    let pointer = json!({ "KHR_animation_pointer": { "pointer": "/materials/0/alphaCutoff" } });
    let channels = &mut pointing["animations"][0]["channels"];
    let channels = channels.as_array_mut().unwrap();
    channels.insert(
        0,
        json!({ "sampler": 0, "target": { "path": "pointer", "extensions": pointer } }),
    );
    channels.push(json!({ "sampler": 0, "target": { "path": "translation" } }));
    let mut only_pointers = pointing["animations"][0].clone();
    only_pointers["channels"].as_array_mut().unwrap().remove(1);
    pointing["animations"]
        .as_array_mut()
        .unwrap()
        .push(only_pointers);
    pointing["extensionsUsed"] = json!(["KHR_animation_pointer"]);
    assert_eq!(parse(&pointing), expected);
    // Other errors of such a file are told as those of all files.
    pointing["nodes"] = json!(7);
    let text = pointing.to_string();
    let error = GltfFile::parse(text.as_bytes(), |_| Err(String::new())).unwrap_err();
    assert!(error.to_string().contains("invalid type"), "{error}");
}
