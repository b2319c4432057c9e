//! Promise: the guide names files that are there, and limits that are those of the code.

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

const PAGES: [(&str, &str); 16] = [
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
    (
        "swiftshader",
        include_str!("../vendor-notes/swiftshader.md"),
    ),
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
        let cells = cells(line);
        let name = cells.first()?.strip_prefix('`')?.strip_suffix('`')?;
        Some((name, cells[1].parse().unwrap()))
    });
    rows.collect()
}

#[test]
fn the_limits_are_those_of_the_code() {
    macro_rules! limits {
        ($($limit:path),* $(,)?) => {
            BTreeMap::from([$((stringify!($limit), $limit as f64)),*])
        };
    }
    let code = limits![
        Skeleton::MAX_JOINTS,
        Skeleton::FURTHEST,
        LARGEST_FILE,
        LONGEST_CLIP,
        MOST_ENTRIES,
        bvh::MOST_CHANNELS,
        gltf::MOST_VERTICES,
        GraphSettings::MEMORY,
        GraphSettings::MOST_FOUND,
        GraphSettings::MOST_EVENTS,
        GraphSettings::LONGEST_EVENT,
        GraphSettings::MOST_TRANSITIONS,
        PathSettings::MOST_OF_ALL,
        LevelSettings::MOST_JOINTS,
        LevelSettings::MOST_WORK,
        MapGrid::MAX_SIDE,
        MapGrid::MAX_SLICES,
        Attack::MOST_KEYS,
        Attack::LATEST,
        Attack::FURTHEST,
        Attack::WIDEST,
        CullerDesc::MOST_FRAMES,
        CharacterSettings::MOST_DELAY,
        QuerySettings::MOST_CANDIDATES,
    ];
    assert_eq!(limits(), code);
}

/// The cells of a table's row.
fn cells(line: &str) -> Vec<&str> {
    let inner = line
        .strip_prefix('|')
        .and_then(|line| line.strip_suffix('|'));
    inner.map_or(Vec::new(), |inner| {
        inner.split('|').map(str::trim).collect()
    })
}

/// Whether all cells stand in a row, in their order.
fn is_in(row: &[&str], wanted: &[&str]) -> bool {
    let mut row = row.iter();
    wanted.iter().all(|cell| row.any(|other| other == cell))
}

/// Of each machine and kind, the record with the latest date is the one that a page may name; the tables below it have its
/// figures.
#[test]
fn figures_are_those_of_the_newest_records() {
    const FOLDER: &str = "benches/record/";
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(FOLDER);
    let names: Vec<String> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    let (mut named, mut compared) = (0, 0);
    for (page, text) in PAGES {
        let mut record = String::new();
        for line in text.lines() {
            if line.starts_with('#') {
                record.clear();
            }
            if let Some((_, after)) = line.split_once(FOLDER) {
                let name = after.split('`').next().unwrap();
                let (date, kind) = name.split_at("2026-11-27".len());
                let newest = names.iter().filter(|other| other.ends_with(kind)).max();
                let newest = newest.map(|newest| &newest[..date.len()]);
                assert_eq!(newest, Some(date), "{page}: {name}");
                record = std::fs::read_to_string(folder.join(name)).unwrap();
                named += 1;
            }
            let row = cells(line);
            let is_figure = |cell: &&str| cell.starts_with(|c: char| c.is_ascii_digit());
            if record.is_empty() || row.last().is_none_or(|cell| !is_figure(cell)) {
                continue;
            }
            let is_known = record.lines().any(|line| is_in(&cells(line), &row));
            assert!(is_known, "{page}: {line}");
            compared += 1;
        }
    }
    assert!(named >= 2 && compared >= 20, "{named} {compared}");
}
