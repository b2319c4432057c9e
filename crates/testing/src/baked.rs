//! The embedded motions, baked once for the tests of all packages.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use sabaki::archive;
use sabaki::graph::{self, ClipSource, GraphSettings, MotionGraph};
use sabaki::maps::{BakeSettings, BakedGraph, Baker};
use sabaki_app::demo;

pub fn embedded_graph(settings: &GraphSettings) -> MotionGraph {
    let motions = demo::motions().unwrap();
    let source = ClipSource {
        skeleton: &motions.skeleton,
        clips: &motions.clips,
        events: &motions.events,
    };
    graph::build(source, settings).unwrap().0
}

/// Read from a file, which the first process of this build that asks for them has baked.
pub fn embedded() -> &'static BakedGraph {
    static BAKED: OnceLock<BakedGraph> = OnceLock::new();
    BAKED.get_or_init(|| archive::read(baked_file()).unwrap())
}

/// Copies them to a folder.
pub fn embedded_file(folder: &Path) -> PathBuf {
    let file = folder.join("embedded.sabaki");
    fs::copy(baked_file(), &file).unwrap();
    file
}

fn baked_file() -> &'static Path {
    static FILE: OnceLock<&Path> = OnceLock::new();
    FILE.get_or_init(|| {
        let file = Path::new(env!("SABAKI_EMBEDDED"));
        if !file.exists() {
            let graph = embedded_graph(&GraphSettings::default());
            let baker = Baker::new(graph, BakeSettings::default()).unwrap();
            archive::write(file, &baker.finish_on_cpu().unwrap()).unwrap();
        }
        file
    })
}
