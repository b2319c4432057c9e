//! Options that would have no effect are refused before any work is done, and so are files that cannot be written.

use std::fs;

use super::run::{baked, clips, folder, sabaki};

const ATTACK: &str = r#"{"attacks":[{"spheres":[{"t":1,"center":[0,1,0],"radius":0.1}]}]}"#;

#[test]
fn options_of_another_scene_or_kind_of_file_are_refused_by_render() {
    let folder = folder();
    let refused = |scene: &str, more: &[&str], words: &[&str]| {
        let args = [&["render", scene, "--out", "a.png"], more].concat();
        sabaki(folder.path(), &args).is_refused(words);
    };
    refused("crowd", &["no.sabaki"], &["render crowd", "no.sabaki"]);
    refused("crowd", &["--clips", "no.bvh"], &["render crowd", "no.bvh"]);
    for option in ["--attack", "--seed", "--index", "--at", "--contact"] {
        let given = [option, "1"];
        for scene in ["crowd", "body"] {
            let words = [option, "only for render dodge", scene];
            refused(scene, &given, &words);
        }
    }
    for option in ["--storyboard", "--maps", "--regions", "--no-ghost"] {
        refused("body", &[option], &[option]);
    }
    for scene in ["dodge", "body"] {
        refused(
            scene,
            &["--count", "5"],
            &["--count", "only for render crowd", scene],
        );
        refused(scene, &["--levels"], &["--levels"]);
    }
    let others = "only for render dodge and render crowd";
    refused("body", &["--rate", "5"], &["--rate", others]);
    refused("body", &["--plain"], &["--plain", others]);
    for scene in ["dodge", "crowd"] {
        refused(scene, &["--rate", "5"], &["--rate", "a.png", ".gif"]);
    }
    let duel = ["duel", "no.sabaki", "--out", "d.png", "--rate", "5"];
    sabaki(folder.path(), &duel).is_refused(&["--rate", "d.png", ".gif"]);
    let film = ["render", "dodge", "--out", "d.gif"];
    let of_film = |more: &[&str]| sabaki(folder.path(), &[&film[..], more].concat());
    of_film(&["--storyboard"]).is_refused(&["--storyboard", "d.gif", ".png"]);
    of_film(&["--at", "0.5"]).is_refused(&["--at", "d.gif", ".png"]);
    for moment in ["nan", "inf", "601"] {
        let told = of_film(&["--at", moment]);
        assert!(
            told.code == 2 && told.stderr.contains("-600 to 600 s"),
            "{}",
            told.stderr
        );
    }
    let map = ["--mesh", "body", "--map", "no.json"];
    of_film(&map).is_refused(&["--map no.json", "--mesh is body"]);
    let out = ["render", "dodge", "--out", "no/d.gif"];
    sabaki(folder.path(), &out).is_refused(&["--out no/d.gif", "no folder no"]);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// The window would not open here, and the graph does not exist: neither is looked for.
#[test]
fn options_of_another_scene_and_files_that_cannot_be_written_are_refused_by_view() {
    let folder = folder();
    let refused = |args: &[&str], words: &[&str]| {
        sabaki(folder.path(), &[&["view"], args].concat()).is_refused(words);
    };
    refused(&["--crowd", "no.sabaki"], &["view --crowd", "no.sabaki"]);
    refused(
        &["--crowd", "--clips", "no.bvh"],
        &["view --crowd", "no.bvh"],
    );
    refused(&["--crowd", "--seed", "2"], &["view --crowd", "--seed"]);
    for scene in ["--crowd", "--duel", "--drive"] {
        for option in [
            &["--cull", "cpu"][..],
            &["--no-grid"],
            &["--delay", "1"],
            &["--click", "0.5,0.5,1"],
        ] {
            refused(&[&[scene], option].concat(), &[scene, option[0]]);
        }
    }
    let last = ["no.sabaki", "--frames", "9", "--screenshot"];
    let shot = |file| [&last[..], &[file]].concat();
    refused(
        &shot("no/a.png"),
        &["--screenshot no/a.png", "no folder no"],
    );
    refused(&shot("a.jpg"), &["--screenshot a.jpg", ".png"]);
    for (option, value, words) in [
        ("--samples", "3", "1, 2, 4 or 8"),
        ("--samples", "0", "1, 2, 4 or 8"),
        ("--click", "0.5,x,0.4,1.2", "X,Y,SECONDS"),
        ("--click", "0.5,0.4,nan", "X,Y,SECONDS"),
        ("--click", "0.5,0.4,-1", "X,Y,SECONDS"),
    ] {
        let given = format!("{option}={value}");
        let told = sabaki(folder.path(), &["view", "no.sabaki", &given]);
        assert_eq!(told.code, 2, "{given}");
        assert!(told.stderr.contains(words), "{given}: {}", told.stderr);
    }
}

#[test]
fn options_of_random_attacks_and_of_clips_are_refused_without_them() {
    let folder = folder();
    fs::write(folder.path().join("f.json"), ATTACK).unwrap();
    for more in [["--attacks", "2"], ["--seed", "2"]] {
        let args = [&["dodge", baked(), "--attack", "f.json"], &more[..]].concat();
        let told = sabaki(folder.path(), &args);
        assert_eq!(told.code, 2, "{more:?}");
        assert!(
            told.stderr.contains("cannot be used with"),
            "{}",
            told.stderr
        );
    }
    for option in [
        "--scale",
        "--up",
        "--amc-rate",
        "--fit-cover",
        "--fit-bulge",
    ] {
        let value = if option == "--up" { "z" } else { "1" };
        let told = sabaki(folder.path(), &["dodge", "no.sabaki", option, value]);
        assert!(
            told.code == 2 && told.stderr.contains("--clips"),
            "{}",
            told.stderr
        );
    }
    let told = sabaki(
        folder.path(),
        &["annotate", "--clips", "no.bvh", "--min-confidence", "50"],
    );
    assert!(
        told.code == 2 && told.stderr.contains("share from 0 to 1"),
        "{}",
        told.stderr
    );
}

#[test]
fn options_of_reading_are_refused_where_no_such_file_is_read() {
    let folder = folder();
    let (clips, events) = clips();
    let clip = fs::read_dir(clips).unwrap().next().unwrap().unwrap().path();
    let clip = clip.to_str().unwrap();
    for file in [baked(), events] {
        for [option, value] in [["--up", "z"], ["--scale", "2"], ["--amc-rate", "30"]] {
            let args = ["inspect", file, option, value];
            sabaki(folder.path(), &args).is_refused(&[option, "needs a motion file"]);
        }
    }
    let of_bvh: [&[&str]; 5] = [
        &["inspect", clip],
        &["lod", clips],
        &["annotate", "--clips", clips],
        &["bake", "--clips", clips, "--out", "g.sabaki"],
        &["dodge", "--clips", clip],
    ];
    for args in of_bvh {
        let args = [args, &["--amc-rate", "30"]].concat();
        sabaki(folder.path(), &args).is_refused(&["--amc-rate needs an AMC file"]);
    }
}

#[test]
fn options_of_the_other_switch_and_of_threads_are_refused() {
    let folder = folder();
    let of_error: [&[&str]; 3] = [
        &["--error", "50"],
        &["--error", "nan"],
        &["--measure", "mean"],
    ];
    for options in of_error {
        let args = [&["lod"], options].concat();
        let words = format!("{} needs --switch error", options[0]);
        sabaki(folder.path(), &args).is_refused(&[&words]);
    }
    let args = ["lod", "--switch", "error", "--vanish", "100"];
    sabaki(folder.path(), &args).is_refused(&["--vanish needs --switch energy"]);
    for paths in ["stencil", "compute,stencil"] {
        let args = ["dodge", "no.sabaki", "--threads", "4", "--cull", paths];
        sabaki(folder.path(), &args).is_refused(&["--threads needs a path of --cull"]);
    }
}

#[test]
fn options_of_a_body_mesh_are_refused_with_spheres() {
    let folder = folder();
    for (option, value) in [
        ("--body-scale", "=1"),
        ("--body-pose", "=a.bvh:0"),
        ("--body-stand", ""),
    ] {
        let given = format!("{option}{value}");
        let args = [
            "bake",
            "--clips",
            "no.bvh",
            "--out",
            "g",
            "--body",
            "body.json",
            &given,
        ];
        sabaki(folder.path(), &args).is_refused(&[option, "body.json", ".obj"]);
    }
}

#[test]
fn an_attack_file_in_the_folder_of_answers_is_neither_removed_nor_overwritten() {
    let folder = folder();
    fs::create_dir(folder.path().join("out")).unwrap();
    let own = folder.path().join("out/attack_0007.json");
    fs::write(&own, ATTACK).unwrap();
    for export in ["out", "out/../out"] {
        for more in [&[][..], &["--force"]] {
            let args = [
                "dodge",
                baked(),
                "--attack",
                "out/attack_0007.json",
                "--export",
                export,
            ];
            let told = sabaki(folder.path(), &[&args[..], more].concat());
            told.is_refused(&["--export", "attack_0007.json", "another folder"]);
        }
    }
    assert_eq!(fs::read_to_string(&own).unwrap(), ATTACK);
    assert_eq!(fs::read_dir(folder.path().join("out")).unwrap().count(), 1);
}

#[test]
fn a_device_that_cannot_be_opened_is_refused() {
    let folder = folder();
    for command in ["dodge", "compare"] {
        let args = [
            command,
            "no.sabaki",
            "--attacks",
            "1",
            "--device",
            "no such one",
        ];
        sabaki(folder.path(), &args).is_refused(&["--device no such one"]);
    }
}

#[test]
fn a_device_is_refused_where_none_is_used() {
    let folder = folder();
    let without: [(&[&str], &str); 11] = [
        (&["bake", "--clips", "no.bvh", "--out", "g.sabaki"], "bake"),
        (&["bake", "join", "no_plan", "--out", "g.sabaki"], "bake"),
        (&["annotate", "--clips", "no.bvh"], "annotate"),
        (&["coverage", "no.sabaki"], "coverage"),
        (&["lod"], "lod"),
        (&["crowd"], "crowd"),
        (&["play", "no.sabaki"], "play"),
        (&["inspect", baked()], "inspect"),
        (&["duel", "no.sabaki"], "duel without --out"),
        (
            &["compare", "no.sabaki", "--settings"],
            "compare --settings",
        ),
        (&["dodge", "--replay", "no.json"], "dodge --replay"),
    ];
    for (command, name) in without {
        for option in [&["--device", "no such one"][..], &["--validation"]] {
            let args = [command, option].concat();
            let words = [option[0], &format!("{name} uses none")];
            sabaki(folder.path(), &args).is_refused(&words);
        }
    }
}

/// The clips do not exist: what is wrong is said before they are looked for.
#[test]
fn a_file_that_cannot_be_written_is_refused_before_the_work() {
    let folder = folder();
    fs::create_dir(folder.path().join("there")).unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    let refused = |more: &[&str], words: &[&str]| {
        let args = [&["bake", "--clips", "no.bvh"], more].concat();
        sabaki(folder.path(), &args).is_refused(words);
    };
    refused(
        &["--out", "no/g.sabaki"],
        &["--out no/g.sabaki", "no folder no"],
    );
    refused(
        &["--out", "file/g.sabaki"],
        &["--out file/g.sabaki", "no folder file"],
    );
    refused(&["--out", "there"], &["--out there", "a folder"]);
    let plot = ["--out", "g.sabaki", "--plot", "no/p.png"];
    refused(&plot, &["--plot no/p.png", "no folder no"]);
    let join = ["bake", "join", "no_plan", "--out", "no/g.sabaki"];
    sabaki(folder.path(), &join).is_refused(&["--out no/g.sabaki"]);
    let events = ["annotate", "--clips", "no.bvh", "--out", "no/e.json"];
    sabaki(folder.path(), &events).is_refused(&["--out no/e.json"]);
}
