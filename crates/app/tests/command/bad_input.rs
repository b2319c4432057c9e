//! What is refused: one line with the file and the place in it, exit code 2.

use std::fs;
use std::path::Path;

use super::run::{baked, clips, folder, sabaki, text_of};

/// One joint, two frames of three values.
const PLAIN: &str = "HIERARCHY\nROOT Hips\n{\n\tOFFSET 0 90 0\n\tCHANNELS 3 Zrotation Xrotation Yrotation\n\tEnd Site\n\t{\n\t\tOFFSET 0 80 0\n\t}\n}\nMOTION\nFrames: 2\nFrame Time: 0.0333\n0 0 0\n1 2 3\n";

fn bake<'a>(clip: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["bake", "--out", "out.sabaki", "--clips", clip], more].concat()
}

#[test]
fn motions_that_are_none() {
    let folder = folder();
    let cut = |at: &str| PLAIN.split_once(at).unwrap().0.to_owned();
    let cases: [(&str, Vec<u8>, &[&str]); 11] = [
        ("empty.bvh", Vec::new(), &[]),
        ("cut_tree.bvh", cut("CHANNELS").into(), &["line"]),
        ("cut_motion.bvh", cut("1 2 3").into(), &["frame"]),
        (
            "binary.bvh",
            (0..=255).cycle().take(5000).collect(),
            &["line"],
        ),
        ("zeros.bvh", vec![0; 5000], &["line"]),
        (
            "nan.bvh",
            PLAIN.replace("1 2 3", "1 NaN 3").into(),
            &["line 15"],
        ),
        (
            "frames.bvh",
            PLAIN.replace("Frames: 2", "Frames: 0").into(),
            &["line 12"],
        ),
        (
            "time.bvh",
            PLAIN.replace("0.0333", "0").into(),
            &["line 13"],
        ),
        (
            "past.bvh",
            PLAIN.replace("0.0333", "-1").into(),
            &["line 13"],
        ),
        (
            "no_joint.bvh",
            "HIERARCHY\nMOTION\nFrames: 1\nFrame Time: 1\n\n".into(),
            &["line"],
        ),
        (
            "far.bvh",
            PLAIN.replace("OFFSET 0 90 0", "OFFSET 0 1e300 0").into(),
            &[],
        ),
    ];
    for (name, bytes, words) in cases {
        fs::write(folder.path().join(name), bytes).unwrap();
        let words = [&[name], words].concat();
        sabaki(folder.path(), &["inspect", name]).is_refused(&words);
        sabaki(folder.path(), &bake(name, &[])).is_refused(&words);
    }
    for name in ["missing.bvh", "."] {
        sabaki(folder.path(), &["inspect", name]).is_refused(&[name]);
    }
    sabaki(folder.path(), &bake("missing.bvh", &[])).is_refused(&["missing.bvh"]);
    // A line for each file of a folder, and one for all.
    let told = sabaki(folder.path(), &bake(".", &[]));
    assert_eq!((told.code, told.stdout.as_str()), (2, ""));
    assert_eq!(told.stderr.lines().count(), 12, "{}", told.stderr);
    assert!(told.stderr.contains("11 of 11 files"), "{}", told.stderr);
    assert!(!folder.path().join("out.sabaki").exists());
}

#[test]
fn motions_that_make_no_graph() {
    let folder = folder();
    let (clips, _) = clips();
    let in_folder = |name: &str| folder.path().join(name);
    fs::write(in_folder("plain.bvh"), PLAIN).unwrap();
    // Two frames of a turning stick lead nowhere.
    sabaki(folder.path(), &bake("plain.bvh", &[]))
        .is_refused(&["plain.bvh", "no motion leads back"]);
    let one = fs::read_dir(clips).unwrap().next().unwrap().unwrap().path();
    let one = one.to_str().unwrap();
    sabaki(folder.path(), &bake(one, &["plain.bvh"])).is_refused(&[
        "plain.bvh",
        "differs",
        "Chest",
    ]);
    sabaki(folder.path(), &bake(one, &[one])).is_refused(&[one, "second clip of that name"]);
    for threshold in ["0", "nan", "1e9"] {
        let told = sabaki(folder.path(), &bake(one, &["--threshold", threshold]));
        told.is_refused(&["threshold"]);
    }
    let told = sabaki(folder.path(), &bake(one, &["--memory", "0.0001"]));
    told.is_refused(&["kB of memory", "107.4 kB is the most", "--memory"]);
    for scale in ["0", "inf", "1e30"] {
        sabaki(folder.path(), &bake(one, &["--scale", scale])).is_refused(&[]);
    }
    sabaki(folder.path(), &bake(one, &["--scale", "10000"])).is_refused(&[]);
    sabaki(folder.path(), &bake(one, &["--scale", "-1"])).is_refused(&["a scale of -1 metres"]);
    for settings in [
        ["--slices", "65"],
        ["--texel", "0"],
        ["--texel", "-1"],
        ["--slab", "NaN"],
        ["--slices", "-1"],
        ["--attack-pitch", "3"],
        ["--attack-pitch", "-1"],
        ["--threshold", "NaN"],
        ["--threshold", "-1"],
        ["--memory", "NaN"],
        ["--memory", "0"],
        ["--memory", "-1"],
    ] {
        let told = sabaki(folder.path(), &bake(one, &settings));
        let begins = format!("sabaki: {} {}: must be ", settings[0], settings[1]);
        told.is_refused(&[&begins]);
    }
    let both = bake(one, &["--paper-maps", "--slices", "8"]);
    assert_eq!(sabaki(folder.path(), &both).code, 2);
}

