//! What is refused, in one line with the file and the place in it, before any work is done or any file is touched. What is wrong in
//! files is tested with their parsers; here stands one file of each kind.

use std::fs;
use std::path::Path;
use std::process::Command;

use super::run::{baked, clips, folder, sabaki, text_of, write};

/// Two joints of one name, one of which turns about Z three times; more frames than are stated.
const DOUBTFUL: &str = "HIERARCHY\nROOT arm\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Zrotation Zrotation\nJOINT arm\n{\nOFFSET 0 1 0\nCHANNELS 3 Zrotation Xrotation Zrotation\nEnd Site\n{\nOFFSET 0 0.7 0\n}\n}\n}\nMOTION\nFrames: 1\nFrame Time: 0.033\n0 0 0 0 0 0\n0 0 0 0 0 0\n0 0 0 0 0 0\n";

#[test]
fn a_file_of_each_kind_that_is_wrong() {
    let folder = folder();
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
    let whole = fs::read(baked()).unwrap();
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    let mut later = whole.clone();
    later[8] += 1;
    write("cut.bvh", b"HIERARCHY\nROOT Hips\n{\n");
    write("plain.bvh", DOUBTFUL.as_bytes());
    write("bad.glb", b"glTF\x02\0\0\0\0\0");
    write(
        "events.json",
        br#"{"clips":[{"file":"nobody.bvh","events":[]}"#,
    );
    write("attack.json", br#"{"attacks":[{"spheres":[]}]}"#);
    write("flipped.sabaki", &flipped);
    write("later.sabaki", &later);
    write("empty.sabaki", b"");
    write("empty.gltf", b"");
    write("steering", b"");
    let cases: [(&str, &[&str]); 15] = [
        ("inspect cut.bvh", &["cut.bvh", "line"]),
        ("inspect none.bvh", &["none.bvh"]),
        ("inspect .", &["."]),
        ("lod bad.glb", &["bad.glb: the GLB container"]),
        ("dodge flipped.sabaki", &["flipped.sabaki", "damaged"]),
        ("dodge later.sabaki", &["later.sabaki", "version"]),
        ("dodge empty.sabaki", &["empty.sabaki", "not a baked graph"]),
        ("dodge none.sabaki", &["none.sabaki"]),
        (
            "dodge BAKED --attack attack.json",
            &["attack.json", "attack 0"],
        ),
        ("bake --clips plain.bvh --out g.sabaki", &["plain.bvh"]),
        (
            "bake --clips CLIPS --events events.json --out g.sabaki",
            &["events.json", "line 1"],
        ),
        ("lod BAKED", &["a baked graph", "not a motion file"]),
        ("crowd attack.json", &["attack.json: not a motion file"]),
        ("inspect empty.gltf", &["neither a GLB container nor"]),
        ("play BAKED --record .", &["./steering: "]),
    ];
    for (args, words) in cases {
        sabaki(&folder, args).is_refused(words);
    }
    let all = "bake cut.bvh bad.glb --out g.sabaki";
    sabaki(&folder, all).is_misused(&["cut.bvh", "bad.glb", "2 of 2 files", "see --retarget"]);
    assert!(!folder.path().join("g.sabaki").exists());
}

#[test]
fn words_and_numbers_that_it_does_not_know() {
    let folder = folder();
    for (args, word) in [
        ("dance", "Usage"),
        ("bake --clips x.bvh", "--out"),
        ("dodge --cull cpu,guess", "stencil"),
        ("dodge --grid maybe", "on, off"),
        ("dodge --replay x.json --grid off", "--grid"),
        ("dodge --explain 1 --check", "--check"),
        ("coverage --by-time --speed 2", "--by-time"),
        ("dodge --attacks 0", "0 is not in 1..=1000000"),
        ("dodge --seed -1", "-1 is not in 0..="),
        ("dodge --threads 1025", "0..=1024"),
        ("crowd --error NaN", "must be 0.001 to"),
        ("coverage --directions 1", "2..=36"),
        ("duel --apart 1000", "must be 0.3 to 6"),
        ("lod --error 1 --vanish 2", "--vanish"),
        ("lod --export x.bvh", "end in .glb"),
        ("render dodge --out a.bmp", "end in .png"),
        ("render dodge --out no/a.png", "no folder no"),
        ("render dodge --out a.png --size 9x9", "640x400"),
        ("inspect a.amc --up w", "up is x, y or z"),
        ("compare BAKED --paper --plot plot.png", "--plot"),
    ] {
        sabaki(&folder, args).is_misused(&[word]);
    }
    for (args, word) in [
        ("--validation crowd", "--validation"),
        ("lod --lock Tail", "the skeleton has no joint \"Tail\""),
        ("lod --masses none.json", "none.json"),
        ("render crowd --out a.png --motion fly", "front_kick"),
        (
            "render dodge BAKED --out a.png --device none_such",
            "none_such",
        ),
        (
            "annotate --clips CLIPS --against EVENTS --out EVENTS",
            "overwrite",
        ),
    ] {
        sabaki(&folder, args).is_refused(&[word]);
    }
    // The largest seed is one.
    let most = u64::MAX.to_string();
    let args = format!("dodge none.sabaki --seed {most}");
    sabaki(&folder, &args).is_refused(&["none.sabaki"]);
    for args in ["--help", "--version"] {
        assert!(!sabaki(&folder, args).is(0).stdout.is_empty());
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn places_that_cannot_be_written_to() {
    let folder = folder();
    write(&folder, "file", "this is a file, and no folder");
    fs::create_dir(folder.path().join("a_folder")).unwrap();
    for out in ["file/g.sabaki", "no/such/folder/g.sabaki", "a_folder"] {
        let args = format!("bake --clips CLIPS --out {out}");
        sabaki(&folder, &args).is_refused(&[out]);
    }
    for export in ["file", "file/x.txt"] {
        let args = format!("dodge BAKED --export {export}");
        let words = format!("--export {export}: file is not a folder");
        sabaki(&folder, &args).is_refused(&[&words]);
    }
    write(&folder, "out", "the demo needs this name");
    sabaki(&folder, "").is_refused(&["out is not a folder"]);
    let own = text_of(&folder.path().join("out"));
    assert_eq!(own, "the demo needs this name");
    let left = fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(left, 3, "a part of a file was left behind");
}

/// Reading from a pipe without a writer would never end.
#[cfg(unix)]
#[test]
fn a_named_pipe_is_no_input() {
    let folder = folder();
    for name in ["pipe", "pipe.bvh", "pipe.glb", "pipe.obj", "pipe.json"] {
        let made = Command::new("mkfifo")
            .arg(folder.path().join(name))
            .status();
        assert!(made.unwrap().success());
    }
    let words = |name| ["not a regular file", name];
    for name in ["pipe", "pipe.bvh", "pipe.glb"] {
        sabaki(&folder, &format!("inspect {name}")).is_refused(&words(name));
        sabaki(&folder, &format!("lod {name}")).is_refused(&words(name));
    }
    sabaki(&folder, "dodge pipe").is_refused(&words("pipe"));
    for [option, name] in [["--events", "pipe.json"], ["--body", "pipe.obj"]] {
        let args = format!("bake --clips CLIPS {option} {name} --out g.sabaki");
        sabaki(&folder, &args).is_refused(&words(name));
    }
}

#[test]
fn an_input_is_not_overwritten() {
    let folder = folder();
    let clip = fs::read_dir(clips().0).unwrap().flatten().next().unwrap();
    fs::create_dir(folder.path().join("in")).unwrap();
    let copy = folder.path().join("in/a.bvh");
    fs::copy(clip.path(), &copy).unwrap();
    let before = text_of(&copy);
    for [input, out] in [["in/a.bvh", "in/a.bvh"], ["in", "in/../in/a.bvh"]] {
        let args = format!("bake --clips {input} --out {out}");
        sabaki(&folder, &args).is_refused(&["--out", "a.bvh", "overwrite"]);
    }
    assert_eq!(text_of(&copy), before);
    // Other files of the folder may be overwritten.
    for _ in 0..2 {
        let args = "lod in --plot in/lod.png";
        sabaki(&folder, args).is(0);
    }
}

#[test]
fn answers_are_not_written_over_those_of_an_earlier_run() {
    let folder = folder();
    let args = "dodge BAKED --cull cpu --export out";
    let dodge = |more: &str| sabaki(&folder, &format!("{args} {more}"));
    dodge("--attacks 1").is(0);
    let before = text_of(&folder.path().join("out/attack_0000.json"));
    dodge("--attacks 1 --seed 2").is_refused(&["--export out", "attack_0000"]);
    let after = text_of(&folder.path().join("out/attack_0000.json"));
    assert_eq!(before, after);
    // One more goes beside it.
    dodge("--explain 1").is(0);
    dodge("--explain 1").is_refused(&["attack_0001"]);
}

#[test]
fn a_folder_with_unreadable_files_is_baked_only_if_asked_for() {
    let folder = folder();
    let (from, to) = (Path::new(clips().0), folder.path().join("in"));
    fs::create_dir(&to).unwrap();
    for name in ["bounce.bvh", "duck.bvh"] {
        fs::copy(from.join(name), to.join(name)).unwrap();
    }
    for name in ["broken.bvh", "empty.bvh"] {
        write(folder.path().join("in"), name, "HIERARCHY\n");
    }
    let bake = "--json bake --clips in --out g.sabaki";
    let refused = sabaki(&folder, bake);
    assert_eq!(refused.code, 2, "{}", refused.stderr);
    assert_eq!(refused.stderr.lines().count(), 3, "{}", refused.stderr);
    for name in ["broken.bvh: ", "empty.bvh: ", "2 of "] {
        assert!(refused.stderr.contains(name), "{}", refused.stderr);
    }
    assert!(!folder.path().join("g.sabaki").exists());
    let kept = sabaki(&folder, &format!("{bake} --keep-going"));
    let document = kept.json(3);
    assert_eq!(document["report"]["clips"], 2);
    assert_eq!(document["left_out"].as_array().unwrap().len(), 2);
    assert!(folder.path().join("g.sabaki").exists());
    // Those that a bake wrote count as such, too.
    let args = "annotate --clips CLIPS BAKED --keep-going --json";
    let left_out = sabaki(&folder, args).json(3)["left_out"][0].to_string();
    assert!(left_out.contains("this is a baked graph"), "{left_out}");
}

#[test]
fn doubtful_files_are_noted() {
    let folder = folder();
    write(&folder, "a.bvh", DOUBTFUL);
    let document = sabaki(&folder, "inspect a.bvh --json").json(0);
    let notes = document["notes"].as_array().unwrap().iter();
    let notes: Vec<&str> = notes.map(|note| note.as_str().unwrap()).collect();
    assert_eq!(notes.len(), 3, "{notes:?}");
    for words in ["has 3", "several joints", "\"arm\" turns about one axis"] {
        assert!(notes.iter().any(|note| note.contains(words)), "{notes:?}");
    }
    let told = sabaki(&folder, "inspect a.bvh").is(0);
    for note in notes {
        assert!(told.stdout.contains(note), "{note}");
    }
    let told = sabaki(&folder, "inspect a.bvh --scale 1e5").is(0);
    let note = "note: the figure is 170000.00 m high";
    assert!(told.stdout.contains(note), "{}", told.stdout);
    sabaki(&folder, "inspect a.bvh --scale 0").is_refused(&["metres per unit", "1e-9 to 1e6"]);
}
