//! A bake onto an earlier one writes the file of a bake from nothing to the byte, whatever has changed between them.

use std::fs;
use std::path::Path;
use std::process::Stdio;
#[cfg(unix)]
use std::process::{Command, Output};
use std::time::Duration;

use super::run::{baked, clips, command, folder, sabaki};
use serde_json::{Value, json};

/// A [`library`], and `old.sabaki` and its record, which were baked of the same files.
fn baked_library(folder: &Path) {
    library(folder);
    for end in ["", ".record"] {
        let old = folder.join(format!("old.sabaki{end}"));
        fs::copy(format!("{}{end}", baked()), old).unwrap();
    }
}

/// A folder with copies of the clips, and the events file beside it.
fn library(folder: &Path) {
    let (clips, events) = clips();
    fs::create_dir(folder.join("clips")).unwrap();
    for file in fs::read_dir(clips).unwrap() {
        let file = file.unwrap();
        fs::copy(file.path(), folder.join("clips").join(file.file_name())).unwrap();
    }
    fs::copy(events, folder.join("events.json")).unwrap();
}

fn files(folder: &Path) -> Vec<String> {
    let files = fs::read_dir(folder.join("clips")).unwrap();
    let mut names: Vec<String> = files
        .map(|file| file.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// Removes a clip and its events.
fn remove(folder: &Path, name: &str) {
    fs::remove_file(folder.join("clips").join(name)).unwrap();
    change_events(folder, |of_clips| {
        of_clips.retain(|of_clip| of_clip["file"] != name);
    });
}

fn change_events(folder: &Path, change: impl FnOnce(&mut Vec<Value>)) {
    let path = folder.join("events.json");
    let mut events: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    change(events["clips"].as_array_mut().unwrap());
    fs::write(path, events.to_string()).unwrap();
}

/// Bakes to `out`, and returns the report.
fn bake(folder: &Path, out: &str, more: &[&str]) -> Value {
    let args = [
        "bake",
        "--clips",
        "clips",
        "--events",
        "events.json",
        "--out",
        out,
        "--json",
    ];
    sabaki(folder, &[&args[..], more].concat()).json(0)
}

/// Bakes from nothing and onto `old.sabaki`, and returns the number of clips that were taken over.
fn bakes_the_same(folder: &Path, more: &[&str]) -> u64 {
    bake(folder, "anew.sabaki", &[&["--no-record"], more].concat());
    let report = bake(
        folder,
        "onto.sabaki",
        &[&["--onto", "old.sabaki"], more].concat(),
    );
    let [anew, onto] = ["anew.sabaki", "onto.sabaki"].map(|file| fs::read(folder.join(file)));
    assert!(anew.unwrap() == onto.unwrap());
    assert!(!folder.join("anew.sabaki.record").exists());
    report["clips_taken_over"].as_u64().unwrap()
}

#[test]
fn clips_that_are_added_removed_or_changed_are_baked_as_from_nothing() {
    let folder = folder();
    let at = folder.path();
    baked_library(at);
    let names = files(at);
    let count = names.len() as u64;
    // Nothing changed.
    assert_eq!(bakes_the_same(at, &[]), count);
    // One removed, from the first and from the middle.
    remove(at, &names[0]);
    assert_eq!(bakes_the_same(at, &[]), count - 1);
    remove(at, &names[names.len() / 2]);
    assert_eq!(bakes_the_same(at, &[]), count - 2);
    // One added at the end, whose motion another has, too.
    fs::copy(at.join("clips").join(&names[1]), at.join("clips/zzz.bvh")).unwrap();
    assert_eq!(bakes_the_same(at, &[]), count - 2);
    // Added ones, onto fewer: they are compared with all.
    bake(at, "old.sabaki", &[]);
    library_again(at, &names);
    assert_eq!(bakes_the_same(at, &[]), count - 1);
    // Events that changed make a clip another one.
    bake(at, "old.sabaki", &[]);
    change_events(at, |of_clips| {
        let event = &mut of_clips[0]["events"][0];
        let end = event["end"].as_f64().unwrap();
        event["end"] = json!(end - 0.1);
    });
    assert_eq!(bakes_the_same(at, &[]), count);
}

#[test]
fn a_clip_more_leaves_the_mirrored_clips_to_be_taken_over() {
    let folder = folder();
    let at = folder.path();
    library(at);
    let names = files(at);
    bake(at, "old.sabaki", &["--mirror"]);
    fs::copy(at.join("clips").join(&names[1]), at.join("clips/zzz.bvh")).unwrap();
    assert_eq!(bakes_the_same(at, &["--mirror"]), 2 * names.len() as u64);
}

/// Puts back all clips and events.
fn library_again(folder: &Path, names: &[String]) {
    let (clips, events) = clips();
    for name in names {
        fs::copy(Path::new(clips).join(name), folder.join("clips").join(name)).unwrap();
    }
    fs::copy(events, folder.join("events.json")).unwrap();
}

#[test]
fn nothing_is_taken_over_from_other_settings_or_a_record_that_cannot_be_used() {
    let folder = folder();
    let at = folder.path();
    baked_library(at);
    assert_eq!(bakes_the_same(at, &["--threshold", "0.09"]), 0);
    assert_eq!(bakes_the_same(at, &["--clip-error", "0.2"]), 0);
    let record = at.join("old.sabaki.record");
    let sound = fs::read(&record).unwrap();
    let mut damaged = sound.clone();
    damaged[sound.len() / 2] ^= 1;
    fs::write(&record, damaged).unwrap();
    assert_eq!(bakes_the_same(at, &[]), 0);
    let args = ["--onto", "old.sabaki"];
    let warned = |report: Value, word: &str| {
        let warnings = report["warnings"].to_string();
        assert!(
            warnings.contains("old.sabaki.record") && warnings.contains(word),
            "{warnings}"
        );
    };
    warned(bake(at, "onto.sabaki", &args), "damaged");
    let mut older = sound.clone();
    older[8..12].fill(0);
    fs::write(&record, older).unwrap();
    warned(bake(at, "onto.sabaki", &args), "of another version");
    fs::remove_file(&record).unwrap();
    warned(bake(at, "onto.sabaki", &args), "missing");
    let refused = sabaki(
        at,
        &[
            "bake",
            "--clips",
            "clips",
            "--out",
            "never.sabaki",
            "--onto",
            "none.sabaki",
        ],
    );
    refused.is_refused(&["none.sabaki"]);
}

/// Sends Ctrl-C to a bake after `delay`, and waits for its end.
#[cfg(unix)]
fn interrupted(folder: &Path, delay: Duration) -> Output {
    let args = ["--clips", "clips", "--events", "events.json"];
    let args = [&["bake"], &args[..], &["--out", "stopped.sabaki"]].concat();
    let bake = command(folder, &args)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(delay);
    let id = bake.id().to_string();
    // It may have ended.
    let _ = Command::new("kill").args(["-INT", &id]).status().unwrap();
    bake.wait_with_output().unwrap()
}

#[cfg(unix)]
#[test]
fn a_bake_that_ctrl_c_stops_goes_on_where_it_was() {
    let folder = folder();
    let at = folder.path();
    library(at);
    // Enough to be stopped in the middle of it.
    for name in files(at) {
        let clips = at.join("clips");
        fs::copy(clips.join(&name), clips.join(format!("again_{name}"))).unwrap();
    }
    bake(at, "whole.sabaki", &[]);
    let clip = format!("clips/{}", files(at)[0]);
    let unfinished = at.join("stopped.sabaki.unfinished");
    let mut delay = Duration::ZERO;
    let (mut stopped, mut went_on) = (0, 0);
    loop {
        let was_there = unfinished.exists();
        let output = interrupted(at, delay);
        let said = String::from_utf8(output.stderr).unwrap();
        went_on +=
            usize::from(was_there && said.contains("goes on from stopped.sabaki.unfinished"));
        match output.status.code() {
            Some(0) if stopped > 0 => break,
            // It did not listen yet, and what runs the tests has it ignore the signal.
            Some(0) => {
                assert!(delay < Duration::from_secs(20), "{said}");
                fs::remove_file(at.join("stopped.sabaki")).unwrap();
                delay = delay * 3 / 2 + Duration::from_millis(20);
            }
            Some(code) => {
                assert_eq!(code, 130, "{said}");
                assert!(said.contains("the same command goes on from it"), "{said}");
                assert!(unfinished.exists() && !at.join("stopped.sabaki").exists());
                fs::copy(&unfinished, at.join("other.sabaki.unfinished")).unwrap();
                stopped += 1;
                delay += Duration::from_millis(300);
            }
            // It did not listen yet.
            None => delay += Duration::from_millis(20),
        }
    }
    assert!(stopped > 0 && went_on > 0, "{stopped} {went_on}");
    let files = |name: &str| ["", ".record"].map(|end| fs::read(at.join(format!("{name}{end}"))));
    for (stopped, whole) in files("stopped.sabaki")
        .into_iter()
        .zip(files("whole.sabaki"))
    {
        assert!(stopped.unwrap() == whole.unwrap());
    }
    assert!(!unfinished.exists());
    // What cannot be used is named.
    fs::write(&unfinished, "no record").unwrap();
    let args = ["bake", "--clips", "clips", "--out", "stopped.sabaki"];
    let output = command(at, &args).output().unwrap();
    assert!(output.status.success());
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        said.contains("stopped.sabaki.unfinished: damaged"),
        "{said}"
    );
    assert!(!unfinished.exists());
    // And so is what is of other settings.
    let args = ["--threshold", "0.09", "--out", "other.sabaki"];
    let args = [&["bake", "--clips", &clip][..], &args].concat();
    let output = command(at, &args).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{said}");
    assert!(
        said.contains("other.sabaki.unfinished is of other clips or settings"),
        "{said}"
    );
    assert!(!at.join("other.sabaki.unfinished").exists());
}

/// Where the file is to be, a folder appears while the bake goes on.
#[test]
fn a_bake_whose_file_cannot_be_written_is_kept() {
    let folder = folder();
    let at = folder.path();
    library(at);
    let args = ["--clips", "clips", "--events", "events.json"];
    let args = [&["bake"], &args[..], &["--out", "out.sabaki"]].concat();
    let (out, unfinished) = (at.join("out.sabaki"), at.join("out.sabaki.unfinished"));
    let mut delay = Duration::from_millis(200);
    let kept = (0..20).any(|_| {
        let mut bake = command(at, &args);
        let bake = bake.stdout(Stdio::piped()).stderr(Stdio::piped());
        let bake = bake.spawn().unwrap();
        std::thread::sleep(delay);
        let was_in_time = fs::create_dir_all(out.join("inside")).is_ok();
        let output = bake.wait_with_output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        if !was_in_time {
            fs::remove_file(&out).unwrap();
            delay /= 2;
            return false;
        }
        fs::remove_dir_all(&out).unwrap();
        assert_eq!(output.status.code(), Some(2), "{said}");
        delay += Duration::from_millis(50);
        // Else it was refused before the work.
        let words = "what is done is in out.sabaki.unfinished, and the same command goes on";
        said.contains(words) && said.starts_with("sabaki: out.sabaki: ")
    });
    assert!(kept && unfinished.exists());
    let output = command(at, &args).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        said.contains("goes on from out.sabaki.unfinished"),
        "{said}"
    );
    let (told, count) = (String::from_utf8(output.stdout).unwrap(), files(at).len());
    let all = format!("computed of {count} of {count} clips was taken over");
    assert!(told.contains(&all), "{told}");
    assert!(fs::read(out).unwrap() == fs::read(baked()).unwrap());
    assert!(!unfinished.exists());
}

#[cfg(target_os = "linux")]
#[test]
fn a_plot_that_cannot_be_written_leaves_the_file_and_its_record() {
    let folder = folder();
    let at = folder.path();
    std::os::unix::fs::symlink("/dev/full", at.join("p.png")).unwrap();
    let (clips, events) = clips();
    let args = ["bake", "--clips", clips, "--events", events];
    let out = ["--out", "g.sabaki", "--plot", "p.png"];
    sabaki(at, &[&args[..], &out].concat()).is_refused(&["p.png"]);
    assert!(at.join("g.sabaki").exists() && at.join("g.sabaki.record").exists());
}
