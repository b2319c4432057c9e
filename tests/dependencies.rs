//! Promise: what a user of the crate builds has a licence that `deny.toml` allows, and comes from the registry.
//!
//! A part of what `cargo deny check` does, for whoever does not have it.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

use serde_json::Value;

/// The list under `allow = [` of `deny.toml`.
fn allowed() -> BTreeSet<String> {
    let text = include_str!("../deny.toml");
    let list = text.split("allow = [").nth(1).unwrap();
    let list = list.split(']').next().unwrap();
    let names = list.split('"').skip(1).step_by(2);
    names.map(str::to_owned).collect()
}

/// Whether an expression of licences (`A OR B AND C`, older ones with `/` for OR) holds for the allowed ones.
fn is_allowed(expression: &str, allowed: &BTreeSet<String>) -> bool {
    let plain = expression.replace('/', " OR ");
    // No dependency has an OR within an AND within an OR: parentheses stand around ORs alone.
    if let Some((before, rest)) = plain.split_once('(') {
        let (inside, after) = rest.split_once(')').unwrap();
        // What is in them is one name that is allowed, or none.
        let one = if is_allowed(inside, allowed) {
            allowed.first().unwrap().as_str()
        } else {
            "NONE"
        };
        return is_allowed(&format!("{before}{one}{after}"), allowed);
    }
    let all = |part: &str| {
        part.split(" AND ")
            .all(|name| allowed.contains(name.trim()))
    };
    plain.split(" OR ").any(all)
}

fn metadata() -> Value {
    let compiler = Command::new("rustc").arg("-vV").output().unwrap();
    let compiler = String::from_utf8(compiler.stdout).unwrap();
    let host = compiler
        .lines()
        .find_map(|line| line.strip_prefix("host: "))
        .unwrap()
        .to_owned();
    let output = Command::new(env!("CARGO"))
        .args([
            "metadata",
            "--format-version=1",
            "--offline",
            "--locked",
            "--filter-platform",
            &host,
        ])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn licences_and_sources_are_those_that_are_allowed() {
    let (metadata, allowed) = (metadata(), allowed());
    assert!(allowed.len() > 5, "{allowed:?}");
    let packages: BTreeMap<&str, &Value> = { metadata["packages"].as_array().unwrap().iter() }
        .map(|package| (package["id"].as_str().unwrap(), package))
        .collect();
    let mut complaints = Vec::new();
    let nodes = metadata["resolve"]["nodes"].as_array().unwrap();
    for node in nodes {
        let package = packages[node["id"].as_str().unwrap()];
        let (name, version) = (&package["name"], &package["version"]);
        let licence = package["license"].as_str().unwrap_or("none");
        if !is_allowed(licence, &allowed) {
            complaints.push(format!("{name} {version}: {licence}"));
        }
        match package["source"].as_str() {
            Some(source) if source.starts_with("registry+") => {}
            None if *name == "sabaki" => {}
            other => complaints.push(format!("{name} {version}: from {other:?}")),
        }
    }
    assert!(nodes.len() > 30, "{}", nodes.len());
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

#[test]
fn expressions_are_read() {
    let allowed: BTreeSet<String> = ["MIT", "Zlib"].map(str::to_owned).into();
    for good in [
        "MIT",
        "GPL-3.0 OR MIT",
        "MIT/Apache-2.0",
        "(MIT OR GPL-3.0) AND Zlib",
        "MIT AND Zlib",
    ] {
        assert!(is_allowed(good, &allowed), "{good}");
    }
    for bad in [
        "GPL-3.0",
        "MIT AND GPL-3.0",
        "(GPL-3.0 OR Apache-2.0) AND MIT",
        "none",
        "",
    ] {
        assert!(!is_allowed(bad, &allowed), "{bad}");
    }
}
