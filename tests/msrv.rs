//! Promise: nothing that a user of the crate builds needs a newer Rust than `rust-version` in
//! Cargo.toml.
//!
//! Held for this machine and the features that the test is built with. That our own code keeps to
//! it is for clippy's `incompatible_msrv`, which Cargo.toml denies.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::{
    collections::{BTreeMap, BTreeSet},
    process::Command,
};

use serde_json::Value;

/// A Rust version; parts that are not said are 0.
type Version = [u32; 3];

fn version(text: &str) -> Version {
    let mut parts = text.split('.').map(|part| part.parse().unwrap());
    [(); 3].map(|()| parts.next().unwrap_or(0))
}

fn output_of(program: &str, arguments: &[&str]) -> String {
    let output = Command::new(program)
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{program} {arguments:?}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout).unwrap()
}

/// What cargo knows of the build at hand. Everything in it has been built just now, so it is all on
/// this machine.
fn metadata() -> Value {
    let compiler = output_of("rustc", &["-vV"]);
    let host = compiler
        .lines()
        .find_map(|line| line.strip_prefix("host: "))
        .unwrap();
    let features: Vec<&str> = [
        ("demo", cfg!(feature = "demo")),
        ("cli", cfg!(feature = "cli")),
        ("vulkan", cfg!(feature = "vulkan")),
        ("capi", cfg!(feature = "capi")),
        ("view", cfg!(feature = "view")),
        ("shaderc", cfg!(feature = "shaderc")),
    ]
    .into_iter()
    .filter_map(|(name, is_on)| is_on.then_some(name))
    .collect();
    let text = output_of(
        env!("CARGO"),
        &[
            "metadata",
            "--format-version=1",
            "--offline",
            "--locked",
            "--filter-platform",
            host,
            "--no-default-features",
            "--features",
            &features.join(","),
        ],
    );
    serde_json::from_str(&text).unwrap()
}

fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key].as_str().unwrap()
}

/// The packages reached from the root by normal and build dependencies: what a user builds.
/// Dev-dependencies are ours alone.
fn built_for_users(metadata: &Value) -> BTreeSet<&str> {
    let nodes: BTreeMap<&str, &Value> = metadata["resolve"]["nodes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|node| (text(node, "id"), node))
        .collect();
    let mut reached = BTreeSet::new();
    let mut next = vec![text(&metadata["resolve"], "root")];
    while let Some(id) = next.pop() {
        if reached.insert(id) {
            let dependencies = nodes[id]["deps"].as_array().unwrap().iter();
            next.extend(
                dependencies
                    .filter(|one| is_built_for_users(one))
                    .map(|one| text(one, "pkg")),
            );
        }
    }
    reached
}

fn is_built_for_users(dependency: &Value) -> bool {
    let kinds = dependency["dep_kinds"].as_array().unwrap();
    kinds.iter().any(|kind| kind["kind"] != "dev")
}

/// The packages that need a newer Rust than the root package says.
fn too_new(metadata: &Value) -> Vec<String> {
    let built = built_for_users(metadata);
    let root = text(&metadata["resolve"], "root");
    let packages = metadata["packages"].as_array().unwrap();
    let ours = packages
        .iter()
        .find(|package| text(package, "id") == root)
        .unwrap();
    let limit = version(text(ours, "rust_version"));
    packages
        .iter()
        .filter(|package| built.contains(text(package, "id")))
        .filter_map(|package| Some((package, package["rust_version"].as_str()?)))
        .filter(|(_, needs)| version(needs) > limit)
        .map(|(package, needs)| {
            format!(
                "{} {} needs Rust {needs}",
                text(package, "name"),
                text(package, "version")
            )
        })
        .collect()
}

#[test]
fn no_dependency_needs_a_newer_rust() {
    let metadata = metadata();
    assert!(built_for_users(&metadata).len() > 5, "the graph is there");
    let found = too_new(&metadata);
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn a_newer_dependency_is_seen_behind_another_and_a_dev_dependency_is_not() {
    let package = |id: &str, rust: Option<&str>| serde_json::json!({"id": id, "name": id, "version": "1.0.0", "rust_version": rust});
    let node = |id: &str, deps: &[(&str, Option<&str>)]| {
        let deps: Vec<Value> = deps
            .iter()
            .map(|(id, kind)| serde_json::json!({"pkg": id, "dep_kinds": [{"kind": kind}]}))
            .collect();
        serde_json::json!({"id": id, "deps": deps})
    };
    let metadata = serde_json::json!({
        "packages": [
            package("ours", Some("1.88")),
            package("old", Some("1.9.5")),
            package("silent", None),
            package("newer", Some("1.88.1")),
            package("for_tests", Some("1.99")),
        ],
        "resolve": {"root": "ours", "nodes": [
            node("ours", &[("old", None), ("silent", Some("build")), ("for_tests", Some("dev"))]),
            node("old", &[]),
            node("silent", &[("newer", None)]),
            node("newer", &[("ours", None)]),
            node("for_tests", &[]),
        ]},
    });
    assert_eq!(too_new(&metadata), ["newer 1.0.0 needs Rust 1.88.1"]);
}
