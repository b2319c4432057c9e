//! Promise: the guide names files that are there, and limits that are those of the code.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::collections::BTreeMap;
use std::path::Path;

use sabaki::anim::Skeleton;
use sabaki::archive::LARGEST_FILE;
use sabaki::character::CharacterSettings;
use sabaki::gpu::CullerDesc;
use sabaki::graph::GraphSettings;
use sabaki::lod::LevelSettings;
use sabaki::maps::{MapGrid, PathSettings};
use sabaki::query::{Attack, QuerySettings};
use sabaki_import::{LONGEST_CLIP, MOST_ENTRIES, bvh, gltf};

const PAGES: [(&str, &str); 15] = [
    ("from_clips.md", include_str!("../src/guide/from_clips.md")),
    ("paper.md", include_str!("../src/guide/paper.md")),
    ("culling.md", include_str!("../src/guide/culling.md")),
    ("limits.md", include_str!("../src/guide/limits.md")),
    ("README.md", include_str!("../README.md")),
    ("CONTRIBUTING.md", include_str!("../CONTRIBUTING.md")),
    ("crowds.md", include_str!("../src/guide/crowds.md")),
    ("game_loop.md", include_str!("../src/guide/game_loop.md")),
    ("app", include_str!("../crates/app/README.md")),
    ("import", include_str!("../crates/import/README.md")),
    ("amd", include_str!("../vendor-notes/amd.md")),
    ("intel", include_str!("../vendor-notes/intel.md")),
    ("lavapipe", include_str!("../vendor-notes/lavapipe.md")),
    ("moltenvk", include_str!("../vendor-notes/moltenvk.md")),
    ("nvidia", include_str!("../vendor-notes/nvidia.md")),
];

/// What stands between backticks and begins like a file of the repository.
fn files(page: &str) -> impl Iterator<Item = &str> {
    const FOLDERS: [&str; 7] = [
        "src/",
        "crates/",
        "tests/",
        "benches/",
        "examples/",
        "shaders/",
        "vendor-notes/",
    ];
    let quoted = page.split('`').skip(1).step_by(2);
    let first = quoted.filter_map(|code| code.split_whitespace().next());
    first.filter(|word| FOLDERS.iter().any(|room| word.starts_with(room)))
}

#[test]
fn every_file_that_is_named_is_there() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut count = 0;
    for (page, text) in PAGES {
        for file in files(text) {
            assert!(root.join(file).exists(), "{page} names {file}");
            count += 1;
        }
    }
    assert!(count > 80, "{count}");
}

/// The rows of a table whose first two cells are a name in backticks and a number.
fn limits() -> BTreeMap<&'static str, f64> {
    let rows = PAGES[3].1.lines().filter_map(|line| {
        let mut cells = line.split('|').map(str::trim).skip(1);
        let name = cells.next()?.strip_prefix('`')?.strip_suffix('`')?;
        Some((name, cells.next()?.parse().unwrap()))
    });
    rows.collect()
}

#[test]
fn the_limits_are_those_of_the_code() {
    let code = [
        ("Skeleton::MAX_JOINTS", Skeleton::MAX_JOINTS as f64),
        ("Skeleton::FURTHEST", f64::from(Skeleton::FURTHEST)),
        ("LARGEST_FILE", LARGEST_FILE as f64),
        ("LONGEST_CLIP", LONGEST_CLIP),
        ("MOST_ENTRIES", MOST_ENTRIES as f64),
        ("bvh::MOST_CHANNELS", bvh::MOST_CHANNELS as f64),
        ("gltf::MOST_VERTICES", gltf::MOST_VERTICES as f64),
        ("GraphSettings::MEMORY", GraphSettings::MEMORY as f64),
        (
            "GraphSettings::MOST_FOUND",
            GraphSettings::MOST_FOUND as f64,
        ),
        (
            "GraphSettings::MOST_EVENTS",
            GraphSettings::MOST_EVENTS as f64,
        ),
        ("GraphSettings::LONGEST_EVENT", GraphSettings::LONGEST_EVENT),
        (
            "GraphSettings::MOST_TRANSITIONS",
            GraphSettings::MOST_TRANSITIONS as f64,
        ),
        (
            "PathSettings::MOST_OF_ALL",
            PathSettings::MOST_OF_ALL as f64,
        ),
        (
            "LevelSettings::MOST_JOINTS",
            LevelSettings::MOST_JOINTS as f64,
        ),
        ("LevelSettings::MOST_WORK", LevelSettings::MOST_WORK as f64),
        ("MapGrid::MAX_SIDE", f64::from(MapGrid::MAX_SIDE)),
        ("MapGrid::MAX_SLICES", f64::from(MapGrid::MAX_SLICES)),
        ("Attack::MOST_KEYS", Attack::MOST_KEYS as f64),
        ("Attack::LATEST", f64::from(Attack::LATEST)),
        ("Attack::FURTHEST", f64::from(Attack::FURTHEST)),
        ("Attack::WIDEST", f64::from(Attack::WIDEST)),
        (
            "CullerDesc::MOST_FRAMES",
            f64::from(CullerDesc::MOST_FRAMES),
        ),
        (
            "CharacterSettings::MOST_DELAY",
            f64::from(CharacterSettings::MOST_DELAY),
        ),
        (
            "QuerySettings::MOST_CANDIDATES",
            QuerySettings::MOST_CANDIDATES as f64,
        ),
    ];
    assert_eq!(limits(), code.into_iter().collect());
}

/// A number of a table's row, by the row's first cells and the column.
fn cell(text: &str, row: [&str; 3], column: usize) -> String {
    let line = text.lines().find(|line| {
        let cells: Vec<&str> = line.split('|').map(str::trim).skip(1).collect();
        cells.len() > column
            && cells
                .iter()
                .zip(row)
                .all(|(cell, wanted)| wanted.is_empty() || *cell == wanted)
    });
    let line = line.unwrap_or_else(|| panic!("no row {row:?}"));
    line.split('|')
        .map(str::trim)
        .nth(column + 1)
        .unwrap()
        .to_owned()
}

#[test]
fn the_figures_of_culling_are_those_of_the_record() {
    let record = include_str!("../benches/record/2026-11-21-epyc-2-cores-culling.md");
    for candidates in ["5", "100", "1,000", "10,000"] {
        for (maps, ours) in [("default", "default"), ("paper", "the paper's")] {
            for path in 0..3 {
                let measured = cell(record, [candidates, maps, "choice"], 3 + path);
                let shown = cell(PAGES[2].1, [candidates, ours, ""], 2 + path);
                assert_eq!(shown, measured, "{candidates} {maps}");
            }
        }
    }
}
