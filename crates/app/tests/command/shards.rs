//! A bake that several processes share writes the file of one process to the byte, whatever happens to a step on the way.

use std::fs;
use std::path::Path;

use super::run::{baked, command, ended, folder, sabaki};
use serde_json::Value;

const SHARDS: usize = 3;

/// A plan in the folder `plan`.
fn plan(folder: &Path, more: &str) -> Value {
    let args = "bake plan --clips CLIPS --events EVENTS --out plan --json";
    sabaki(folder, &format!("{args} --shards {SHARDS} {more}")).json(0)
}

/// Does the next step of a shard, and returns its name.
fn step(folder: &Path, shard: usize, threads: usize) -> String {
    let args = format!("bake shard plan {shard} --threads {threads} --json");
    let document = sabaki(folder, &args).json(0);
    document["step"].as_str().unwrap().to_owned()
}

/// Does the next step of all shards, the last one first.
fn steps(folder: &Path, name: &str) {
    for shard in (0..SHARDS).rev() {
        assert_eq!(step(folder, shard, shard), name);
    }
}

const JOIN: &str = "bake join plan --out joined.sabaki";

/// Joins, and compares with the file that one process writes.
fn joins(folder: &Path) {
    sabaki(folder, JOIN).is(0);
    let joined = fs::read(folder.join("joined.sabaki")).unwrap();
    assert!(joined == fs::read(baked()).unwrap());
}

/// The join names each file that it lacks, with the command that makes it.
fn lacks(folder: &Path, part: &str, whys: [&str; SHARDS]) {
    let told = sabaki(folder, JOIN);
    let line =
        |(shard, why)| format!("sabaki: {part}/{shard} is {why}: sabaki bake shard plan {shard}\n");
    let lines: String = whys.into_iter().enumerate().map(line).collect();
    let expected = format!("{lines}sabaki: {SHARDS} of {SHARDS} shards are lacking\n");
    assert_eq!((told.code, told.stderr), (2, expected));
}

/// Removes the first file of a part, damages the second, and puts the second's in place of the third.
fn damage(folder: &Path, part: &str) {
    let file = |shard: usize| folder.join(format!("plan/{part}/{shard}"));
    let mut bytes = fs::read(file(1)).unwrap();
    fs::write(file(2), &bytes).unwrap();
    *bytes.last_mut().unwrap() ^= 4;
    fs::write(file(1), bytes).unwrap();
    fs::remove_file(file(0)).unwrap();
}

#[test]
fn the_joined_file_is_that_of_one_process() {
    let folder = folder();
    let at = folder.path();
    let document = plan(at, "");
    let pairs = document["window_pairs"].as_array().unwrap().iter();
    let pairs: Vec<u64> = pairs.map(|pairs| pairs.as_u64().unwrap()).collect();
    let mean = pairs.iter().sum::<u64>() / SHARDS as u64;
    let is_fair = |pairs: &u64| pairs.abs_diff(mean) < mean / 2;
    assert!(pairs.len() == SHARDS && pairs.iter().all(is_fair));
    // A process that was killed while it wrote leaves a file beside the shard's.
    fs::write(at.join("plan/shards/0.4711.part"), b"sabakis\nhalf").unwrap();
    let why = ["missing"; SHARDS];
    lacks(at, "shards", why);
    assert_eq!(step(at, 0, 1), "search");
    assert_eq!(step(at, 0, 1), "wait");
    assert_eq!(step(at, 1, 2), "search");
    assert_eq!(step(at, 2, 3), "search");
    // What is damaged is computed again, by the same commands.
    damage(at, "shards");
    let why = ["missing", "damaged", "of another plan or version"];
    lacks(at, "shards", why);
    steps(at, "search");
    joins(at);
    assert_eq!(step(at, 1, 1), "graph");
    joins(at);
    steps(at, "entries");
    steps(at, "nothing");
    joins(at);
    damage(at, "entries");
    lacks(at, "entries", why);
    steps(at, "entries");
    joins(at);
    let graph = at.join("plan/graph");
    let mut bytes = fs::read(&graph).unwrap();
    bytes[100] ^= 1;
    fs::write(&graph, bytes).unwrap();
    assert_eq!(step(at, 2, 0), "graph");
    joins(at);
    // Files of another plan are none.
    plan(at, "--threshold 0.12");
    lacks(at, "shards", ["of another plan or version"; SHARDS]);
    let refused = sabaki(at, "bake shard plan 3");
    refused.is_refused(&["shard 3", "0 to 2"]);
    fs::remove_file(at.join("plan/points")).unwrap();
    let refused = sabaki(at, "bake shard plan 0");
    refused.is_refused(&["plan/points", "missing", "bake plan"]);
    for (contents, why) in [("{", "damaged"), ("", "damaged")] {
        fs::write(at.join("plan/plan"), contents).unwrap();
        sabaki(at, JOIN).is_refused(&["plan/plan", why, "bake plan"]);
    }
}

#[test]
fn the_commands_for_slurm_do_all_steps() {
    let folder = folder();
    let at = folder.path();
    plan(at, "");
    let args = "bake submit plan --slurm --out it's.sabaki";
    let mut command = command(at, &format!("{args} --print -- --mem=2G"));
    command.arg("night shift");
    let told = ended(command).is(0).stdout;
    let lines: Vec<&str> = told.lines().collect();
    let words: [&[&str]; 4] = [
        &["--array=0-2", "bake shard ", "$SLURM_ARRAY_TASK_ID"],
        &["--dependency=afterok:JOB_OF_SEARCH", "plan 0 --threads "],
        &["--array=0-2", "--dependency=afterok:JOB_OF_GRAPH"],
        &["--dependency=afterok:JOB_OF_ENTRIES", "bake join "],
    ];
    assert_eq!(lines.len(), words.len(), "{told}");
    for (line, words) in lines.into_iter().zip(words) {
        for words in words.iter().chain(&[" --mem=2G 'night shift' "]) {
            assert!(line.contains(words), "{words} in {line}");
        }
    }
}

#[test]
fn a_plan_leaves_out_what_a_bake_leaves_out() {
    let folder = folder();
    let at = folder.path();
    sabaki(at, "bake plan --out plan").is_refused(&["name the clips"]);
    fs::write(at.join("broken.bvh"), "HIERARCHY\n").unwrap();
    let args = "bake plan --clips CLIPS broken.bvh --events EVENTS --out plan";
    sabaki(at, args).is_refused(&["broken.bvh"]);
    let kept = format!("{args} --shards 1 --keep-going");
    let told = sabaki(at, &kept).is(3).stdout;
    assert!(told.contains("left out: broken.bvh"), "{told}");
    assert_eq!(step(at, 0, 1), "search");
    assert!(sabaki(at, JOIN).is(3).stdout.contains("left out: "));
    let joined = fs::read(at.join("joined.sabaki")).unwrap();
    assert!(joined == fs::read(baked()).unwrap());
}
