//! Promise: a program in C, built with `cc` against the header and the static library, bakes clips, dodges on its own Vulkan
//! device by both paths, and gets the CPU's answer; one in C++ reads what was baked.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use sabaki::{
    anim::{Clip, ClipDesc, Event},
    demo,
    io::{EventsFile, bvh},
};
use serde_json::Value;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn output_of(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(
        output.status.success(),
        "{command:?}: {}\n{}{}",
        output.status,
        text(&output.stdout),
        text(&output.stderr)
    );
    text(&output.stdout)
}

/// Builds the library as the header says, though not for speed: where cargo has put it.
fn static_library() -> PathBuf {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.current_dir(root()).args([
        "rustc",
        "--offline",
        "--locked",
        "--lib",
        "--no-default-features",
        "--features=capi",
        "--crate-type=staticlib",
        "--message-format=json",
        "--config=profile.dev.opt-level=2",
    ]);
    let text = output_of(&mut cargo);
    let artifacts = text
        .lines()
        .filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let mut files = artifacts
        .filter(|artifact| artifact["target"]["name"] == "sabaki")
        .filter_map(|artifact| artifact["filenames"].as_array().cloned())
        .flatten()
        .filter_map(|file| file.as_str().map(PathBuf::from));
    files
        .find(|file| file.extension().is_some_and(|ending| ending == "a"))
        .expect("a static library")
}

/// Some of the embedded motions as files: the folder of the clips, and the events.
fn clips(folder: &Path) -> (PathBuf, PathBuf) {
    let clips_folder = folder.join("clips");
    fs::create_dir_all(&clips_folder).unwrap();
    let motions = demo::motions().unwrap();
    let chosen: Vec<usize> = (0..motions.clips.len()).step_by(2).collect();
    let clips: Vec<Clip> = chosen
        .iter()
        .map(|&clip| {
            let desc = motions.clips[clip].desc().clone();
            let name = format!("{}.bvh", desc.name.replace(' ', "_"));
            Clip::new(&motions.skeleton, ClipDesc { name, ..desc }).unwrap()
        })
        .collect();
    let renumbered = |event: &Event| {
        let clip = chosen.iter().position(|&clip| clip == event.clip)?;
        let event = event.clone();
        Some(Event { clip, ..event })
    };
    let events: Vec<Event> = motions.events.iter().filter_map(renumbered).collect();
    for clip in &clips {
        let mut file = fs::File::create(clips_folder.join(clip.name())).unwrap();
        bvh::write(&mut file, &motions.skeleton, clip, 0.01).unwrap();
    }
    let file = EventsFile::of(&events, &clips, &motions.skeleton).unwrap();
    let events = folder.join("events.json");
    fs::write(&events, serde_json::to_vec(&file).unwrap()).unwrap();
    (clips_folder, events)
}

/// Compiles a program of this folder, strictly, and links it with the library.
fn program(compiler: &str, standard: &str, source: &str, folder: &Path) -> PathBuf {
    let program = folder.join(source).with_extension("");
    let mut command = Command::new(compiler);
    command
        .args([standard, "-Wall", "-Wextra", "-Werror", "-D_GNU_SOURCE"])
        .arg(root().join("tests/capi").join(source))
        .arg("-I")
        .arg(root().join("src/capi"))
        .arg(static_library())
        .args(["-lm", "-lpthread", "-ldl"])
        .arg("-o")
        .arg(&program);
    output_of(&mut command);
    program
}

#[test]
fn programs_in_c_and_cpp_bake_dodge_and_read() {
    let folder = tempfile::tempdir().unwrap();
    let (clips, events) = clips(folder.path());
    let baked = folder.path().join("baked.sabaki");

    let dodge = program("cc", "-std=c99", "dodge.c", folder.path());
    let said = output_of(Command::new(dodge).args([&clips, &events, &baked]));
    println!("{said}");
    assert!(said.contains("24 joints, the first is Hips"), "{said}");
    assert_eq!(said.matches("avoided 1").count(), 2, "{said}");

    let reader = program("c++", "-std=c++11", "reader.cpp", folder.path());
    let said = output_of(Command::new(reader).args([&baked, &events]));
    assert!(said.contains("24 joints, the last is "), "{said}");
    assert!(said.contains("refused: "), "{said}");
}

/// Every function that the header declares is in the library, and no other.
#[test]
fn the_header_declares_what_there_is() {
    let functions = |text: &str| -> Vec<String> {
        let mut names: Vec<String> = text
            .split(|letter: char| !(letter.is_alphanumeric() || letter == '_' || letter == '('))
            .filter_map(|word| word.split_once('(').map(|(name, _)| name.to_owned()))
            .filter(|name| name.starts_with("sabaki_"))
            .collect();
        names.sort();
        names.dedup();
        names
    };
    let header = fs::read_to_string(root().join("src/capi/sabaki.h")).unwrap();
    let mut source = String::new();
    for file in ["culler", "device", "graph", "status"] {
        let text = fs::read_to_string(root().join(format!("src/capi/{file}.rs"))).unwrap();
        let defined = text.split("extern \"C\" fn ").skip(1);
        defined.for_each(|text| {
            source.push_str(&format!(
                "{} ",
                text.split('(').next().unwrap().to_owned() + "("
            ))
        });
    }
    let declared = functions(&header);
    assert!(declared.len() > 15);
    assert_eq!(declared, functions(&source));
}
