//! `sabaki inspect` and `bake` on files that can be read and are doubtful.

use std::fs;

use super::run::{folder, sabaki};

/// Two joints of one name, one of which turns about Z three times; more frames than are stated.
const DOUBTFUL: &str = "HIERARCHY\nROOT arm\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Zrotation Zrotation\nJOINT arm\n{\nOFFSET 0 1 0\nCHANNELS 3 Zrotation Xrotation Zrotation\nEnd Site\n{\nOFFSET 0 0.7 0\n}\n}\n}\nMOTION\nFrames: 1\nFrame Time: 0.033\n0 0 0 0 0 0\n0 0 0 0 0 0\n0 0 0 0 0 0\n";

#[test]
fn doubtful_files_are_noted() {
    let folder = folder();
    fs::write(folder.path().join("a.bvh"), DOUBTFUL).unwrap();
    let document = sabaki(folder.path(), &["inspect", "a.bvh", "--json"]).json(0);
    let notes: Vec<&str> = document["notes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|note| note.as_str().unwrap())
        .collect();
    for words in [
        ["1 frames", "has 3"],
        ["several joints", "\"arm\""],
        [
            "joint \"arm\" turns about one axis twice",
            "Zrotation Zrotation Zrotation",
        ],
    ] {
        let has_all = |note: &&&str| words.iter().all(|word| note.contains(word));
        assert_eq!(
            notes.iter().filter(has_all).count(),
            1,
            "{words:?} in {notes:?}"
        );
    }
    // Z X Z are Euler angles.
    assert!(
        !notes.iter().any(|note| note.contains("arm_2\" turns")),
        "{notes:?}"
    );
    let told = sabaki(folder.path(), &["inspect", "a.bvh"]).is(0);
    for note in notes {
        assert!(told.stdout.contains(note), "{note}");
    }
}

#[test]
fn scales_out_of_range_are_refused_and_doubtful_ones_noted() {
    let folder = folder();
    fs::write(folder.path().join("a.bvh"), DOUBTFUL).unwrap();
    fs::write(
        folder.path().join("z.bvh"),
        DOUBTFUL.replace("OFFSET 0 1 0", "OFFSET 0 0 0"),
    )
    .unwrap();
    for file in ["a.bvh", "z.bvh"] {
        for scale in ["1e30", "1e-30", "0", "inf"] {
            let args = ["inspect", file, "--scale", scale];
            sabaki(folder.path(), &args).is_refused(&["metres per unit", "1e-9 to 1e6"]);
        }
    }
    let told = sabaki(folder.path(), &["inspect", "a.bvh", "--scale", "1e5"]).is(0);
    assert!(
        told.stdout.contains("note: the figure is 170000.00 m high"),
        "{}",
        told.stdout
    );
    let usual = sabaki(folder.path(), &["inspect", "a.bvh"]).is(0);
    assert!(
        !usual.stdout.contains("note: the figure is"),
        "{}",
        usual.stdout
    );
}

#[test]
fn a_name_of_two_joints_names_none_in_events_and_bodies() {
    let folder = folder();
    fs::write(folder.path().join("a.bvh"), DOUBTFUL).unwrap();
    let bake = |option: &str, text: &str| {
        fs::write(folder.path().join("more.json"), text).unwrap();
        let args = [
            "bake",
            "--clips",
            "a.bvh",
            option,
            "more.json",
            "--out",
            "g",
        ];
        sabaki(folder.path(), &args)
    };
    let events = |joint: &str| {
        format!(
            r#"{{"clips":[{{"file":"a.bvh","events":[{{"kind":"attack","start":0,"end":0.05,"joints":["{joint}"]}}]}}]}}"#
        )
    };
    let body = |joint: &str| {
        format!(r#"{{"spheres":[{{"joint":"{joint}","offset":[0,0,0],"radius":0.1}}]}}"#)
    };
    let words = ["more.json", "several joints are called \"arm\"", "arm_2"];
    bake("--events", &events("arm")).is_refused(&words);
    bake("--body", &body("arm")).is_refused(&words);
    // The second joint has a name of its own: what is wrong then is the clip, too short for a graph.
    for (option, text) in [("--events", events("arm_2")), ("--body", body("arm_2"))] {
        let ended = bake(option, &text);
        assert!(
            !ended.stderr.contains("several joints are called"),
            "{}",
            ended.stderr
        );
    }
}
