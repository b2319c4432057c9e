//! A bake that takes over the results of an earlier one gives the same bytes as one from nothing, on real motion capture.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_fixtures as common;

use common::captures::captures;
use sabaki::anim::{Clip, Event};
use sabaki::archive;
use sabaki::graph::{ClipSource, GraphSettings};
use sabaki::internal::{
    BakeProgress, BakeStage, BakeWatch, ClipMatch, EarlierTables, GraphBuilder, GraphRecord,
    TableRecord, Unwatched,
};
use sabaki::maps::{BakeSettings, BakedGraph, Baker};
use sabaki_import::ClipSet;
use std::sync::atomic::{AtomicBool, Ordering};

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
    let earlier = vec![earlier.clone()];
    let (made, record, taken_over) = watched(set, part, threads, earlier, &Unwatched);
    let made = made.unwrap();
    Made {
        bytes: archive::to_bytes(&made).unwrap(),
        record,
        taken_over,
    }
}

/// A bake, which may be stopped; its record; and the number of clips that were taken over. Tables are those of the last earlier bake that
/// has any.
fn watched(
    set: &ClipSet,
    part: &Part,
    threads: usize,
    earlier: Vec<(GraphRecord, TableRecord)>,
    watch: &dyn BakeWatch,
) -> (Option<BakedGraph>, (GraphRecord, TableRecord), usize) {
    let source = ClipSource {
        skeleton: &set.skeleton,
        clips: &part.clips,
        events: &part.events,
    };
    let settings = GraphSettings {
        threads,
        ..GraphSettings::default()
    };
    let (of_graphs, of_tables): (Vec<_>, Vec<_>) = earlier.into_iter().unzip();
    let builder = GraphBuilder::onto(source, &settings, of_graphs).unwrap();
    let builder = builder.watched(watch);
    let clips: Vec<ClipMatch> = builder.clips_taken_over().cloned().collect();
    let taken_over = clips[0].count();
    let found = builder.find_transitions().unwrap();
    let built = builder.build_recorded(found).unwrap();
    let Some((graph, _)) = built.made else {
        return (None, (built.record, TableRecord::default()), taken_over);
    };
    let settings = BakeSettings {
        threads,
        ..BakeSettings::default()
    };
    let mut tables = of_tables
        .into_iter()
        .zip(clips)
        .rev()
        .map(|(record, clips)| EarlierTables { record, clips });
    let tables = tables.find(|earlier| earlier.record != TableRecord::default());
    let baker = Baker::onto(graph, settings, tables.unwrap_or_default()).unwrap();
    let maps = baker.draw_on_cpu();
    let finished = baker.finish_recorded(maps, watch).unwrap();
    (finished.made, (built.record, finished.record), taken_over)
}

/// Stops a bake at a share of a stage.
#[derive(Debug)]
struct StopAt {
    stage: BakeStage,
    share: f64,
    stopped: AtomicBool,
}

impl BakeWatch for StopAt {
    fn progress(&self, BakeProgress { stage, done, all }: BakeProgress) {
        if stage == self.stage && done as f64 >= self.share * all as f64 {
            self.stopped.store(true, Ordering::Relaxed);
        }
    }

    fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn a_bake_that_is_stopped_goes_on_where_it_was() {
    let set = captures("fight");
    let all: Vec<usize> = (0..set.clips.len()).step_by(3).collect();
    let part = Part::of(&set, &all);
    let fewer = Part::of(&set, &all[..all.len() - 2]);
    let anew = bake(&set, &part, 2, &Default::default());
    let onto = bake(&set, &fewer, 2, &Default::default()).record;
    let stops = [
        (BakeStage::Transitions, 0.3),
        (BakeStage::Feet, 0.0),
        (BakeStage::Joins, 0.2),
        (BakeStage::Links, 0.5),
        (BakeStage::Choice, 0.0),
        (BakeStage::Entries, 0.1),
        (BakeStage::Entries, 0.6),
    ];
    // With a library that has most of the clips, too, and without.
    for earlier in [None, Some(onto)] {
        let mut left: Option<(GraphRecord, TableRecord)> = None;
        for (number, (stage, share)) in stops.into_iter().enumerate() {
            let watch = StopAt {
                stage,
                share,
                stopped: AtomicBool::default(),
            };
            let records = left.take().into_iter().chain(earlier.clone());
            let records: Vec<_> = records.chain([Default::default()]).collect();
            let threads = 1 + number % 3;
            let (made, record, _) = watched(&set, &part, threads, records, &watch);
            assert!(made.is_none(), "{stage:?} does not stop");
            left = Some(record);
        }
        let is_alone = earlier.is_none();
        let records = left.into_iter().chain(earlier).collect();
        let (made, record, _) = watched(&set, &part, 2, records, &Unwatched);
        assert!(archive::to_bytes(&made.unwrap()).unwrap() == anew.bytes);
        assert!(record.0 == anew.record.0);
        assert_eq!(record.1 == anew.record.1, is_alone);
    }
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn a_bake_onto_an_earlier_one_gives_the_same_bytes() {
    let set = captures("fight");
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
