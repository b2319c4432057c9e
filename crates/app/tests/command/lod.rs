//! `sabaki lod`.

use sabaki_fixtures::clips::{chain, swinging_chain};
use serde_json::Value;

use super::assert_is_png;
use super::run::{folder, sabaki, write, write_bvh};

#[test]
fn the_levels_of_a_clip_are_told_and_drawn() {
    let folder = folder();
    let told = sabaki(&folder, "lod CLIPS --plot lod.png --export lod.glb").is(0);
    for word in ["removed", "energy J", "L = "] {
        assert!(told.stdout.contains(word), "{word} in\n{}", told.stdout);
    }
    assert_is_png(&folder.path().join("lod.png"));
    let file = sabaki_import::read_gltf(&folder.path().join("lod.glb")).unwrap();
    assert_eq!(file.animations.len(), 19);
    assert_eq!(file.animations[0].name, "level 0");
}

fn levels(document: &Value) -> Vec<Value> {
    document["levels"].as_array().unwrap().clone()
}

#[test]
fn lod_json_has_its_keys() {
    let folder = folder();
    for order in ["energy", "error"] {
        let document = sabaki(&folder, &format!("lod --json --order {order}")).json(0);
        assert_eq!(document["order"], order);
        let levels = levels(&document);
        // 24 joints, five ends and the root stay.
        assert_eq!(levels.len(), 19);
        for (index, level) in levels.iter().enumerate() {
            assert_eq!(level["level"], index);
            assert_eq!(level["joints"], 24 - index);
            assert_eq!(level["removed"].is_null(), index == 0);
            let errors = ["position_error_mean", "position_error_max", "step"];
            for key in errors.iter().chain(&["energy"]) {
                assert!(level[key].as_f64().unwrap() >= 0.0, "{key}");
            }
        }
        assert_eq!(document["energies"].as_array().unwrap().len(), 24);
    }
}

#[test]
fn settings_change_what_they_say() {
    let folder = folder();
    let run = |more: &str| sabaki(&folder, &format!("lod --json {more}")).json(0);
    let plain = run("");
    let locked = run("--lock LeftHand,Head");
    assert_eq!(levels(&locked).len(), levels(&plain).len() - 2);
    for level in levels(&locked) {
        assert!(level["removed"] != "LeftHand" && level["removed"] != "Head");
    }
    let small = run("--screen 540");
    let furthest = |document: &Value| document["switching"]["rule"]["energy"]["furthest"].as_f64();
    assert!((furthest(&small).unwrap() * 2.0 - furthest(&plain).unwrap()).abs() < 1e-2);
    write(
        &folder,
        "masses.json",
        r#"{"masses": {"LeftForeArm": 100.0}}"#,
    );
    let heavy = run("--masses masses.json");
    let energy = |joint: &str| {
        let energies = heavy["energies"].as_array().unwrap();
        let mut found = energies.iter().filter(|energy| energy["joint"] == joint);
        found.next().unwrap()["energy"].as_f64().unwrap()
    };
    // Only what carries the weight has any energy.
    assert!(energy("LeftArm") > 0.0);
    assert_eq!(energy("RightArm"), 0.0);
}

#[test]
fn a_chain_without_motion_is_told_of() {
    let folder = folder();
    let skeleton = chain(12);
    let clip = swinging_chain(&skeleton, 20, 0.0);
    write_bvh(&folder.path().join("chain.bvh"), &skeleton, &clip);
    let document = sabaki(&folder, "lod chain.bvh --json").json(0);
    let levels = levels(&document);
    assert_eq!(levels.len(), 12);
    for level in &levels[1..] {
        assert!(level["band"]["end"].as_f64().unwrap().is_finite());
    }
    let args = "crowd chain.bvh --count 32 --json";
    sabaki(&folder, args).json(0);
}

#[test]
fn masses_of_joints_that_are_not_there_are_refused() {
    let folder = folder();
    write(&folder, "masses.json", r#"{"masses": {"Tail": 1.0}}"#);
    let refused = sabaki(&folder, "lod --masses masses.json");
    refused.is_refused(&["masses.json: the skeleton has no joint \"Tail\""]);
}
