//! Promise: a program in C, built with `cc` against the header and the static library, opens a baked graph, dodges on its own
//! Vulkan device by both paths, with sabaki's allocator and its own, and gets the CPU's answer; one in C++ loads the graph from memory; others
//! walk by keys among walls, dodge, save and load.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    sync::OnceLock,
};

use sabaki_fixtures::baked::embedded_file;
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
fn static_library() -> &'static PathBuf {
    static LIBRARY: OnceLock<PathBuf> = OnceLock::new();
    LIBRARY.get_or_init(build_library)
}

fn build_library() -> PathBuf {
    let mut cargo = Command::new(env!("CARGO"));
    let line = "rustc --offline --locked --package=sabaki --lib --no-default-features --features=capi \
                --crate-type=staticlib --message-format=json";
    let text = output_of(cargo.current_dir(root()).args(line.split_whitespace()));
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

const HEADER: &str = "src/capi";
const PROGRAMS: &str = "tests/capi/programs";

/// Compiles a program, strictly, against the header of a folder, and links it with the library.
fn program(line: &str, source: &str, header: &str, folder: &Path) -> PathBuf {
    let (compiler, standard) = line.split_once(' ').unwrap();
    let source = root().join(source);
    let program = folder.join(source.file_stem().unwrap());
    let mut command = Command::new(compiler);
    command.args([standard, "-Wall", "-Wextra", "-Werror", "-D_GNU_SOURCE"]);
    command.arg("-I").arg(root().join(header));
    command.arg("-I").arg(folder);
    command.args([&source, static_library()]);
    command.args(["-lm", "-lpthread", "-ldl", "-o"]);
    output_of(command.arg(&program));
    program
}

#[test]
fn programs_in_c_and_cpp_read_and_dodge() {
    let folder = tempfile::tempdir().unwrap();
    let file = embedded_file(folder.path());
    let damaged = folder.path().join("damaged.sabaki");
    let bytes = fs::read(&file).unwrap();
    fs::write(&damaged, &bytes[..bytes.len() - 1]).unwrap();

    let built =
        |line, source: &str| program(line, &format!("{PROGRAMS}/{source}"), HEADER, folder.path());
    let dodge = built("cc -std=c99", "dodge.c");
    let said = output_of(Command::new(dodge).arg(&file));
    println!("{said}");
    assert!(said.contains("24 joints, the first is Hips"), "{said}");
    assert_eq!(said.matches("avoided 1").count(), 2, "{said}");
    assert_eq!(said.matches(" blocks").count(), 2, "{said}");

    let reader = built("c++ -std=c++11", "reader.cpp");
    let said = output_of(Command::new(reader).args([&file, &damaged]));
    assert!(said.contains("24 joints, the last is "), "{said}");
    assert!(said.contains("refused: "), "{said}");
    // One from a thread's destructor, one from a global's.
    assert_eq!(said.matches("too late").count(), 2, "{said}");

    let game = built("cc -std=c99", "game.c");
    let said = output_of(Command::new(game).arg(&file));
    assert!(said.contains("walked "), "{said}");

    // An older header's program, with the library of today.
    let said = [HEADER, "tests/capi/older"].map(|header| {
        let source = format!("{PROGRAMS}/same.c");
        let same = program("cc -std=c99", &source, header, folder.path());
        output_of(Command::new(same).arg(&file))
    });
    println!("{}", said[0]);
    assert_eq!(said[0], said[1]);
    assert!(!said[0].contains(" 0 hits, 0 misses"), "{}", said[0]);

    let walk = program("c++ -std=c++17", "examples/walk.cpp", HEADER, folder.path());
    let keys = folder.path().join("keys");
    fs::write(&keys, "wwwwdddd  wwwwwwaaaa  ssss wwww ").unwrap();
    let keys = fs::File::open(keys).unwrap();
    let said = output_of(Command::new(walk).arg(&file).stdin(keys));
    println!("{said}");
    assert!(said.contains("missed by"), "{said}");
    assert!(said.contains("entered the walls by 0.000 m"), "{said}");
}

/// CMake with these words, of which those that begin with `@` lie in the folder.
fn cmake(folder: &Path, line: &str) -> Command {
    let mut cmake = Command::new("cmake");
    let there = format!("{}/", folder.display());
    let words = line.split_whitespace();
    cmake.args(words.map(|word| word.replace('@', &there)));
    cmake
}

/// The package is installed by CMake, found by `find_package`, and the example is built with it.
#[test]
fn cmake_installs_a_package_that_the_example_finds() {
    let target = static_library().parent().and_then(Path::parent).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let run = |line: &str| output_of(&mut cmake(folder.path(), line));
    // The library that Cargo has built already.
    run(&format!(
        "-S {} -B @package -DSABAKI_PROFILE=dev -DSABAKI_TARGET_DIRECTORY={} \
         -DSABAKI_CARGO_ARGUMENTS=--offline;--locked",
        root().join("src/capi").display(),
        target.display()
    ));
    run("--build @package");
    run("--install @package --prefix @prefix");
    let examples = root().join("examples");
    let examples = examples.display();
    run(&format!(
        "-DCMAKE_PREFIX_PATH=@prefix -S {examples} -B @example"
    ));
    run("--build @example");
    let file = embedded_file(folder.path());
    let keys = folder.path().join("keys");
    fs::write(&keys, "wwwwdddd ").unwrap();
    let mut walk = Command::new(folder.path().join("example/walk"));
    let said = output_of(walk.arg(&file).stdin(fs::File::open(keys).unwrap()));
    let is_played = said.contains("walked") || said.contains("entered the walls");
    assert!(is_played, "{said}");
    // The same without CMake, by what pkg-config says.
    let mut ask = Command::new("pkg-config");
    ask.args(["--cflags", "--libs", "sabaki"]);
    let path = folder.path().join("prefix/lib/pkgconfig");
    let flags = output_of(ask.env("PKG_CONFIG_PATH", path));
    let same = folder.path().join("same");
    let mut build = Command::new("cc");
    build.arg(root().join(PROGRAMS).join("same.c"));
    build.args(flags.split_whitespace());
    output_of(build.arg("-o").arg(&same));
    assert!(output_of(Command::new(same).arg(&file)).contains("at "));
    // A version that is not installed is not found.
    let wanted = folder.path().join("wanted");
    fs::create_dir(&wanted).unwrap();
    let project = "cmake_minimum_required(VERSION 3.16)\nproject(wanted NONE)\nfind_package(sabaki 0.9)\nmessage(STATUS \"found: ${sabaki_FOUND}\")\n";
    fs::write(wanted.join("CMakeLists.txt"), project).unwrap();
    let said = run("-DCMAKE_PREFIX_PATH=@prefix -S @wanted -B @wanted/build");
    assert!(said.contains("found: 0"), "{said}");
}

/// The library of another target is built and installed from that target's folder. A script stands in for Cargo.
#[test]
fn cmake_builds_for_a_target() {
    use std::os::unix::fs::PermissionsExt;

    let folder = tempfile::tempdir().unwrap();
    let cargo = folder.path().join("cargo");
    let script = "#!/bin/sh\necho \"env $CARGO_BUILD_TARGET arguments $*\" > \"$0.said\"\n\
        mkdir -p \"${0%cargo}out/$FOLDER/release\"\n: > \"${0%cargo}out/$FOLDER/release/libsabaki.a\"\n";
    fs::write(&cargo, script).unwrap();
    fs::set_permissions(&cargo, fs::Permissions::from_mode(0o755)).unwrap();
    let other = "riscv64gc-unknown-none-elf";
    let cases = [
        ("variable", "x86_64-unknown-none", "x86_64-unknown-none"),
        ("environment", other, other),
        ("variable", "targets/own.json", "own"),
        ("none", "", "."),
    ];
    let sources = root().join(HEADER);
    let sources = sources.display();
    let configure = format!("-S {sources} -DCARGO=@cargo -DSABAKI_TARGET_DIRECTORY=@out");
    for (index, (from, target, of_target)) in cases.into_iter().enumerate() {
        let run = |line: &str| cmake(folder.path(), line);
        let variable = match from {
            "variable" => format!("-DSABAKI_CARGO_TARGET={target}"),
            _ => String::new(),
        };
        let mut configure = run(&format!("{configure} -B @build{index} {variable}"));
        configure.env_remove("CARGO_BUILD_TARGET");
        if from == "environment" {
            configure.env("CARGO_BUILD_TARGET", target);
        }
        output_of(&mut configure);
        // What the environment says later does not move the library.
        let mut make = run(&format!("--build @build{index}"));
        make.env("FOLDER", of_target);
        output_of(make.env("CARGO_BUILD_TARGET", "later"));
        let prefix = format!("prefix{index}");
        let install = format!("--install @build{index} --prefix @{prefix}");
        output_of(&mut run(&install));
        let library = folder.path().join(prefix).join("lib/libsabaki.a");
        assert!(library.exists(), "{target}");
        let said = fs::read_to_string(folder.path().join("cargo.said")).unwrap();
        assert!(said.starts_with("env  arguments rustc "), "{said}");
        let argument = format!("--target {target}");
        assert_eq!(said.contains("--target "), !target.is_empty(), "{said}");
        assert!(target.is_empty() || said.contains(&argument), "{said}");
    }
}

#[test]
fn the_header_has_the_version_of_the_package() {
    let line = format!("#define SABAKI_VERSION \"{}\"\n", env!("CARGO_PKG_VERSION"));
    assert!(header().contains(&line));
}

/// The functions of `sabaki.h`, by name.
fn functions(text: &str) -> Vec<String> {
    let mut names: Vec<String> = text
        .split(|letter: char| !(letter.is_alphanumeric() || letter == '_' || letter == '('))
        .filter_map(|word| word.split_once('(').map(|(name, _)| name.to_owned()))
        .filter(|name| name.starts_with("sabaki_"))
        .collect();
    names.sort();
    names.dedup();
    names
}

fn header() -> String {
    fs::read_to_string(root().join("src/capi/sabaki.h")).unwrap()
}

/// The table has every function, at its place and of its type; a program that knows the first ones alone gets those.
#[test]
fn the_table_has_every_function() {
    let folder = tempfile::tempdir().unwrap();
    let names = functions(&header()).into_iter();
    let names = names.filter(|name| name != "sabaki_get_api");
    let lines = names.map(|name| format!("HAS({})\n", name.replacen("sabaki_", "", 1)));
    let lines: Vec<String> = lines.collect();
    fs::write(folder.path().join("functions.inc"), lines.concat()).unwrap();
    let table = program(
        "c++ -std=c++11",
        &format!("{PROGRAMS}/table.cpp"),
        HEADER,
        folder.path(),
    );
    let said = output_of(&mut Command::new(table));
    assert_eq!(said, format!("{} functions\n", lines.len()));
}

/// Every function that the header declares is in the library, and no other.
#[test]
fn the_header_declares_what_there_is() {
    let mut source = String::new();
    for file in fs::read_dir(root().join("src/capi")).unwrap() {
        let file = file.unwrap().path();
        if file.extension().is_none_or(|ending| ending != "rs") {
            continue;
        }
        let text = fs::read_to_string(file).unwrap();
        let defined = text.split("extern \"C\" fn ").skip(1);
        for text in defined {
            source += text.split('(').next().unwrap();
            source += "( ";
        }
    }
    let declared = functions(&header());
    assert!(declared.len() > 15);
    assert_eq!(declared, functions(&source));
}
