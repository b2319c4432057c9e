//! Ctrl-C while a command works for long.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use sabaki_fixtures::clips::{chain, swinging_chain};

use super::run::{command, folder, sabaki, write_bvh};

/// Runs a command that would take minutes, sends Ctrl-C after `delay`, and returns its exit code and what it wrote.
fn interrupted(folder: &Path, args: &str, delay: Duration) -> (Option<i32>, String, String) {
    let mut running = command(folder, args)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(delay);
    let id = running.id().to_string();
    let sent = Command::new("kill").args(["-INT", &id]).status().unwrap();
    assert!(sent.success(), "{args:?} ended by itself");
    // Whoever runs the tests may ignore Ctrl-C, and then so does a command that does not listen.
    for _ in 0..300 {
        if running.try_wait().unwrap().is_some() {
            break;
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    // It may have ended.
    let _ = running.kill();
    let output = running.wait_with_output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (
        output.status.code(),
        text(output.stdout),
        text(output.stderr),
    )
}

/// Sends Ctrl-C to a command that would take minutes: it ends with a message, exit code 130, and no output.
fn is_cancelled(folder: &Path, args: &str) {
    // It may not have begun to listen.
    let delays = [200, 400, 800, 1600, 3200].map(Duration::from_millis);
    let mut ends = delays.iter().map(|&delay| interrupted(folder, args, delay));
    let listened = ends.find(|(code, ..)| code.is_some());
    let (code, stdout, stderr) = listened.unwrap_or_else(|| panic!("killed: {args:?}"));
    assert_eq!(
        (code, stdout.as_str()),
        (Some(130), ""),
        "{args:?}: {stderr}"
    );
    for words in ["stops at the next step", "sabaki: cancelled"] {
        assert!(stderr.contains(words), "{args:?}: {stderr}");
    }
}

#[test]
fn what_takes_long_ends_with_a_message_and_its_exit_code() {
    let folder = folder();
    let many = "1000000";
    let long = [
        format!("dodge BAKED --attacks {many} --cull cpu"),
        format!("compare BAKED --attacks {many}"),
        format!("coverage BAKED --attacks {many}"),
        "duel --rounds 10000".to_owned(),
        format!("play BAKED --threats {many}"),
        "crowd --count 1000 --frames 100000".to_owned(),
    ];
    for args in long {
        is_cancelled(folder.path(), &args);
    }
}

/// Writes a clip of a chain of joints that swing.
fn write_swinging(path: &Path, joints: usize, frames: usize) {
    let skeleton = chain(joints);
    write_bvh(path, &skeleton, &swinging_chain(&skeleton, frames, 0.5));
}

#[test]
fn a_bake_and_a_shard_stop_at_a_step() {
    let folder = folder();
    let at = folder.path();
    write_swinging(&at.join("long.bvh"), 3, 150_000);
    is_cancelled(at, "bake --clips long.bvh --out g.sabaki");
    assert_eq!(fs::read_dir(at).unwrap().count(), 1, "a file is left");
    let plan = "bake plan --clips long.bvh --out plan --shards 1";
    sabaki(at, plan).is(0);
    is_cancelled(at, "bake shard plan 0");
    let left = fs::read_dir(at.join("plan/shards")).unwrap();
    assert_eq!(left.count(), 0, "a file is left");
}

#[test]
fn levels_of_detail_that_take_long_are_not_waited_for() {
    let folder = folder();
    let at = folder.path();
    write_swinging(&at.join("chain.bvh"), 300, 2000);
    is_cancelled(at, "lod chain.bvh --export levels.glb");
    assert_eq!(fs::read_dir(at).unwrap().count(), 1, "a file is left");
}
