//! On a real Slurm: tasks that are killed run again, and the joined file is that of one process to the byte. Run by
//! `tests/slurm cargo test --test main -- --ignored slurm`.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use sabaki_fixtures::clips::{small_skeleton, swinging_clip};

use super::run::{folder, sabaki, write_bvh};

/// How long anything may take.
const PATIENCE: Duration = Duration::from_secs(90);

/// Clips whose shards take a few tenths of a second each, so that one can be met while it runs.
fn write_clips(folder: &Path) {
    let skeleton = small_skeleton();
    fs::create_dir(folder).unwrap();
    for index in 0..8 {
        let clip = swinging_clip(&skeleton, 1800, 0.3 + 0.7 * index as f32);
        write_bvh(&folder.join(format!("{index}.bvh")), &skeleton, &clip);
    }
}

fn run(program: &str, args: &[&str]) -> String {
    let output = Command::new(program).args(args).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{program} {args:?}: {text}{told}");
    text
}

/// Repeats `look` until it finds something.
fn wait<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let started = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        let queue = || run("squeue", &["--noheader"]);
        assert!(started.elapsed() < PATIENCE, "{what}: {}", queue());
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// A process that computes a shard of `plan`: its number, and the shard's.
fn running_shard(plan: &Path) -> Option<(u32, String)> {
    let plan = plan.to_str().unwrap();
    for entry in fs::read_dir("/proc").unwrap().flatten() {
        let Ok(line) = fs::read_to_string(entry.path().join("cmdline")) else {
            continue;
        };
        let words: Vec<&str> = line.split('\0').collect();
        if let [_, "bake", "shard", folder, shard, ..] = words[..]
            && folder == plan
            && let Ok(process) = entry.file_name().to_string_lossy().parse()
        {
            return Some((process, shard.to_owned()));
        }
    }
    None
}

/// Stops a process in its work. Returns `false` if it has ended.
fn stop(process: u32) -> bool {
    let args = ["-STOP", &process.to_string()];
    Command::new("kill").args(args).output().unwrap();
    // On a machine that is busy it goes on for a moment.
    wait("the shard does not stop", || {
        let stat = fs::read_to_string(format!("/proc/{process}/stat"));
        match stat.unwrap_or_default().rsplit_once(") ") {
            Some((_, state)) if state.starts_with('T') => Some(true),
            Some((_, state)) if !state.starts_with('Z') => None,
            _ => Some(false),
        }
    })
}

#[test]
#[ignore = "needs Slurm"]
fn a_killed_task_runs_again_and_changes_nothing() {
    assert!(
        std::env::var_os("SABAKI_SLURM").is_some(),
        "run by tests/slurm"
    );
    let folder = folder();
    let at = folder.path();
    write_clips(&at.join("clips"));
    let args = "bake --clips clips --out one.sabaki";
    sabaki(at, args).is(0);
    let args = "bake plan --clips clips --out plan --shards 4";
    sabaki(at, args).is(0);
    let args = "bake submit plan --slurm --out joined.sabaki --json -- --cpus-per-task=1";
    let submitted = sabaki(at, args).json(0);
    let job = submitted["jobs"][0][1].as_str().unwrap().to_owned();
    // A task is stopped in its work, so that it cannot end by itself, and is killed and queued again by Slurm.
    let plan = at.join("plan");
    let (process, shard) = wait("no shard runs", || {
        let found = running_shard(&plan)?;
        stop(found.0).then_some(found)
    });
    assert!(!plan.join("shards").join(&shard).exists());
    let task = format!("{job}_{shard}");
    run("scontrol", &["requeue", &task]);
    wait("the task is not killed", || {
        (!Path::new(&format!("/proc/{process}")).exists()).then_some(())
    });
    // Slurm waits two minutes before it runs a task again, unless it is told that the time has come. It is told so once nothing of
    // the task is left on the node, and a second later: its credentials count whole seconds, and one that is issued in the second in
    // which the task was killed counts as revoked with it, which fails the task.
    wait("the task is not pending", || {
        let task = run("squeue", &["--noheader", "--format=%t", "--jobs", &task]);
        let node = run("sinfo", &["--noheader", "--format=%T"]);
        (task.trim() == "PD" && node.trim() == "idle").then_some(())
    });
    std::thread::sleep(Duration::from_secs(1));
    wait("the queue is not done", || {
        std::thread::sleep(Duration::from_millis(200));
        let now = ["update", &format!("jobid={task}"), "StartTime=now"].map(String::from);
        let _ = Command::new("scontrol").args(now).output();
        let left = run("squeue", &["--noheader"]);
        left.trim().is_empty().then_some(())
    });
    let told = run("scontrol", &["show", "job", &task]);
    assert!(
        told.contains("Restarts=1") && told.contains("JobState=COMPLETED"),
        "{told}"
    );
    let log = fs::read_to_string(plan.join("logs/join")).unwrap();
    let joined = fs::read(at.join("joined.sabaki")).expect(&log);
    assert!(joined == fs::read(at.join("one.sabaki")).unwrap(), "{log}");
}
