//! A bake that takes over the results of an earlier one gives the same bytes as one from nothing, on real motion capture.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_testing as common;

use common::captures::captures;
use sabaki::anim::{Clip, Event};
use sabaki::archive;
use sabaki::graph::{ClipSource, GraphError, GraphSettings};
use sabaki::internal::{EarlierTables, GraphBuilder, GraphRecord, TableRecord};
use sabaki::maps::{BakeSettings, Baker};
use sabaki_import::ClipSet;

/// Clips of a set, and their events.
struct Part {
    clips: Vec<Clip>,
    events: Vec<Event>,
}

impl Part {
    /// The clips at some indices of a set.
    fn of(set: &ClipSet, indices: &[usize]) -> Self {
        let events = indices.iter().enumerate().flat_map(|(clip, &index)| {
            let own = set.events.iter().filter(move |event| event.clip == index);
            own.map(move |event| Event {
                clip,
                ..event.clone()
            })
        });
        Self {
            clips: indices
                .iter()
                .map(|&index| set.clips[index].clone())
                .collect(),
            events: events.collect(),
        }
    }
}

/// What a bake gives.
struct Made {
    bytes: Vec<u8>,
    record: (GraphRecord, TableRecord),
    taken_over: usize,
}

fn bake(set: &ClipSet, part: &Part, threads: usize, earlier: &(GraphRecord, TableRecord)) -> Made {
    let source = ClipSource {
        skeleton: &set.skeleton,
        clips: &part.clips,
        events: &part.events,
    };
    let settings = GraphSettings {
        threads,
        ..GraphSettings::default()
    };
    let (of_graph, of_tables) = earlier.clone();
    let builder = GraphBuilder::onto(source, &settings, of_graph).unwrap();
    let clips = builder.clips_taken_over().clone();
    let taken_over = clips.count();
    let found = builder
        .find_transitions(|_| Ok::<_, GraphError>(()))
        .unwrap();
    let (graph, _, of_graph) = builder.build_recorded(found).unwrap();
    let settings = BakeSettings {
        threads,
        ..BakeSettings::default()
    };
    let tables = EarlierTables {
        record: of_tables,
        clips,
    };
    let baker = Baker::onto(graph, settings, tables).unwrap();
    let maps = baker.draw_on_cpu();
    let (baked, of_tables) = baker.finish_recorded(maps).unwrap();
    Made {
        bytes: archive::to_bytes(&baked).unwrap(),
        record: (of_graph, of_tables),
        taken_over,
    }
}

#[test]
fn a_bake_onto_an_earlier_one_gives_the_same_bytes() {
    let Some(set) = captures("fight") else {
        return;
    };
    // Every second clip, with events and without; a third of them changes from bake to bake.
    let all: Vec<usize> = (0..set.clips.len()).step_by(2).collect();
    let without = |rest: usize| -> Vec<usize> {
        let kept = all.iter().enumerate().filter(|(at, _)| at % 9 != rest);
        kept.map(|(_, &index)| index).collect()
    };
    let mut record = Default::default();
    for (bake_number, threads) in [(0, 1), (4, 3), (4, 1), (7, 2)] {
        let part = Part::of(&set, &without(bake_number));
        let anew = bake(&set, &part, 2, &Default::default());
        let onto = bake(&set, &part, threads, &record);
        assert!(anew.bytes == onto.bytes, "without {bake_number} of 9");
        assert_eq!(anew.taken_over, 0);
        assert_eq!(
            onto.taken_over > part.clips.len() / 2,
            record != Default::default()
        );
        // What was taken over can be taken over again.
        assert!(anew.record.0 == onto.record.0);
        record = onto.record;
    }
    // The order of the clips may change.
    let mut turned = without(7);
    turned.rotate_left(5);
    let part = Part::of(&set, &turned);
    let anew = bake(&set, &part, 2, &Default::default());
    let onto = bake(&set, &part, 2, &record);
    assert!(anew.bytes == onto.bytes);
    assert_eq!(onto.taken_over, turned.len() - 5);
}
