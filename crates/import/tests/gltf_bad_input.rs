//! A damaged or malicious glTF file is an error that names the position, and never a crash.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_fixtures as common;

use common::clips::{small_skeleton, swinging_clip};
use common::random::Random;
use sabaki_import::gltf::{self, GltfFile};
use serde_json::{Value, json};

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

fn parse(bytes: &[u8]) -> Result<GltfFile, gltf::GltfError> {
    GltfFile::parse(bytes, |_| Err("no such file".to_owned()))
}

/// The document and the binary part of a GLB file.
fn apart(bytes: &[u8]) -> (Value, Vec<u8>) {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let json = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    (json, bytes[28 + length..].to_vec())
}

fn together(json: &[u8], binary: &[u8]) -> Vec<u8> {
    let mut json = json.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + json.len() as u32 + binary.len() as u32).to_le_bytes());
    for (kind, part) in [(b"JSON", json.as_slice()), (b"BIN\0", binary)] {
        bytes.extend((part.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(part);
    }
    bytes
}

#[test]
fn every_length_that_is_cut_off_is_an_error() {
    let bytes = valid();
    assert!(parse(&bytes).is_ok());
    for length in 0..bytes.len() {
        assert!(
            parse(&bytes[..length]).is_err(),
            "{length} of {}",
            bytes.len()
        );
    }
}

#[test]
fn spoilt_bytes_do_no_harm() {
    let bytes = valid();
    let mut random = Random::new(1);
    let mut read = 0;
    for _ in 0..20_000 {
        let mut spoilt = bytes.clone();
        for _ in 0..1 + random.below(3) {
            let at = random.below(spoilt.len());
            spoilt[at] = random.next() as u8;
        }
        read += usize::from(parse(&spoilt).is_ok());
    }
    // Colours of the figure and the like may be anything.
    assert!(read > 0);
}

#[test]
fn spoilt_numbers_and_indices_do_no_harm() {
    let (json, binary) = apart(&valid());
    let text = json.to_string();
    let places: Vec<(usize, usize)> = {
        let bytes = text.as_bytes();
        let mut places = Vec::new();
        let mut at = 0;
        while at < bytes.len() {
            let end = (at..bytes.len())
                .find(|&i| !bytes[i].is_ascii_digit())
                .unwrap_or(bytes.len());
            if end > at {
                places.push((at, end));
            }
            at = end + 1;
        }
        places
    };
    assert!(places.len() > 100);
    let odd = [
        "0",
        "1",
        "2",
        "7",
        "255",
        "5121",
        "65536",
        "4294967295",
        "18446744073709551615",
        "-1",
        "1e300",
        "0.5",
        "null",
        "\"x\"",
        "[]",
    ];
    for &(start, end) in &places {
        for odd in odd {
            let spoilt = format!("{}{odd}{}", &text[..start], &text[end..]);
            let _ = parse(&together(spoilt.as_bytes(), &binary));
        }
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
    let (json, binary) = apart(&valid());
    let error = |pointer: &str, value: Value| {
        let mut document = json.clone();
        change(&mut document, pointer, value);
        let spoilt = together(document.to_string().as_bytes(), &binary);
        parse(&spoilt).map(|_| ()).unwrap_err().to_string()
    };
    let input = json["animations"][0]["samplers"][0]["input"]
        .as_u64()
        .unwrap() as usize;
    let view = json["accessors"][input]["bufferView"].as_u64().unwrap() as usize;
    for (pointer, value, expected) in [
        (
            "/asset/version",
            json!("1.0"),
            "glTF 1.0: only version 2 can be read".to_owned(),
        ),
        (
            "/nodes/0/children/0",
            json!(99),
            "node 0 names node 99, which is not there".into(),
        ),
        (
            "/nodes/1/children",
            json!([0]),
            "hangs on itself or on two nodes".into(),
        ),
        (
            "/nodes/1/children",
            json!([3]),
            "hangs on itself or on two nodes".into(),
        ),
        (
            "/skins/0/joints/2",
            json!(77),
            "skin 0 names node 77, which is not there".into(),
        ),
        (
            "/skins/0/joints",
            json!([0, 9]),
            "the joints hang on several roots: nodes 0 and 9".into(),
        ),
        (
            "/skins/0/joints",
            json!([9]),
            "the file has no animation of its skeleton".into(),
        ),
        (
            "/animations",
            json!([]),
            "the file has no animation of its skeleton".into(),
        ),
        (
            "/animations/0/channels/0/sampler",
            json!(500),
            "animation \"swing 0.3\" names sampler 500".into(),
        ),
        (
            "/animations/0/samplers/0/input",
            json!(500),
            "names accessor 500, which is not there".into(),
        ),
        (
            "/animations/0/samplers/1/output",
            json!(input),
            format!("accessor {input}: its elements have not the size"),
        ),
        (
            &format!("/accessors/{input}/count"),
            json!(4_000_000_000u64),
            format!("accessor {input}: it is not within its buffer"),
        ),
        (
            &format!("/accessors/{input}/count"),
            json!(3),
            "key 3: not as many values as times".into(),
        ),
        (
            &format!("/accessors/{input}/count"),
            json!(0),
            "key 0: there are no keys".into(),
        ),
        (
            &format!("/accessors/{input}/bufferView"),
            json!(400),
            "names buffer view 400".into(),
        ),
        (
            &format!("/bufferViews/{view}/byteOffset"),
            json!(u64::MAX),
            "it is not within its buffer".into(),
        ),
        (
            &format!("/bufferViews/{view}/buffer"),
            json!(3),
            "names buffer 3, which is not there".into(),
        ),
        (
            "/buffers/0/byteLength",
            json!(1u64 << 40),
            "buffer 0: ".into(),
        ),
        (
            "/buffers/0/uri",
            json!("../secret.bin"),
            "buffer 0: \"../secret.bin\" is not in the file's own folder".into(),
        ),
        (
            "/buffers/0/uri",
            json!("/etc/passwd"),
            "is not in the file's own folder".into(),
        ),
        (
            "/buffers/0/uri",
            json!("https://example.org/a.bin"),
            "is not in the file's own folder".into(),
        ),
        (
            "/buffers/0/uri",
            json!("%2e%2e/secret.bin"),
            "is not in the file's own folder".into(),
        ),
        ("/buffers/0/uri", json!("a%f"), "its URI is no path".into()),
        (
            "/buffers/0/uri",
            json!("data:;base64,@@"),
            "buffer 0: ".into(),
        ),
        (
            "/buffers/0/uri",
            json!("keys.bin"),
            "buffer 0: no such file".into(),
        ),
        (
            "/nodes/1/translation",
            json!([0.0, 1e20, 0.0]),
            "has an offset that is not finite or longer".into(),
        ),
        (
            "/nodes/1/rotation",
            json!([0.0, 0.0, 0.0, 0.0]),
            "\"LeftFoot_End\"".into(),
        ),
    ] {
        let found = error(pointer, value.clone());
        assert!(found.contains(&expected), "{pointer} = {value}: {found}");
    }
}

#[test]
fn keys_that_make_no_sense_are_errors() {
    let (json, binary) = apart(&valid());
    let offset = |accessor: &Value| {
        let view = &json["accessors"][accessor.as_u64().unwrap() as usize]["bufferView"];
        json["bufferViews"][view.as_u64().unwrap() as usize]["byteOffset"]
            .as_u64()
            .unwrap() as usize
    };
    let sampler = &json["animations"][0]["samplers"][1];
    let (times, turns) = (offset(&sampler["input"]), offset(&sampler["output"]));
    let error = |at: usize, floats: &[f32]| {
        let mut spoilt = binary.clone();
        for (index, float) in floats.iter().enumerate() {
            spoilt[at + 4 * index..at + 4 * index + 4].copy_from_slice(&float.to_le_bytes());
        }
        let spoilt = together(json.to_string().as_bytes(), &spoilt);
        parse(&spoilt).map(|_| ()).unwrap_err().to_string()
    };
    for wrong in [f32::NAN, f32::INFINITY, -1.0, 0.0] {
        let found = error(times + 4, &[wrong]);
        assert!(
            found.contains("animation \"swing 0.3\", node \"Hips\", key 1: its time"),
            "{found}"
        );
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
    // Three times, two indices of a byte, and the values of two keys.
    let mut bytes = [0.0f32, 0.1, 0.2].map(f32::to_le_bytes).concat();
    bytes.extend([0, 2, 0, 0]);
    bytes.extend(
        [0.0f32, 7.0, 0.0, 0.0, 9.0, 0.0]
            .map(f32::to_le_bytes)
            .concat(),
    );
    let document = json!({
        "asset": { "version": "2.0" },
        "nodes": [{}],
        "animations": [{
            "samplers": [{ "input": 0, "output": 1 }],
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }],
        }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 3, "type": "SCALAR" },
            { "componentType": 5126, "count": 3, "type": "VEC3", "sparse": {
                "count": 2,
                "indices": { "bufferView": 1, "componentType": 5121 },
                "values": { "bufferView": 2 },
            } },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": 12 },
            { "buffer": 0, "byteOffset": 12, "byteLength": 4 },
            { "buffer": 0, "byteOffset": 16, "byteLength": 24 },
        ],
        "buffers": [{ "byteLength": 40 }],
    });
    let read = |document: &Value| parse(&together(document.to_string().as_bytes(), &bytes));
    assert!(read(&document).is_ok());
    let sparse = "/accessors/1/sparse";
    for (pointer, value, expected) in [
        (
            "/accessors/1/count",
            json!(1_000_000_000u64),
            "more elements than the buffers have bytes",
        ),
        (
            "/accessors/1/count",
            json!(u64::MAX),
            "more elements than the buffers have bytes",
        ),
        (
            "/accessors/1/count",
            json!(2),
            "a sparse index is beyond its end",
        ),
        (
            &format!("{sparse}/count"),
            json!(3),
            "it is not within its buffer",
        ),
        (
            &format!("{sparse}/count"),
            json!(u64::MAX),
            "it is not within its buffer",
        ),
        (
            &format!("{sparse}/indices/bufferView"),
            json!(9),
            "names buffer view 9",
        ),
        (
            &format!("{sparse}/indices/byteOffset"),
            json!(1),
            "its sparse indices do not increase",
        ),
        (
            &format!("{sparse}/indices/componentType"),
            json!(5126),
            "sparse indices",
        ),
        (
            &format!("{sparse}/values/bufferView"),
            json!(1),
            "it is not within its buffer",
        ),
        (
            &format!("{sparse}/values/byteOffset"),
            json!(u64::MAX),
            "it is not within its buffer",
        ),
    ] {
        let mut spoilt = document.clone();
        change(&mut spoilt, pointer, value.clone());
        let found = read(&spoilt).unwrap_err().to_string();
        assert!(found.contains(expected), "{pointer} = {value}: {found}");
    }
}

