//! Ctrl-C while a command works for long.

use std::process::{Command, Stdio};
use std::time::Duration;

use super::run::{baked, command, folder};

/// Runs a command that would take minutes, sends Ctrl-C after `delay`, and returns its exit code and what it wrote.
fn interrupted(args: &[&str], delay: Duration) -> (Option<i32>, String, String) {
    let folder = folder();
    let mut running = command(folder.path(), args)
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

#[test]
fn what_takes_long_ends_with_a_message_and_its_exit_code() {
    let graph = baked();
    let many = "1000000";
    let long: [&[&str]; 7] = [
        &["dodge", graph, "--attacks", many, "--cull", "cpu"],
        &["compare", graph, "--attacks", many],
        &["compare", graph, "--attacks", many, "--settings"],
        &["coverage", graph, "--attacks", many],
        &["duel", graph, "--rounds", "10000"],
        &["play", graph, "--threats", many],
        &["crowd", "--count", "1000", "--frames", "100000"],
    ];
    for args in long {
        // It may not have begun to listen.
        let delays = [200, 400, 800, 1600, 3200].map(Duration::from_millis);
        let mut ends = delays.iter().map(|&delay| interrupted(args, delay));
        let listened = ends.find(|(code, ..)| code.is_some());
        let (code, stdout, stderr) = listened.unwrap_or_else(|| panic!("killed: {args:?}"));
        assert_eq!(
            (code, stdout.as_str()),
            (Some(130), ""),
            "{args:?}: {stderr}"
        );
        for words in ["stops at the next step", "cancelled"] {
            assert!(stderr.contains(words), "{args:?}: {stderr}");
        }
    }
}
