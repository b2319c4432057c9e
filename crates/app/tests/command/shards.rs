//! A bake that is divided into shards writes the file of one process to the byte, whatever happens to a shard on the way.

use std::fs;
use std::path::Path;

#[cfg(unix)]
use super::run::command;
use super::run::{baked, clips, folder, sabaki};
use serde_json::Value;

const SHARDS: usize = 5;

/// A plan in the folder `plan`.
fn plan(folder: &Path) -> Value {
    let (clips, events) = clips();
    let shards = SHARDS.to_string();
    let args = [
        "bake", "plan", "--clips", clips, "--events", events, "--out", "plan", "--shards", &shards,
        "--json",
    ];
    sabaki(folder, &args).json(0)
}

fn shard(folder: &Path, index: usize, more: &[&str]) -> Value {
    let index = index.to_string();
    let args = ["bake", "shard", "plan", &index, "--json"];
    sabaki(folder, &[&args[..], more].concat()).json(0)
}

fn entries(folder: &Path, share: usize, more: &[&str]) -> Value {
    let share = share.to_string();
    let args = ["bake", "entries", "plan", &share, "--json"];
    sabaki(folder, &[&args[..], more].concat()).json(0)
}

/// The file that one process writes.
fn in_one_process() -> Vec<u8> {
    fs::read(baked()).unwrap()
}

fn joined(folder: &Path) -> Vec<u8> {
    sabaki(folder, &["bake", "join", "plan", "--out", "joined.sabaki"]).is(0);
    fs::read(folder.join("joined.sabaki")).unwrap()
}

#[test]
fn the_joined_file_is_that_of_one_process() {
    let folder = folder();
    let at = folder.path();
    let document = plan(at);
    assert_eq!(document["shards"], SHARDS);
    let pairs: Vec<u64> = document["window_pairs"]
        .as_array()
        .unwrap()
        .iter()
        .map(|pairs| pairs.as_u64().unwrap())
        .collect();
    let mean = pairs.iter().sum::<u64>() / SHARDS as u64;
    assert!(
        pairs.iter().all(|pairs| pairs.abs_diff(mean) < mean / 2),
        "{pairs:?}"
    );
    // Shards are computed in any order, by any number of threads.
    for (index, threads) in [(3, "1"), (0, "2"), (4, "3"), (1, "0"), (2, "1")] {
        assert_eq!(
            shard(at, index, &["--threads", threads])["was_there"],
            false
        );
    }
    // The join finds the clips from another folder, too.
    let elsewhere = at.join("elsewhere");
    fs::create_dir(&elsewhere).unwrap();
    let args = [
        "bake",
        "join",
        "../plan",
        "--out",
        "joined.sabaki",
        "--json",
    ];
    let report = sabaki(&elsewhere, &args).json(0);
    assert!(report["report"]["window_pairs"].as_u64() == Some(pairs.iter().sum()));
    let expected = in_one_process();
    assert!(fs::read(elsewhere.join("joined.sabaki")).unwrap() == expected);
    // With the tests of entries shared, too.
    let refused = sabaki(at, &["bake", "entries", "plan", "0"]);
    refused.is_refused(&["graph", "missing", "sabaki bake graph plan"]);
    let graph = || sabaki(at, &["bake", "graph", "plan", "--json"]).json(0);
    assert_eq!(graph()["was_there"], false);
    assert_eq!(graph()["was_there"], true);
    for (share, threads) in [(1, "2"), (4, "1"), (0, "3"), (3, "0"), (2, "1")] {
        let args = ["--threads", threads];
        assert_eq!(entries(at, share, &args)["was_there"], false);
        assert_eq!(entries(at, share, &args)["was_there"], true);
    }
    fs::remove_file(elsewhere.join("joined.sabaki")).unwrap();
    let with_entries = sabaki(&elsewhere, &args).json(0);
    assert!(fs::read(elsewhere.join("joined.sabaki")).unwrap() == expected);
    assert_eq!(with_entries["report"], report["report"]);
}