#[test]
fn what_would_fill_the_memory_is_an_error() {
    // A document of a few lines that asks for a billion keys.
    let document = json!({
        "asset": { "version": "2.0" },
        "nodes": [{}],
        "animations": [{
            "samplers": [{ "input": 0, "output": 1 }],
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "rotation" } }],
        }],
        "accessors": [
            { "componentType": 5126, "count": 1_000_000_000u64, "type": "SCALAR" },
            { "componentType": 5126, "count": 1_000_000_000u64, "type": "VEC4" },
        ],
    });
    let error = parse(document.to_string().as_bytes())
        .unwrap_err()
        .to_string();
    assert_eq!(error, "accessor 0: it has no buffer view");
    // More joints than can be named, all of one name.
    let nodes: Vec<Value> = (0..5000)
        .map(|index| match index {
            0 => json!({ "children": (1..5000).collect::<Vec<_>>() }),
            _ => json!({ "name": "same" }),
        })
        .collect();
    let document = json!({
        "asset": { "version": "2.0" },
        "nodes": nodes,
        "skins": [{ "joints": (0..5000).collect::<Vec<_>>() }],
    });
    let error = parse(document.to_string().as_bytes())
        .unwrap_err()
        .to_string();
    assert_eq!(error, "more than 4096 joints");
}

#[test]
fn no_gltf_at_all_is_an_error() {
    for bytes in [
        b"".as_slice(),
        b"{}",
        b"[]",
        b"HIERARCHY",
        b"glTF",
        b"\xff\xfe",
    ] {
        assert!(parse(bytes).is_err());
    }
    let deep = "[".repeat(100_000);
    assert!(parse(deep.as_bytes()).is_err());
    let mut long = Vec::new();
    let skeleton = small_skeleton();
    gltf::write(&mut long, &skeleton, &[], &[]).unwrap();
    let error = parse(&long).unwrap_err().to_string();
    assert_eq!(error, "the file has no animation of its skeleton");
}
