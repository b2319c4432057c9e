//! The embedded motions, baked once for all tests of a file.

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

pub fn embedded() -> &'static BakedGraph {
    static BAKED: OnceLock<BakedGraph> = OnceLock::new();
    BAKED.get_or_init(|| {
        let graph = embedded_graph(&GraphSettings::default());
        Baker::new(graph, BakeSettings::default())
            .unwrap()
            .finish_on_cpu()
            .unwrap()
    })
}

/// Writes them to a folder.
pub fn embedded_file(folder: &Path) -> PathBuf {
    let file = folder.join("embedded.sabaki");
    archive::write(&file, embedded()).unwrap();
    file
}
