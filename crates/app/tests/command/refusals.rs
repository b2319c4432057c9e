//! What is refused before any work is done or any file is touched.

use std::fs;
use std::process::Command;

use super::run::{baked, clips, folder, sabaki, text_of};

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
        sabaki(folder.path(), &["inspect", name]).is_refused(&words(name));
        sabaki(folder.path(), &["lod", name]).is_refused(&words(name));
    }
    sabaki(folder.path(), &["dodge", "pipe"]).is_refused(&words("pipe"));
    let with = |option, name| {
        let args = [
            "bake",
            "--clips",
            clips().0,
            option,
            name,
            "--out",
            "g.sabaki",
        ];
        sabaki(folder.path(), &args).is_refused(&words(name));
    };
    with("--events", "pipe.json");
    with("--body", "pipe.obj");
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
        let args = ["bake", "--clips", input, "--out", out];
        sabaki(folder.path(), &args).is_refused(&["--out", "a.bvh", "overwrite"]);
        let args = ["lod", input, "--export", out];
        sabaki(folder.path(), &args).is_refused(&["--export", "a.bvh", "overwrite"]);
    }
    assert_eq!(text_of(&copy), before);
    // Other files of the folder may be overwritten.
    for _ in 0..2 {
        let args = ["lod", "in", "--plot", "in/lod.png"];
        sabaki(folder.path(), &args).is(0);
    }
}

#[test]
fn an_attack_that_is_not_thrown_is_not_explained() {
    let folder = folder();
    let args = [
        "dodge",
        baked(),
        "--cull",
        "cpu",
        "--attacks",
        "5",
        "--explain",
    ];
    let explain = |index| sabaki(folder.path(), &[&args[..], &[index]].concat());
    explain("4").is(0);
    explain("5").is_refused(&["--explain 5", "0 to 4"]);
    explain("7").is_refused(&["--explain 7", "0 to 4"]);
}

/// The graph does not exist: what is wrong is said before it is looked for.
#[test]
fn fighters_too_far_apart_are_refused_before_the_work() {
    let folder = folder();
    for apart in ["1000", "nan", "0.1"] {
        let args = ["duel", "no_such.sabaki", "--apart", apart];
        sabaki(folder.path(), &args).is_refused(&["--apart", "0.3 to 6 metres"]);
    }
}

#[test]
fn answers_of_an_earlier_run_do_not_stay_beside_new_ones() {
    let folder = folder();
    let dodge = |attacks, more: &[&str]| {
        let args = [
            "dodge",
            baked(),
            "--cull",
            "cpu",
            "--attacks",
            attacks,
            "--export",
            "out",
        ];
        sabaki(folder.path(), &[&args[..], more].concat())
    };
    let names = || {
        let entries = fs::read_dir(folder.path().join("out")).unwrap().flatten();
        let mut names: Vec<String> = entries
            .map(|entry| entry.file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    };
    dodge("2", &[]).is(0);
    // Somebody's own files.
    for name in ["attack_notes.json", "attack_12.json", "notes.bvh"] {
        fs::write(folder.path().join("out").join(name), "mine").unwrap();
    }
    let before = names();
    dodge("1", &[]).is_refused(&["--export out", "attack_0000", "--force"]);
    assert_eq!(names(), before);
    dodge("1", &["--force", "--format", "glb"]).is(0);
    assert_eq!(
        names(),
        [
            "attack_0000.glb",
            "attack_0000.json",
            "attack_12.json",
            "attack_notes.json",
            "notes.bvh"
        ]
    );
}

#[test]
fn the_label_names_the_paths_that_were_used() {
    let folder = folder();
    for (cull, label) in [
        ("cpu", "culling: on the cpu"),
        ("exact", "culling: none, every candidate is tested"),
        (
            "exact,cpu",
            "culling: none, every candidate is tested; on the cpu",
        ),
    ] {
        let args = ["dodge", baked(), "--attacks", "2", "--cull", cull];
        let done = sabaki(folder.path(), &args).is(0);
        let line = done.stdout.lines().find(|line| line.starts_with("culling"));
        assert!(line.unwrap().starts_with(label), "{cull}: {line:?}");
        assert!(!done.stdout.contains("stencil buffer"), "{}", done.stdout);
    }
}

#[test]
fn a_folder_with_unreadable_files_is_baked_only_if_asked_for() {
    let folder = folder();
    let mut count = 0;
    fs::create_dir(folder.path().join("in")).unwrap();
    for clip in fs::read_dir(clips().0).unwrap().flatten() {
        let name = clip.file_name();
        fs::copy(clip.path(), folder.path().join("in").join(&name)).unwrap();
        count += usize::from(name.to_string_lossy().ends_with(".bvh"));
    }
    for name in ["broken.bvh", "empty.bvh"] {
        fs::write(folder.path().join("in").join(name), "HIERARCHY\n").unwrap();
    }
    let bake = ["--json", "bake", "--clips", "in", "--out", "g.sabaki"];
    let refused = sabaki(folder.path(), &bake);
    assert_eq!(refused.code, 2, "{}", refused.stderr);
    assert_eq!(refused.stderr.lines().count(), 3, "{}", refused.stderr);
    for name in ["broken.bvh: ", "empty.bvh: ", "2 of "] {
        assert!(refused.stderr.contains(name), "{}", refused.stderr);
    }
    assert!(!folder.path().join("g.sabaki").exists());
    let kept = sabaki(folder.path(), &[&bake[..], &["--keep-going"]].concat());
    let document = kept.json(3);
    assert_eq!(document["report"]["clips"], count);
    assert_eq!(document["left_out"].as_array().unwrap().len(), 2);
    assert!(folder.path().join("g.sabaki").exists());
}

#[test]
fn an_error_of_clips_that_is_none_is_refused_by_the_options_name() {
    let folder = folder();
    for error in ["-1", "0.001", "301", "NaN", "much"] {
        let args = [
            "bake",
            "--clips",
            clips().0,
            "--clip-error",
            error,
            "--out",
            "g.sabaki",
        ];
        let refused = sabaki(folder.path(), &args);
        assert_eq!(refused.code, 2, "{}", refused.stderr);
        for word in ["--clip-error", error, "0.01 to 300"] {
            assert!(refused.stderr.contains(word), "{word}: {}", refused.stderr);
        }
    }
}