#[test]
fn entries_or_a_graph_that_are_missing_or_damaged_are_named_with_their_command() {
    let folder = folder();
    let at = folder.path();
    plan(at);
    let refused = sabaki(at, &["bake", "graph", "plan"]);
    let first = "sabaki: shard 0 is missing: sabaki bake shard plan 0";
    assert_eq!(
        (refused.code, refused.stderr.lines().next()),
        (2, Some(first))
    );
    (0..SHARDS).for_each(|index| drop(shard(at, index, &[])));
    sabaki(at, &["bake", "graph", "plan"]).is(0);
    (0..SHARDS).for_each(|share| drop(entries(at, share, &[])));
    let expected = joined(at);
    let file = |share: usize| at.join("plan/entries").join(share.to_string());
    let sound = fs::read(file(2)).unwrap();
    fs::remove_file(file(0)).unwrap();
    let mut bytes = sound.clone();
    *bytes.last_mut().unwrap() ^= 4;
    fs::write(file(2), bytes).unwrap();
    fs::write(file(3), &sound).unwrap();
    let refused = sabaki(at, &["bake", "join", "plan", "--out", "never.sabaki"]);
    let expected_words = [
        "entries 0 are missing: sabaki bake entries plan 0",
        "entries 2 are damaged: sabaki bake entries plan 2",
        "entries 3 are damaged: sabaki bake entries plan 3",
        "3 of 5 shards are lacking",
    ];
    let lines = expected_words.map(|words| format!("sabaki: {words}"));
    assert_eq!(
        (refused.code, refused.stderr.trim()),
        (2, &*lines.join("\n"))
    );
    for share in [0, 2, 3] {
        assert_eq!(entries(at, share, &[])["was_there"], false);
    }
    assert!(fs::read(file(2)).unwrap() == sound);
    assert!(joined(at) == expected);
    let graph = at.join("plan/graph");
    let mut bytes = fs::read(&graph).unwrap();
    bytes[100] ^= 1;
    fs::write(&graph, bytes).unwrap();
    let words = ["graph", "damaged", "sabaki bake graph plan"];
    sabaki(at, &["bake", "join", "plan", "--out", "never.sabaki"]).is_refused(&words);
    assert_eq!(
        sabaki(at, &["bake", "graph", "plan", "--json"]).json(0)["was_there"],
        false
    );
    assert!(joined(at) == expected);
}

#[test]
fn a_shard_that_is_missing_or_damaged_is_named_with_its_command() {
    let folder = folder();
    let at = folder.path();
    plan(at);
    let file = |index: usize| at.join("plan/shards").join(index.to_string());
    (0..SHARDS).for_each(|index| drop(shard(at, index, &[])));
    let sound: Vec<Vec<u8>> = (0..SHARDS)
        .map(|index| fs::read(file(index)).unwrap())
        .collect();
    let expected = joined(at);
    fs::remove_file(file(1)).unwrap();
    // A bit that changed, an end that was cut off, and another shard's file.
    let mut bytes = sound[2].clone();
    *bytes.last_mut().unwrap() ^= 4;
    fs::write(file(2), bytes).unwrap();
    fs::write(file(3), &sound[3][..sound[3].len() / 2]).unwrap();
    fs::write(file(4), &sound[0]).unwrap();
    let refused = sabaki(at, &["bake", "join", "plan", "--out", "never.sabaki"]);
    assert_eq!(refused.code, 2, "{}", refused.stderr);
    let expected_words = [
        "shard 1 is missing: sabaki bake shard plan 1",
        "shard 2 is damaged: sabaki bake shard plan 2",
        "shard 3 is damaged: sabaki bake shard plan 3",
        "shard 4 is damaged: sabaki bake shard plan 4",
        "4 of 5 shards are lacking",
    ];
    for (line, words) in refused.stderr.lines().zip(expected_words) {
        assert_eq!(line, format!("sabaki: {words}"));
    }
    assert!(refused.stderr.lines().count() == 5 && !at.join("never.sabaki").exists());
    // What is sound stays; the others are computed again, to the same bytes.
    for (index, sound) in sound.iter().enumerate() {
        assert_eq!(shard(at, index, &[])["was_there"], index == 0);
        assert!(fs::read(file(index)).unwrap() == *sound, "shard {index}");
        assert_eq!(shard(at, index, &[])["was_there"], true);
    }
    assert!(joined(at) == expected);
}

#[test]
fn what_a_killed_shard_leaves_changes_nothing() {
    let folder = folder();
    let at = folder.path();
    plan(at);
    // A process that was killed while it wrote leaves a file beside the shard's.
    fs::write(at.join("plan/shards/0.4711.part"), b"sabakis\nhalf").unwrap();
    (0..SHARDS).for_each(|index| assert_eq!(shard(at, index, &[])["was_there"], false));
    assert!(joined(at) == in_one_process());
}

