//! `annotate`: what it writes can be baked, and what it compares is counted.

use std::fs;

use serde_json::{Value, json};

use super::run::{clips, folder, sabaki};

#[test]
fn proposed_events_can_be_baked() {
    let folder = folder();
    let (clips, _) = clips();
    let args = ["annotate", "--clips", clips, "--out", "own.json", "--json"];
    let told: Value = serde_json::from_str(&sabaki(folder.path(), &args).is(0).stdout).unwrap();
    let written = fs::read(folder.path().join("own.json")).unwrap();
    let written: Value = serde_json::from_slice(&written).unwrap();
    let all = told["clips"].as_array().unwrap().iter();
    let with_events: Vec<&Value> = all
        .filter(|clip| clip["events"] != json!([]))
        .map(|clip| &clip["events"])
        .collect();
    let of_file: Vec<&Value> = written["clips"]
        .as_array()
        .unwrap()
        .iter()
        .map(|clip| &clip["events"])
        .collect();
    assert!(!of_file.is_empty());
    assert_eq!(with_events, of_file);
    let bake = [
        "bake", "--clips", clips, "--events", "own.json", "--out", "g.sabaki",
    ];
    sabaki(folder.path(), &bake).is(0);
}

#[test]
fn events_made_by_hand_are_compared() {
    let folder = folder();
    let (clips, events) = clips();
    let args = ["annotate", "--clips", clips, "--against", events, "--json"];
    let told: Value = serde_json::from_str(&sabaki(folder.path(), &args).is(0).stdout).unwrap();
    let evasions = &told["agreement"]["evasion"];
    assert!(evasions["annotated"].as_u64().unwrap() > 0, "{evasions}");
    assert_eq!(told["evasions"], evasions["proposed"]);
    let own = ["annotate", "--clips", clips, "--out", "own.json"];
    sabaki(folder.path(), &own).is(0);
    let same = [
        "annotate",
        "--clips",
        clips,
        "--against",
        "own.json",
        "--json",
    ];
    let told: Value = serde_json::from_str(&sabaki(folder.path(), &same).is(0).stdout).unwrap();
    assert_eq!(told["agreement"]["evasion"]["precision"], 1.0);
    assert_eq!(told["agreement"]["evasion"]["recall"], 1.0);
}

#[test]
fn an_unreadable_clip_is_refused_or_left_out() {
    let folder = folder();
    fs::write(folder.path().join("bad.bvh"), "HIERARCHY\nnothing").unwrap();
    let (clips, events) = clips();
    let args = ["annotate", "--clips", clips, "bad.bvh"];
    sabaki(folder.path(), &args).is_refused(&["bad.bvh"]);
    let kept = [&args[..], &["--keep-going"]].concat();
    assert!(
        sabaki(folder.path(), &kept)
            .is(3)
            .stdout
            .contains("left out: bad.bvh")
    );
    let over = [
        "annotate",
        "--clips",
        clips,
        "--against",
        events,
        "--out",
        events,
    ];
    sabaki(folder.path(), &over).is_refused(&["--out", "overwrite"]);
}
