//! A damaged or malicious glTF file is an error that names the position, and never a crash.

use sabaki_fixtures::clips::{small_skeleton, swinging_clip};
use sabaki_fixtures::files::{glb, glb_parts};
use sabaki_import::FileError;
use sabaki_import::gltf::{self, GltfFile, SkinnedMesh};
use serde_json::{Value, json};

use super::common::{bytes_of, place_of, refusal};
use super::gltf::Builder;
use super::refused::cases;

fn valid() -> Vec<u8> {
    let skeleton = small_skeleton();
    let clips = [
        swinging_clip(&skeleton, 6, 0.3),
        swinging_clip(&skeleton, 3, 0.9),
    ];
    let mut bytes = Vec::new();
    gltf::write(&mut bytes, &skeleton, &clips, &[]).unwrap();
    bytes
}

fn parse(bytes: &[u8]) -> Result<GltfFile, FileError> {
    GltfFile::parse(bytes, |_| Err("no such file".to_owned()))
}

#[test]
fn every_length_that_is_cut_off_is_an_error() {
    let bytes = valid();
    assert!(parse(&bytes).is_ok());
    for length in 0..bytes.len() {
        assert!(parse(&bytes[..length]).is_err(), "{length}");
    }
}

fn change(document: &mut Value, pointer: &str, value: Value) {
    let (parent, key) = pointer.rsplit_once('/').unwrap();
    let parent = document.pointer_mut(parent).unwrap();
    match parent {
        Value::Array(list) => list[key.parse::<usize>().unwrap()] = value,
        other => other[key] = value,
    }
}

#[test]
fn errors_say_what_is_wrong_and_where() {
    let (json, binary) = glb_parts(&valid());
    let error = |pointer: &str, value: Value| {
        let mut document = json.clone();
        change(&mut document, pointer, value);
        refusal(parse(&glb(&document, &binary)))
    };
    let input = &json["animations"][0]["samplers"][0]["input"];
    let view = &json["accessors"][input.as_u64().unwrap() as usize]["bufferView"];
    for [pointer, value, expected] in cases(include_str!("refused/gltf.txt")) {
        let insert = |cell: String| {
            let cell = cell.replace("{input}", &input.to_string());
            cell.replace("{view}", &view.to_string())
        };
        let (pointer, value, expected) = (insert(pointer), insert(value), insert(expected));
        let found = error(&pointer, serde_json::from_str(&value).unwrap());
        assert!(found.contains(&expected), "{pointer} = {value}: {found}");
    }
}

#[test]
fn keys_that_make_no_sense_are_errors() {
    let (json, binary) = glb_parts(&valid());
    let sampler = &json["animations"][0]["samplers"][1];
    let [times, turns] = ["input", "output"].map(|key| {
        let accessor = sampler[key].as_u64().unwrap() as usize;
        place_of(&json, accessor)[0]
    });
    let error = |at: usize, floats: &[f32]| {
        let mut spoilt = binary.clone();
        spoilt[at..at + 4 * floats.len()].copy_from_slice(&bytes_of(floats));
        refusal(parse(&glb(&json, &spoilt)))
    };
    let key = "animation \"swing 0.3\", node \"Hips\", key 1: its time";
    for wrong in [f32::NAN, f32::INFINITY, -1.0] {
        let found = error(times + 4, &[wrong]);
        assert!(found.contains(key), "{found}");
    }
    let found = error(turns + 16, &[0.0; 4]);
    assert!(found.contains("key 1: it is no rotation"), "{found}");
    let found = error(turns + 16, &[f32::NAN]);
    assert!(found.contains("key 1: its value is no number"), "{found}");
    // Ten years at sixty frames a second.
    let found = error(times + 8, &[1e8, 1.1e8, 2e8, 3.2e8]);
    assert!(found.contains("rotations in all are the most"), "{found}");
}

#[test]
fn sparse_accessors_that_make_no_sense_are_errors() {
    let mut builder = Builder::default();
    let times = builder.floats("SCALAR", &[0.0, 0.1, 0.2]);
    let places = json!({ "componentType": 5126, "count": 3, "type": "VEC3" });
    let places = builder.sparse(places, 5121, &[0, 2, 0, 0]);
    let document = builder.document("translation", "LINEAR", times, places);
    let read = |document: &Value| parse(document.to_string().as_bytes());
    assert!(read(&document).is_ok());
    for [pointer, value, expected] in cases(include_str!("refused/gltf_sparse.txt")) {
        let mut spoilt = document.clone();
        change(&mut spoilt, &pointer, serde_json::from_str(&value).unwrap());
        let found = refusal(read(&spoilt));
        assert!(found.contains(&expected), "{pointer} = {value}: {found}");
    }
}

#[test]
fn what_would_fill_the_memory_is_an_error() {
    // A document of a few lines that asks for a billion keys.
    let mut document = Builder::default().document("rotation", "LINEAR", 0, 1);
    let keys = |kind| json!({ "componentType": 5126, "count": 1_000_000_000, "type": kind });
    document["accessors"] = json!([keys("SCALAR"), keys("VEC4")]);
    let error = refusal(parse(document.to_string().as_bytes()));
    assert_eq!(error, "accessor 0: it has no buffer view");
    // More joints than can be named, all of one name.
    let mut nodes = vec![json!({ "name": "same" }); 5000];
    nodes[0] = json!({ "children": (1..5000).collect::<Vec<_>>() });
    let document = json!({
        "asset": { "version": "2.0" },
        "nodes": nodes,
        "skins": [{ "joints": (0..5000).collect::<Vec<_>>() }],
    });
    let error = refusal(parse(document.to_string().as_bytes()));
    assert_eq!(error, "more than 4096 joints");
}

/// A walk up the chain for each joint would take minutes.
#[test]
fn joints_at_the_end_of_a_long_chain_of_nodes_take_no_time() {
    let document = |nodes: usize, joints: Vec<usize>| {
        let node = |index: usize| match index + 1 < nodes {
            true => json!({ "children": [index + 1] }),
            false => json!({}),
        };
        let nodes: Vec<Value> = (0..nodes).map(node).collect();
        let skins = [json!({ "joints": joints })];
        json!({ "asset": { "version": "2.0" }, "nodes": nodes, "skins": skins }).to_string()
    };
    let mesh = |text: String| SkinnedMesh::parse(text.as_bytes(), |_| Err(String::new()));
    let deep = document(100_000, (90_000..94_000).collect());
    assert_eq!(refusal(parse(deep.as_bytes())), "more than 4096 joints");
    assert_eq!(refusal(mesh(deep)), "more than 4096 joints");
    let often = document(4_000, vec![3_999; 400_000]);
    assert_eq!(refusal(mesh(often)), "the file has no skinned mesh");
}

#[test]
fn no_gltf_at_all_is_an_error() {
    let deep = "[".repeat(100_000);
    for text in ["", "{}", "[]", "HIERARCHY", "glTF", &deep] {
        assert!(parse(text.as_bytes()).is_err());
    }
    assert!(parse(b"\xff\xfe").is_err());
    let mut long = Vec::new();
    let skeleton = small_skeleton();
    gltf::write(&mut long, &skeleton, &[], &[]).unwrap();
    let error = refusal(parse(&long));
    assert_eq!(error, "the file has no animation of its skeleton");
}