#[test]
fn shards_of_another_plan_and_changed_inputs_are_refused() {
    let folder = folder();
    let at = folder.path();
    let (clips, events) = clips();
    fs::create_dir(at.join("clips")).unwrap();
    for file in fs::read_dir(clips).unwrap() {
        let file = file.unwrap().path();
        fs::copy(&file, at.join("clips").join(file.file_name().unwrap())).unwrap();
    }
    fs::copy(events, at.join("events.json")).unwrap();
    let plan = |threshold: &str| {
        let args = [
            "bake",
            "plan",
            "--clips",
            "clips",
            "--events",
            "events.json",
            "--shards",
            "1",
        ];
        sabaki(
            at,
            &[&args[..], &["--out", "plan", "--threshold", threshold]].concat(),
        )
        .is(0);
    };
    let join = ["bake", "join", "plan", "--out", "g.sabaki"];
    plan("0.1");
    sabaki(at, &["bake", "shard", "plan", "0"]).is(0);
    plan("0.12");
    let refused = sabaki(at, &join);
    assert!(refused.code == 2 && refused.stderr.contains("shard 0 is of another plan"));
    assert_eq!(shard(at, 0, &[])["was_there"], false);
    sabaki(at, &join).is(0);
    let mut text = fs::read_to_string(at.join("events.json")).unwrap();
    text.push('\n');
    fs::write(at.join("events.json"), text).unwrap();
    sabaki(at, &join).is_refused(&["events.json", "changed since the plan was made"]);
    // The points of a clip.
    let points = at.join("plan/clips/0");
    let mut bytes = fs::read(&points).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    fs::write(&points, bytes).unwrap();
    fs::remove_file(at.join("plan/shards/0")).unwrap();
    sabaki(at, &["bake", "shard", "plan", "0"]).is_refused(&["clips/0", "damaged", "bake plan"]);
}

#[test]
fn steps_without_a_plan_or_a_shard_are_refused() {
    let folder = folder();
    let at = folder.path();
    sabaki(at, &["bake", "shard", "plan", "0"]).is_refused(&["plan.json"]);
    sabaki(at, &["bake", "plan", "--out", "plan"]).is_refused(&["--clips"]);
    plan(at);
    sabaki(at, &["bake", "shard", "plan", "5"]).is_refused(&["shard 5", "0 to 4"]);
    let text = fs::read_to_string(at.join("plan/plan.json")).unwrap();
    let other = text.replace(env!("CARGO_PKG_VERSION"), "0.0.1");
    fs::write(at.join("plan/plan.json"), other).unwrap();
    sabaki(at, &["bake", "shard", "plan", "0"]).is_refused(&["sabaki 0.0.1 made this plan"]);
    fs::write(at.join("plan/plan.json"), "{").unwrap();
    sabaki(at, &["bake", "join", "plan", "--out", "g.sabaki"]).is_refused(&["plan.json"]);
}

#[test]
fn the_script_for_slurm_names_all_steps() {
    let folder = folder();
    let at = folder.path();
    plan(at);
    let args = [
        "bake",
        "submit",
        "plan",
        "--out",
        "it's.sabaki",
        "--slurm",
        "--print",
        "--",
        "--mem=2G",
        "-p",
        "night shift",
    ];
    let script = sabaki(at, &args).is(0).stdout;
    for words in [
        "--array=0-4",
        "--dependency=afterok:$1",
        "$(after \"$shards\")",
        "$(after \"$graph\")",
        "$(after \"$entries\")",
        "bake shard ",
        "bake graph ",
        "bake entries ",
        " \"$SLURM_ARRAY_TASK_ID\"",
        "bake join ",
        "it'\\''s.sabaki'",
        " --mem=2G -p 'night shift' <<'END'",
    ] {
        assert!(script.contains(words), "{words} in\n{script}");
    }
    let document = sabaki(at, &[&["--json"], &args[..]].concat()).json(0);
    assert_eq!(document["script"], script);
    assert!(!at.join("plan/submit.sh").exists());
    #[cfg(unix)]
    {
        let name: &std::ffi::OsStr = std::os::unix::ffi::OsStrExt::from_bytes(b"pl\xffn");
        fs::rename(at.join("plan"), at.join(name)).unwrap();
        let submit = ["bake", "submit", "--out", "g", "--slurm", "--print"];
        let told = command(at, &submit).arg(name).output().unwrap();
        let said = String::from_utf8(told.stderr).unwrap();
        assert_eq!(told.status.code(), Some(2), "{said}");
        assert!(said.contains("this name is not UTF-8"), "{said}");
    }
}

#[test]
fn a_plan_names_the_files_that_it_leaves_out() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("broken.bvh"), "HIERARCHY\n").unwrap();
    let args = [
        "bake",
        "plan",
        "--clips",
        clips().0,
        "broken.bvh",
        "--shards",
        "1",
        "--out",
        "plan",
    ];
    sabaki(at, &args).is_refused(&["broken.bvh"]);
    let kept = [&args[..], &["--keep-going"]].concat();
    let told = sabaki(at, &kept).is(3).stdout;
    assert!(told.contains("left out: broken.bvh"), "{told}");
    let document = sabaki(at, &[&kept[..], &["--json"]].concat()).json(3);
    let left_out = document["left_out"].as_array().unwrap();
    assert_eq!(left_out.len(), 1, "{document}");
    assert!(document["warnings"].is_array());
}