#[test]
fn events_that_do_not_fit() {
    let folder = folder();
    let (clips, _) = clips();
    let clip = fs::read_dir(clips).unwrap().next().unwrap().unwrap();
    let name = clip.file_name().into_string().unwrap();
    let event = |file: &str, kind: &str, start: f64, end: f64| {
        format!(
            r#"{{"clips":[{{"file":"{file}","events":[{{"kind":"{kind}","start":{start},"end":{end}}}]}}]}}"#
        )
    };
    let cases: [(String, &[&str]); 8] = [
        (event("nobody.bvh", "evasion", 0.1, 0.2), &["nobody.bvh"]),
        (
            event(&name, "evasion", 0.5, 0.2),
            &["event 0", "0.5 s to 0.2 s"],
        ),
        (event(&name, "evasion", 0.5, 5000.0), &["event 0", "5000"]),
        (event(&name, "evasion", -1.0, 0.5), &["event 0"]),
        (event(&name, "attack", 0.1, 0.5), &["event 0", "joints"]),
        (event(&name, "dance", 0.1, 0.5), &["line 1", "dance"]),
        (String::new(), &["line"]),
        ("[1, 2".to_owned(), &["line 1"]),
    ];
    let path = clip.path();
    let path = path.to_str().unwrap();
    for (text, words) in cases {
        fs::write(folder.path().join("events.json"), text).unwrap();
        let words = [&["events.json"], words].concat();
        sabaki(folder.path(), &bake(path, &["--events", "events.json"])).is_refused(&words);
    }
    // The same frames twice: the clip and the times, not the folder of clips.
    let twice = event(&name, "evasion", 0.25, 0.5);
    let twice = twice.replace(
        "[{\"kind\"",
        "[{\"kind\":\"evasion\",\"start\":0.25,\"end\":0.5},{\"kind\"",
    );
    fs::write(folder.path().join("twice.json"), twice).unwrap();
    let times = "two events of one kind in the same frames, from 0.25 s to 0.5 s";
    let told = sabaki(folder.path(), &bake(clips, &["--events", "twice.json"]));
    told.is_refused(&["twice.json: ", &name, times]);
    let long = PLAIN.replace("0.0333", "70");
    fs::write(folder.path().join("long.bvh"), long).unwrap();
    fs::write(
        folder.path().join("long.json"),
        event("long.bvh", "evasion", 1.0, 63.0),
    )
    .unwrap();
    let told = sabaki(folder.path(), &bake("long.bvh", &["--events", "long.json"]));
    told.is_refused(&["long.json: \"long.bvh\", event 0 of all: ", "60 s"]);
    sabaki(folder.path(), &bake(path, &["--events", "none.json"])).is_refused(&["none.json"]);
    sabaki(folder.path(), &["dodge", "--events", "events.json"]).is_refused(&["--events"]);
}

#[test]
fn baked_graphs_that_are_damaged() {
    let folder = folder();
    let whole = fs::read(baked()).unwrap();
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    let mut later = whole.clone();
    later[8] += 1;
    let cases: [(&str, &[u8], &str); 5] = [
        ("flipped.sabaki", &flipped, "damaged"),
        ("cut.sabaki", &whole[..whole.len() / 2], "damaged"),
        ("head.sabaki", &whole[..10], "damaged"),
        ("later.sabaki", &later, "version"),
        ("empty.sabaki", &[], "not a baked graph"),
    ];
    for (name, bytes, word) in cases {
        fs::write(folder.path().join(name), bytes).unwrap();
        sabaki(folder.path(), &["dodge", name]).is_refused(&[name, word]);
        if !bytes.is_empty() {
            sabaki(folder.path(), &["inspect", name]).is_refused(&[name, word]);
        }
    }
    sabaki(folder.path(), &["dodge", "none.sabaki"]).is_refused(&["none.sabaki"]);
    sabaki(folder.path(), &["dodge", "."]).is_refused(&["."]);
    if Path::new("/dev/zero").exists() {
        sabaki(folder.path(), &["dodge", "/dev/zero"]).is_refused(&["/dev/zero"]);
    }
}

