//! `annotate`: what it writes can be baked, and what it compares is counted.

use std::fs;

use serde_json::{Value, json};

use super::run::{folder, sabaki};

#[test]
fn proposed_events_can_be_baked() {
    let folder = folder();
    let args = "annotate --clips CLIPS --out own.json --json";
    let told = sabaki(&folder, args).json(0);
    let written = fs::read(folder.path().join("own.json")).unwrap();
    let written: Value = serde_json::from_slice(&written).unwrap();
    let all = told["clips"].as_array().unwrap().iter();
    let with_events: Vec<&Value> = all
        .filter(|clip| clip["events"] != json!([]))
        .map(|clip| &clip["events"])
        .collect();
    let of_file = written["clips"].as_array().unwrap().iter();
    let of_file: Vec<&Value> = of_file.map(|clip| &clip["events"]).collect();
    assert!(!of_file.is_empty());
    assert_eq!(with_events, of_file);
    let bake = "bake --clips CLIPS --events own.json --out g.sabaki";
    sabaki(&folder, bake).is(0);
}

#[test]
fn events_made_by_hand_are_compared() {
    let folder = folder();
    let args = "annotate --clips CLIPS --against EVENTS --json";
    let told = sabaki(&folder, args).json(0);
    let evasions = &told["agreement"]["evasion"];
    assert!(evasions["annotated"].as_u64().unwrap() > 0, "{evasions}");
    assert_eq!(told["evasions"], evasions["proposed"]);
    let own = "annotate --clips CLIPS --out own.json";
    sabaki(&folder, own).is(0);
    let same = "annotate --clips CLIPS --against own.json --json";
    let told = sabaki(&folder, same).json(0);
    assert_eq!(told["agreement"]["evasion"]["precision"], 1.0);
    assert_eq!(told["agreement"]["evasion"]["recall"], 1.0);
}
