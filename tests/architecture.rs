//! Promise: the code keeps the house's arrows and rules: who may use whom, where Vulkan and
//! `unsafe` stand, what a file may be.
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "architecture/rules.rs"]
mod rules;
#[path = "architecture/source.rs"]
mod source;

use std::{
    fs,
    path::{Path, PathBuf},
};

use source::Source;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The names in a folder, sorted; none where it is not there.
fn names_in(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .into_iter()
        .flatten()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn names_with(folder: &Path, ending: &str) -> Vec<String> {
    let mut names = names_in(folder);
    names.retain(|name| name.ends_with(ending));
    names
}

/// Every Rust file of `folder` and of the folders in it; `folder` counts from the root.
fn read_sources(folder: &str, sources: &mut Vec<Source>) {
    for name in names_in(&root().join(folder)) {
        let path = format!("{folder}/{name}");
        let file = root().join(&path);
        if file.is_dir() {
            read_sources(&path, sources);
        } else if name.ends_with(".rs") {
            sources.push(Source::new(&path, &fs::read_to_string(file).unwrap()));
        }
    }
}

fn sources() -> Vec<Source> {
    let mut sources = Vec::new();
    read_sources("src", &mut sources);
    assert!(
        sources.len() > 10,
        "the scanner found {} files",
        sources.len()
    );
    let tests: Vec<String> = sources.iter().flat_map(Source::test_modules).collect();
    for source in &mut sources {
        if tests.contains(&source.module().join("/")) {
            source.library.clear();
        }
    }
    sources
}

fn assert_none(complaints: &[String]) {
    assert!(complaints.is_empty(), "\n{}", complaints.join("\n"));
}

fn hold(rule: fn(&Source) -> Vec<String>) {
    assert_none(&sources().iter().flat_map(rule).collect::<Vec<_>>());
}

#[test]
fn arrows_go_down_only() {
    hold(rules::arrows);
}

#[test]
fn vulkan_stands_in_gpu_and_view() {
    hold(rules::device_names);
}

#[test]
fn unsafe_stands_in_its_rooms_and_says_why() {
    hold(rules::unsafe_code);
}

#[test]
fn the_library_does_not_unwrap() {
    hold(rules::unwraps);
}

#[test]
fn files_are_read_in_one_sitting() {
    hold(rules::length);
}

#[test]
fn the_top_level_is_that_of_the_layout() {
    assert_none(&rules::top_level(&names_in(&root())));
}

#[test]
fn every_shader_has_its_spirv() {
    let folder = root().join("shaders");
    assert_none(&rules::shaders(
        &names_with(&folder, ".glsl"),
        &names_with(&folder.join("spirv"), ".spv"),
    ));
}

#[test]
fn every_test_file_opens_with_its_promise() {
    for name in names_with(&root().join("tests"), ".rs") {
        let text = fs::read_to_string(root().join("tests").join(&name)).unwrap();
        assert_none(&rules::promise(&name, &text));
    }
}

/// How the rule complains of a file with this text.
fn complaints(rule: fn(&Source) -> Vec<String>, path: &str, text: &str) -> Vec<String> {
    rule(&Source::new(path, text))
}

#[test]
fn a_wrong_arrow_is_seen_however_it_is_written() {
    for (path, text) in [
        ("src/math/rigid2.rs", "use crate::anim::Clip;"),
        ("src/anim/mod.rs", "fn f() -> crate::graph::NodeId { a, b"),
        ("src/graph/mod.rs", "\n\npub use crate::maps::Slab;"),
        (
            "src/maps/bake.rs",
            "use crate::{anim::{Clip, Pose}, query::Attack, math::Rigid2};",
        ),
        (
            "src/maps/bake.rs",
            "use crate::{\n    anim::Clip,\n    gpu,\n};",
        ),
        ("src/query/cull/cpu.rs", "use crate::gpu::Ticket;"),
        (
            "src/query/cull/cpu.rs",
            "use super::super::super::gpu::Ticket;",
        ),
        ("src/query/mod.rs", "use super::{maps::Slab, io};"),
        (
            "src/query/mod.rs",
            "mod inner { mod more { use super::super::super::io; } }",
        ),
        (
            "src/query/mod.rs",
            "#[cfg(test)]\nmod tests { use crate::demo::clips; }",
        ),
        ("src/io/bvh.rs", "use crate::demo::clips;"),
        ("src/gpu/context.rs", "use crate::io::bvh;"),
        ("src/demo/mod.rs", "use crate::gpu::Context;"),
        ("src/demo/mod.rs", "use crate::cli::bake;"),
        ("src/math/mod.rs", "use crate::*;"),
        (
            "src/math/mod.rs",
            "macro_rules! m { () => { $crate::anim::f() } }",
        ),
        ("src/new_room/mod.rs", ""),
        ("src/new_room.rs", ""),
    ] {
        assert_eq!(
            complaints(rules::arrows, path, text).len(),
            1,
            "{path}: {text}"
        );
    }
    let complaint = complaints(
        rules::arrows,
        "src/graph/mod.rs",
        "\n\npub use crate::maps::Slab;",
    );
    assert_eq!(
        complaint,
        ["src/graph/mod.rs:3: `graph` may not use `crate::maps`"]
    );
}

#[test]
fn a_right_arrow_passes() {
    for (path, text) in [
        ("src/math/rigid2.rs", "use crate::math::Lanes;"),
        (
            "src/anim/clip.rs",
            "use crate::math::{Rigid2, fixed}; use super::Pose;",
        ),
        (
            "src/maps/bake.rs",
            "use crate::{anim::{Clip, Pose}, graph::*};\npub(crate) fn f() {}",
        ),
        (
            "src/maps/bake.rs",
            "use crate::{\n    anim::Clip,\n    math::Rigid2,\n};",
        ),
        (
            "src/maps/bake.rs",
            "pub(in crate::maps) fn f(a: crate::anim::Clip, b: u8) {}",
        ),
        (
            "src/anim/clip.rs",
            "// crate::graph\n/* crate::io /* crate::gpu */ crate::io */ const A: &str = \"crate::query\";",
        ),
        (
            "src/anim/clip.rs",
            "const A: &str = r#\"crate::\"avoid\"#; const B: char = '\"'; const C: &str = \"\\\"crate::io\";",
        ),
        (
            "src/anim/clip.rs",
            "use my_crate::graph::Graph; fn f<'a>(a: &'a str) {}",
        ),
        (
            "src/anim/clip.rs",
            "#[cfg(test)]\nmod tests { use super::super::Pose; use super::*; }",
        ),
        ("src/query/cull/cpu.rs", "use super::super::attack::Attack;"),
        (
            "src/gpu/mod.rs",
            "use crate::{query::cull, maps::PackedMaps};",
        ),
        (
            "src/cli/dodge.rs",
            "use crate::{io, gpu, demo}; use sabaki::query;",
        ),
        ("src/main.rs", "mod cli; use crate::cli::run;"),
        ("src/lib.rs", "pub use crate::query::Attack;"),
    ] {
        assert_none(&complaints(rules::arrows, path, text));
    }
}

#[test]
fn vulkan_outside_its_rooms_is_seen() {
    for text in [
        "use ash::Device;",
        "use ash;",
        "fn f(a: ash::vk::Image) {}",
        "fn f(a: vk::Image) {}",
    ] {
        assert!(
            !complaints(rules::device_names, "src/query/mod.rs", text).is_empty(),
            "{text}"
        );
        assert!(
            !complaints(rules::device_names, "src/cli/doctor.rs", text).is_empty(),
            "{text}"
        );
        assert_none(&complaints(rules::device_names, "src/gpu/context.rs", text));
    }
    assert_none(&complaints(
        rules::device_names,
        "src/io/bvh.rs",
        "// ash\nlet ashes = hash; let a = \"vk::\";",
    ));
}

#[test]
fn unsafe_out_of_place_or_unexplained_is_seen() {
    for text in [
        "fn f() { unsafe { g() } }",
        "// SAFETY: no.\nunsafe impl Send for A {}",
    ] {
        assert_eq!(
            complaints(rules::unsafe_code, "src/maps/raster.rs", text).len(),
            1,
            "{text}"
        );
    }
    for text in [
        "fn f() {\n    unsafe { g() }\n}",
        "// SAFETY: of another.\nlet a = 1;\nunsafe { g() }",
        "// SAFETY: of another.\n\nunsafe { g() }",
        "// It is safe.\nunsafe impl Send for A {}",
        "/// Frees it.\nunsafe fn free() {}",
        "unsafe extern \"system\" fn hear() {}",
        "let a = \"SAFETY: in a text\"\nunsafe { g() }",
    ] {
        assert_eq!(
            complaints(rules::unsafe_code, "src/gpu/memory.rs", text).len(),
            1,
            "{text}"
        );
    }
    for text in [
        "// SAFETY: it lives.\nunsafe { g() }",
        "// SAFETY: it lives, and\n// goes on living.\n#[rustfmt::skip]\nlet a =\n    unsafe { g() };",
        "unsafe { g() } // SAFETY: it lives.",
        "/// # Safety\n/// The device lives.\n#[inline]\npub unsafe fn free() {}",
        "type Callback = unsafe extern \"system\" fn(u32);",
        "#![deny(unsafe_op_in_unsafe_fn)]",
    ] {
        assert_none(&complaints(rules::unsafe_code, "src/gpu/memory.rs", text));
        assert_none(&complaints(rules::unsafe_code, "src/math/isa.rs", text));
    }
}

#[test]
fn an_unwrap_outside_tests_is_seen() {
    for text in [
        "fn f() { a.unwrap(); }",
        "fn f() { a\n    .expect(\"b\"); }",
        "#[cfg(test)]\nmod tests { fn g() { a.unwrap(); } }\nfn f() { a.unwrap(); }",
    ] {
        assert_eq!(
            complaints(rules::unwraps, "src/io/bvh.rs", text).len(),
            1,
            "{text}"
        );
    }
    for text in [
        "fn f() { a.unwrap_or(1); a.unwrap_or_default(); expect(b); }",
        "//! a.unwrap()\n#[expect(dead_code)]\nfn f() {}",
        "#[cfg(test)]\nmod tests { fn g() { if true { a.unwrap(); } b.expect(\"}\"); } }",
        "#[cfg(all(test, feature = \"demo\"))]\nmod tests { fn g() { a.unwrap(); } }",
    ] {
        assert_none(&complaints(rules::unwraps, "src/io/bvh.rs", text));
    }
    let parent = Source::new("src/io/bvh.rs", "#[cfg(test)]\nmod tests;\nmod other;");
    assert_eq!(parent.test_modules(), ["io/bvh/tests"]);
}

#[test]
fn a_long_file_a_stranger_and_a_lone_shader_are_seen() {
    assert_none(&complaints(
        rules::length,
        "src/io/bvh.rs",
        &"\n".repeat(500),
    ));
    assert_eq!(
        complaints(rules::length, "src/io/bvh.rs", &"\n".repeat(501)).len(),
        1
    );

    let names = |names: &[&str]| {
        names
            .iter()
            .map(|&name| name.to_owned())
            .collect::<Vec<_>>()
    };
    assert_none(&rules::top_level(&names(&[
        "Cargo.toml",
        "src",
        "target",
        ".git",
    ])));
    assert_eq!(
        rules::top_level(&names(&["src", "notes.txt", "scripts"])).len(),
        2
    );

    let disc = names(&["disc.frag.glsl", "disc.vert.glsl"]);
    assert_none(&rules::shaders(
        &disc,
        &names(&["disc.frag.spv", "disc.vert.spv"]),
    ));
    assert_eq!(rules::shaders(&disc, &names(&["disc.frag.spv"])).len(), 1);
    assert_eq!(rules::shaders(&[], &names(&["disc.frag.spv"])).len(), 1);

    assert_none(&rules::promise("a.rs", "//! Promise: it holds.\n"));
    assert_eq!(rules::promise("a.rs", "use std::fs;\n//! Promise").len(), 1);
}