#[test]
fn attacks_that_are_none() {
    let folder = folder();
    let key = |t: &str, x: &str, radius: &str| {
        format!(r#"{{"t":{t},"center":[{x},0.9,0],"radius":{radius}}}"#)
    };
    let file = |keys: &str| format!(r#"{{"attacks":[{{"spheres":[{keys}]}}]}}"#);
    let twice = key("1", "0", "0.1");
    let cases: [(String, &[&str]); 9] = [
        (r#"{"attacks":[]}"#.to_owned(), &["no attack"]),
        (file(""), &["attack 0"]),
        (file(&key("-1", "0", "0.1")), &["attack 0", "key 0"]),
        (file(&key("601", "0", "0.1")), &["attack 0", "key 0"]),
        (file(&key("1", "1e30", "0.1")), &["attack 0", "key 0"]),
        (file(&key("1", "0", "0")), &["attack 0", "key 0"]),
        (file(&key("1", "0", "1e300")), &["attack"]),
        (file(&format!("{twice},{twice}")), &["attack 0", "key 1"]),
        (file(&key("NaN", "0", "1")), &["line 1"]),
    ];
    for (text, words) in cases {
        fs::write(folder.path().join("attack.json"), text).unwrap();
        let words = [&["attack.json"], words].concat();
        let args = ["dodge", baked(), "--attack", "attack.json"];
        sabaki(folder.path(), &args).is_refused(&words);
    }
}

#[test]
fn files_of_bakes_that_are_no_motions() {
    let folder = folder();
    let graph = baked();
    let cases: [&[&str]; 5] = [
        &["lod", graph],
        &["crowd", graph],
        &["annotate", "--clips", graph],
        &bake(graph, &[]),
        &bake(graph, &["--keep-going"]),
    ];
    for args in cases {
        sabaki(folder.path(), args).is_refused(&[graph, "a baked graph", "not a motion file"]);
    }
    let clips = clips().0;
    let told = sabaki(folder.path(), &bake(clips, &[graph, "missing.bvh"]));
    told.is_refused(&[graph, "a baked graph", "not a motion file"]);
    let said = format!("{graph}: this is a baked graph, and not a motion file (BVH, AMC or glTF)");
    let annotate = [
        "annotate",
        "--clips",
        clips,
        graph,
        "--keep-going",
        "--json",
    ];
    for args in [
        &bake(clips, &[graph, "--keep-going", "--json"])[..],
        &annotate,
    ] {
        let left_out = &sabaki(folder.path(), args).json(3)["left_out"];
        assert_eq!(*left_out, serde_json::json!([said]), "{args:?}");
    }
}

#[test]
fn places_that_cannot_be_written_to() {
    let folder = folder();
    let (clips, events) = clips();
    fs::write(folder.path().join("file"), "this is a file, and no folder").unwrap();
    fs::create_dir(folder.path().join("a_folder")).unwrap();
    for out in ["file/g.sabaki", "no/such/folder/g.sabaki", "a_folder"] {
        let args = ["bake", "--clips", clips, "--events", events, "--out", out];
        sabaki(folder.path(), &args).is_refused(&[out]);
    }
    for export in ["file", "file/x.txt"] {
        let args = ["dodge", baked(), "--export", export];
        let words = format!("--export {export}: file is not a folder");
        sabaki(folder.path(), &args).is_refused(&[&words]);
    }
    for command in ["compare", "coverage"] {
        let option = if command == "compare" {
            "--plot"
        } else {
            "--png"
        };
        let args = [command, baked(), "--attacks", "1", option, "file/x.png"];
        sabaki(folder.path(), &args).is_refused(&["file/x.png"]);
    }
    fs::write(folder.path().join("out"), "the demo needs this name").unwrap();
    sabaki(folder.path(), &[]).is_refused(&["out is not a folder"]);
    assert_eq!(
        text_of(&folder.path().join("out")),
        "the demo needs this name"
    );
    let left = fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(left, 3, "a part of a file was left behind");
}

#[test]
fn words_that_it_does_not_know() {
    let folder = folder();
    let cases: [&[&str]; 17] = [
        &["dance"],
        &["dodge", "--cull", "raster"],
        &["dodge", "--cull", "cpu,guess"],
        &["dodge", "--grid", "maybe"],
        &["dodge", "--lookup", "furthest"],
        &["dodge", "--explain", "-1"],
        &["dodge", "--all"],
        &["dodge", "--replay", "x.json", "--grid", "off"],
        &["compare", "--settings", "--plot", "x.png"],
        &["compare", "--attacks", "0"],
        &["coverage", "--directions", "1"],
        &["dodge", "--attacks", "0"],
        &["dodge", "--attacks", "-3"],
        &["dodge", "--seed", "x"],
        &["inspect"],
        &["bake", "--clips", "x.bvh"],
        &["bake", "--out", "x", "--wrong"],
    ];
    for args in cases {
        let ended = sabaki(folder.path(), args);
        assert_eq!(ended.code, 2, "{args:?}");
        assert!(ended.stdout.is_empty() && !ended.stderr.contains("panicked"));
        assert!(ended.stderr.contains("Usage") || ended.stderr.contains("--help"));
    }
    let with_threads: [&[&str]; 7] = [
        &["crowd"],
        &["dodge"],
        &["coverage"],
        &["duel"],
        &["play"],
        &["bake", "shard", "no_plan", "0"],
        &["bake", "entries", "no_plan", "0"],
    ];
    for command in with_threads {
        let args = [command, &["--threads", "1025"]].concat();
        let ended = sabaki(folder.path(), &args);
        assert_eq!(ended.code, 2, "{command:?}");
        assert!(ended.stderr.contains("0..=1024"), "{}", ended.stderr);
    }
    // What refuses a negative number is the range, and not that it looks like an option.
    for args in [
        ["dodge", "--attacks", "-1"],
        ["compare", "--attacks", "-1"],
        ["crowd", "--count", "-1"],
    ] {
        let ended = sabaki(folder.path(), &args);
        assert_eq!(ended.code, 2, "{args:?}");
        assert!(ended.stderr.contains("is not in 1..="), "{}", ended.stderr);
        assert!(!ended.stderr.contains("-- -1"), "{}", ended.stderr);
    }
    sabaki(folder.path(), &["bake", "--out", "x"]).is_refused(&["--clips"]);
    for speed in ["0", "nan"] {
        let told = sabaki(folder.path(), &["coverage", "--speed", speed]);
        told.is_refused(&["--speed"]);
    }
    let both = ["dodge", "x.sabaki", "--clips", "x.bvh"];
    sabaki(folder.path(), &both).is_refused(&["--clips"]);
    for args in [["--help"], ["--version"]] {
        assert!(!sabaki(folder.path(), &args).is(0).stdout.is_empty());
    }
}

#[test]
fn a_negative_number_is_refused_with_the_option_and_its_range() {
    let folder = folder();
    let dodge = ["render", "dodge", "--out", "x.png"];
    let cases: [(&[&str], &[&str], &str); 12] = [
        (&["dodge"], &["--seed"], "0..="),
        (&["compare"], &["--seed"], "0..="),
        (&["coverage"], &["--seed"], "0..="),
        (&["duel"], &["--seed"], "0..="),
        (&["play"], &["--seed"], "0..="),
        (&["crowd"], &["--seed"], "0..="),
        (&dodge, &["--seed"], "0..="),
        (&dodge, &["--index"], "0..="),
        (&["bake", "plan", "--out", "x"], &["--shards"], "1..=100000"),
        (&["bake", "shard", "no_plan"], &[], "0..=99999"),
        (&["bake", "entries", "no_plan"], &[], "0..=99999"),
        (&["dodge"], &["--threads"], "0..=1024"),
    ];
    for (command, option, range) in cases {
        for number in ["-1", "-170141183460469231731687303715884105729"] {
            let args = [command, option, &[number]].concat();
            let ended = sabaki(folder.path(), &args);
            assert_eq!(ended.code, 2, "{args:?}");
            let name = option.first().unwrap_or(&"<I>");
            for words in [name, &*format!("{number} is not in {range}")] {
                assert!(ended.stderr.contains(words), "{args:?}: {}", ended.stderr);
            }
        }
    }
    #[cfg(feature = "window")]
    for (option, range) in [("--seed", "0..="), ("--frames", "1..=")] {
        let ended = sabaki(folder.path(), &["view", option, "-1"]);
        assert_eq!(ended.code, 2, "{option}");
        for words in [option, &*format!("-1 is not in {range}")] {
            assert!(ended.stderr.contains(words), "{option}: {}", ended.stderr);
        }
    }
    // The largest seed is one.
    let most = u64::MAX.to_string();
    let args = ["dodge", "none.sabaki", "--seed", &most];
    sabaki(folder.path(), &args).is_refused(&["none.sabaki"]);
}
