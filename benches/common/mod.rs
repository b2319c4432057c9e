//! What several benches share: the clips of `SABAKI_MOCAP`'s fight folder where it is set, else the embedded motions.
#![allow(dead_code, reason = "each bench uses some of it")]
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a bench may")]

pub(crate) mod report;

use sabaki::anim::{Clip, Event, Skeleton};
use sabaki::graph::{self, ClipSource, GraphSettings};
use sabaki::maps::{BakeSettings, BakedGraph, Baker, MapGrid};
use sabaki_fixtures::captures::captures;
use sabaki_fixtures::demo;
use sabaki_fixtures::throw::{Throw, ThrowSettings, throw};

pub(crate) struct Motions {
    pub(crate) skeleton: Skeleton,
    pub(crate) clips: Vec<Clip>,
    pub(crate) events: Vec<Event>,
}

impl Motions {
    pub(crate) fn read() -> Self {
        if std::env::var_os("SABAKI_MOCAP").is_none() {
            let demo::Motions {
                skeleton,
                clips,
                events,
            } = demo::motions().unwrap();
            return Self {
                skeleton,
                clips,
                events,
            };
        }
        let set = captures("fight");
        Self {
            skeleton: set.skeleton,
            clips: set.clips,
            events: set.events,
        }
    }

    pub(crate) fn source(&self) -> ClipSource<'_> {
        ClipSource {
            skeleton: &self.skeleton,
            clips: &self.clips,
            events: &self.events,
        }
    }

    pub(crate) fn bake(&self) -> BakedGraph {
        self.bake_on(MapGrid::default())
    }

    pub(crate) fn bake_on(&self, maps: MapGrid) -> BakedGraph {
        let (graph, _) = graph::build(self.source(), &GraphSettings::default()).unwrap();
        let settings = BakeSettings {
            maps,
            ..BakeSettings::default()
        };
        Baker::new(graph, settings)
            .unwrap()
            .finish_on_cpu()
            .unwrap()
    }
}

pub(crate) fn throws(baked: &BakedGraph, count: u64) -> Vec<Throw> {
    (0..count)
        .map(|index| throw(baked, &ThrowSettings::default(), 5, index).unwrap())
        .collect()
}