#[test]
fn a_plan_leaves_out_what_a_bake_leaves_out() {
    let folder = folder();
    let at = folder.path();
    let (clips, events) = clips();
    let mut unreadable = vec!["missing.bvh"];
    if cfg!(unix) {
        let mut pipe = std::process::Command::new("mkfifo");
        let made = pipe.arg(at.join("pipe.bvh")).status();
        assert!(made.unwrap().success());
        unreadable.push("pipe.bvh");
    }
    let inputs = [&["--clips", clips], &unreadable[..], &["--events", events]].concat();
    let plan = [
        &["bake", "plan"],
        &inputs[..],
        &["--shards", "1", "--out", "plan"],
    ]
    .concat();
    let refused = sabaki(at, &plan);
    assert!(refused.code == 2 && refused.stderr.contains("missing.bvh"));
    let of = |args: &[&str]| {
        let document = sabaki(at, &[args, &["--keep-going", "--json"]].concat()).json(3);
        document["left_out"].as_array().unwrap().len()
    };
    assert_eq!(of(&plan), unreadable.len());
    sabaki(at, &["bake", "shard", "plan", "0"]).is(0);
    let join = ["bake", "join", "plan", "--out", "joined.sabaki"];
    assert!(sabaki(at, &join).is(3).stdout.contains("left out: "));
    let one = [&["bake"], &inputs[..], &["--out", "one.sabaki"]].concat();
    assert_eq!(of(&one), unreadable.len());
    let [joined, one] = ["joined.sabaki", "one.sabaki"].map(|file| fs::read(at.join(file)));
    assert!(joined.unwrap() == one.unwrap());
    // A file that is there after all is another input.
    fs::copy(
        Path::new(clips).join(first_clip(clips)),
        at.join("missing.bvh"),
    )
    .unwrap();
    sabaki(at, &join).is_refused(&["bake plan again"]);
}

fn first_clip(folder: &str) -> String {
    let names = fs::read_dir(folder).unwrap();
    let names = names.map(|file| file.unwrap().file_name().into_string().unwrap());
    names.min().unwrap()
}

#[test]
fn the_graph_of_another_plan_is_not_joined() {
    let folder = folder();
    let at = folder.path();
    let (clips, events) = clips();
    let plan = |threshold: &str| {
        let args = ["bake", "plan", "--clips", clips, "--events", events];
        let more = ["--shards", "1", "--out", "plan", "--threshold", threshold];
        sabaki(at, &[&args[..], &more].concat()).is(0);
        sabaki(at, &["bake", "shard", "plan", "0"]).is(0);
    };
    plan("0.12");
    sabaki(at, &["bake", "graph", "plan"]).is(0);
    sabaki(at, &["bake", "entries", "plan", "0"]).is(0);
    plan("0.1");
    // The threshold is the default one.
    assert!(joined(at) == in_one_process());
    // What needs the graph names the command that makes it.
    let refused = sabaki(at, &["bake", "entries", "plan", "0"]);
    refused.is_refused(&["of another plan", "sabaki bake graph plan"]);
}

#[test]
fn a_plan_of_more_than_can_be_is_refused() {
    let folder = folder();
    let at = folder.path();
    let document = {
        plan(at);
        let bytes = fs::read(at.join("plan/plan.json")).unwrap();
        serde_json::from_slice::<Value>(&bytes).unwrap()
    };
    let refuses = |change: &dyn Fn(&mut Value), words: &str| {
        let mut forged = document.clone();
        change(&mut forged);
        fs::write(at.join("plan/plan.json"), forged.to_string()).unwrap();
        sabaki(at, &["bake", "shard", "plan", "0"]).is_refused(&["plan.json", words]);
        let join = ["bake", "join", "plan", "--out", "g.sabaki"];
        sabaki(at, &join).is_refused(&["plan.json", words]);
    };
    for count in [100_001, 1 << 40, u64::MAX] {
        refuses(&|plan| plan["shards"] = count.into(), "shards; 100000");
    }
    for count in [1 << 29, 1 << 40, u64::MAX] {
        refuses(&|plan| plan["clips"][0]["frames"] = count.into(), "frames;");
        refuses(&|plan| plan["search"]["window"] = count.into(), "window;");
        refuses(
            &|plan| plan["search"]["separation"] = count.into(),
            "separation;",
        );
    }
    refuses(
        &|plan| {
            let mut clip = plan["clips"][0].clone();
            clip["frames"] = (1 << 15).into();
            plan["clips"] = vec![clip; 1 << 13].into();
        },
        "bands;",
    );
}
