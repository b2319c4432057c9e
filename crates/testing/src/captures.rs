//! Real motion capture, from the folder that `SABAKI_MOCAP` names.

use std::path::PathBuf;
use std::sync::OnceLock;

use sabaki::graph::{self, ClipSource, GraphSettings, MotionGraph};
use sabaki::maps::{BakeSettings, BakedGraph, Baker};
use sabaki_import::{ClipSet, ReadOptions, read_clips};

/// The clips of one folder, with its events where it has some; `None`, said aloud, where there is
/// no motion capture.
pub fn captures(folder: &str) -> Option<ClipSet> {
    let Some(root) = std::env::var_os("SABAKI_MOCAP") else {
        eprintln!("skipped: SABAKI_MOCAP names no folder with motion capture");
        return None;
    };
    let clips = PathBuf::from(root).join(folder);
    let events = clips.join("events.json");
    let events = events.exists().then_some(events.as_path());
    Some(
        read_clips(
            std::slice::from_ref(&clips),
            events,
            &ReadOptions::default(),
        )
        .unwrap(),
    )
}

/// What a graph of these clips is built from.
pub fn source_of(set: &ClipSet) -> ClipSource<'_> {
    ClipSource {
        skeleton: &set.skeleton,
        clips: &set.clips,
        events: &set.events,
    }
}

/// The graph of the fighter's clips, as it is built by default.
pub fn fight_graph() -> Option<MotionGraph> {
    let set = captures("fight")?;
    let built = graph::build(source_of(&set), &GraphSettings::default());
    Some(built.unwrap().0)
}

/// The fighter's clips, baked by default.
pub fn fight() -> Option<&'static BakedGraph> {
    static BAKED: OnceLock<Option<BakedGraph>> = OnceLock::new();
    let bake = || {
        let baker = Baker::new(fight_graph()?, BakeSettings::default()).unwrap();
        Some(baker.finish_on_cpu().unwrap())
    };
    BAKED.get_or_init(bake).as_ref()
}
