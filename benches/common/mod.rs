//! What several benches share: the clips of `SABAKI_MOCAP`'s fight folder where it is set, else the embedded motions.
#![allow(dead_code, reason = "each bench uses some of it")]
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a bench may")]

pub(crate) mod report;

use sabaki::graph::{self, GraphSettings};
use sabaki::maps::{BakeSettings, BakedGraph, MapGrid};
use sabaki_fixtures::baked::bake;
use sabaki_fixtures::captures::captures;
use sabaki_fixtures::demo::{self, Motions};

pub(crate) fn motions() -> Motions {
    if std::env::var_os("SABAKI_MOCAP").is_none() {
        return demo::motions().unwrap();
    }
    let set = captures("fight");
    Motions {
        skeleton: set.skeleton,
        clips: set.clips,
        events: set.events,
    }
}

pub(crate) fn bake_on(maps: MapGrid) -> BakedGraph {
    let (graph, _) = graph::build(motions().source(), &GraphSettings::default()).unwrap();
    let settings = BakeSettings {
        maps,
        ..BakeSettings::default()
    };
    bake(graph, settings)
}
