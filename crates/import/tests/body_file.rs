//! A body file is read as it was written. Errors name the sphere, its joint and the field.

use glam::Vec3;
use sabaki::maps::Body;
use sabaki_fixtures::clips::small_skeleton;
use sabaki_import::{BodyFile, FileError};

use super::refused::cases;

fn error(text: &str) -> String {
    BodyFile::parse(text.as_bytes()).unwrap_err().to_string()
}

#[test]
fn what_is_written_is_read_again() {
    let skeleton = small_skeleton();
    let mut body = Body::from_bones(&skeleton);
    for (index, sphere) in body.spheres.iter_mut().enumerate() {
        sphere.offset += Vec3::new(0.1, 1.0 / 3.0, -1e-7) * index as f32;
        sphere.radius *= 1.0 + 0.01 * index as f32;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("body.json");
    let written = serde_json::to_vec(&BodyFile::of(&body, &skeleton)).unwrap();
    std::fs::write(&path, written).unwrap();
    let read = BodyFile::read(&path).unwrap();
    let resolved = read.resolve(&skeleton).unwrap();
    assert_eq!(resolved, body, "not to the last bit");
}

#[test]
fn the_body_of_an_exported_answer_is_read() {
    let text = r#"{"avoided": true, "attack": {"spheres": [[{"t": 0, "center": [0,0,0], "radius": 1}]]},
        "body": {"spheres": [{"joint": "Chest", "offset": [0.5, 0, 1], "radius": 0.25}]}}"#;
    let body = BodyFile::parse(text.as_bytes()).unwrap();
    let body = body.resolve(&small_skeleton()).unwrap();
    assert_eq!(body.spheres.len(), 1);
    assert_eq!(body.spheres[0].offset, Vec3::new(0.5, 0.0, 1.0));
}

#[test]
fn what_is_wrong_is_named() {
    let first = r#"{"joint":"Hips","offset":[0,0,0],"radius":1}"#;
    let with = |entry: &str| error(&format!("{{\"spheres\": [{first}, {entry}]}}"));
    for [entry, wanted] in cases(include_str!("refused/body.txt")) {
        let said = with(&entry);
        for word in wanted.split(' ') {
            assert!(said.contains(word), "{entry}: {said}, without {word}");
        }
    }
    for empty in ["{}", r#"{"spheres": []}"#, r#"{"body": {"spheres": []}}"#] {
        assert_eq!(error(empty), "the file holds no sphere");
    }
    for broken in ["", "[", "3", r#"{"spheres": 3}"#, "\u{0}"] {
        let refused = BodyFile::parse(broken.as_bytes());
        let is_json = matches!(refused, Err(FileError::Text(_)));
        assert!(is_json, "{broken}");
    }
    let unknown = r#"{"spheres": [{"joint":"Tail","offset":[0,0,0],"radius":1}]}"#;
    let unknown = BodyFile::parse(unknown.as_bytes()).unwrap();
    let said = unknown.resolve(&small_skeleton()).unwrap_err().to_string();
    assert!(said.contains("sphere 0") && said.contains("Tail"), "{said}");
}
