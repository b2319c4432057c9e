//! A record that is forged, with whatever is in it, stops no bake and writes no graph that cannot be read.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_fixtures as common;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use common::clips::{small_skeleton, swinging_clip};
use common::random::Random;
use common::small::{small_graph, small_maps};
use sabaki::anim::{Event, EventKind, JointId};
use sabaki::archive;
use sabaki::graph::{ClipSource, GraphSettings};
use sabaki::internal::{
    ClipMatch, EarlierTables, GraphBuilder, GraphRecord, Recorded, TableRecord, Unwatched,
};
use sabaki::maps::{BakeSettings, BakedGraph, Baker, PathSettings};
use serde::Serialize;
use serde::de::DeserializeOwned;

type Record = (GraphRecord, TableRecord);

/// A bake that is so small that it runs thousands of times.
struct Bakery {
    source: (sabaki::anim::Skeleton, Vec<sabaki::anim::Clip>, Vec<Event>),
    graph: GraphSettings,
    tables: BakeSettings,
}

impl Bakery {
    fn new() -> Self {
        let skeleton = small_skeleton();
        let clips = [0.3, 0.4, 1.1].map(|seed| swinging_clip(&skeleton, 150, seed));
        let event = |clip, kind, start, joints| Event {
            clip,
            kind,
            start,
            end: start + 0.4,
            joints,
        };
        let events = vec![
            event(0, EventKind::Evasion, 1.8, Vec::new()),
            event(1, EventKind::Attack, 2.2, vec![JointId(8)]),
        ];
        Self {
            source: (skeleton, clips.to_vec(), events),
            graph: GraphSettings {
                threads: 1,
                ..small_graph()
            },
            tables: BakeSettings {
                threads: 1,
                maps: small_maps(),
                paths: PathSettings {
                    most: 60,
                    ..PathSettings::default()
                },
                ..BakeSettings::default()
            },
        }
    }

    /// Bakes onto a record; the error of a bake that ended with one.
    fn bake(&self, (of_graph, of_tables): Record) -> Result<(BakedGraph, Record), String> {
        let (skeleton, clips, events) = &self.source;
        let source = ClipSource {
            skeleton,
            clips,
            events,
        };
        let error = |error: &dyn std::error::Error| error.to_string();
        let builder = GraphBuilder::onto(source, &self.graph, vec![of_graph]);
        let builder = builder.map_err(|it| error(&it))?;
        let clips: ClipMatch = builder.clips_taken_over().next().unwrap().clone();
        let found = builder.find_transitions().map_err(|it| error(&it))?;
        let built = builder.build_recorded(found).map_err(|it| error(&it))?;
        let (graph, _) = built.made.unwrap();
        let earlier = EarlierTables {
            record: of_tables,
            clips,
        };
        let baker = Baker::onto(graph, self.tables.clone(), earlier).map_err(|it| error(&it))?;
        let maps = baker.draw_on_cpu();
        let finished = baker.finish_recorded(maps, &Unwatched);
        let Recorded { made, record } = finished.map_err(|it| error(&it))?;
        Ok((made.unwrap(), (built.record, record)))
    }

    /// Bakes onto a forged record. What comes of it is an error or a graph that can be read.
    fn bakes_onto(&self, record: Record, what: &str) {
        let baked = catch_unwind(AssertUnwindSafe(|| self.bake(record)));
        let Ok(baked) = baked else {
            panic!("{what}: a crash")
        };
        if let Ok((baked, _)) = baked {
            let bytes = archive::to_bytes(&baked).unwrap();
            let read = archive::from_bytes(&bytes, Path::new("forged"));
            assert!(read.is_ok(), "{what}: {}", read.unwrap_err());
        }
    }
}

/// Copies of a record in which some bytes have other values, with what was changed.
fn forged<T: Serialize + DeserializeOwned>(
    record: &T,
    seed: u64,
    count: usize,
) -> impl Iterator<Item = (T, String)> {
    let bytes = postcard::to_stdvec(record).unwrap();
    let mut random = Random::new(seed);
    (0..count).filter_map(move |_| {
        let mut bytes = bytes.clone();
        let mut what = String::new();
        for _ in 0..=random.below(4) {
            let (at, value) = (random.below(bytes.len()), random.below(256) as u8);
            bytes[at] = value;
            what += &format!("byte {at} is {value}; ");
        }
        Some((postcard::from_bytes(&bytes).ok()?, what))
    })
}

#[test]
fn forged_records_of_graphs_stop_no_bake() {
    let bakery = Bakery::new();
    let (_, (graph, tables)) = bakery.bake(Record::default()).unwrap();
    let mut tried = 0;
    for (graph, what) in forged(&graph, 5, 600) {
        bakery.bakes_onto((graph, tables.clone()), &what);
        tried += 1;
    }
    assert!(tried > 100, "{tried}");
}

#[test]
fn forged_records_of_tables_stop_no_bake() {
    let bakery = Bakery::new();
    let (_, (graph, tables)) = bakery.bake(Record::default()).unwrap();
    let mut tried = 0;
    for (tables, what) in forged(&tables, 7, 600) {
        bakery.bakes_onto((graph.clone(), tables), &what);
        tried += 1;
    }
    assert!(tried > 100, "{tried}");
}
