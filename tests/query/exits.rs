//! Promise: an exit leads from inside an evasion or an attack to natural motion, within what the clips show a body to do.

use sabaki::BakedGraph;
use sabaki::graph::Entry;
use sabaki::graph::{self, GraphSettings, Motion, Playhead};
use sabaki::maps::{BakeSettings, EntryReport};
use sabaki::math::Rigid2;
use sabaki_fixtures::baked::{bake, embedded};
use sabaki_fixtures::demo;

use super::entries::{after, speed_shares};
use super::{centres, furthest};

/// The first exit of each event, at a third of it: the motion that plays the event, when it is left, and how.
fn left(baked: &BakedGraph) -> Vec<(Motion, f32, Entry)> {
    let graph = baked.graph();
    let events = graph
        .edge_ids()
        .filter(|&edge| graph.edge(edge).event.is_some());
    let exit = |edge| {
        let mut motion = Motion::new(graph, Playhead::at(graph, edge, 0.0, Rigid2::IDENTITY), &[]);
        motion.extend(graph, 3.0);
        let thirds = [1.0, 2.0].map(|third| third / 3.0 * graph.seconds(edge));
        let found = |seconds: f32| Some((seconds, *baked.exits_at(&motion, seconds).first()?));
        let (seconds, exit) = thirds.into_iter().find_map(found)?;
        Some((motion, seconds, exit))
    };
    events.filter_map(exit).collect()
}

#[test]
fn an_exit_begins_inside_an_event_and_ends_in_natural_motion() {
    let baked = embedded();
    let graph = baked.graph();
    let left = left(baked);
    assert!(left.len() >= 8, "{}", left.len());
    for (before, seconds, exit) in left {
        let motion = after(baked, &before, seconds, &exit);
        let start = [&before, &motion].map(|motion| centres(baked, motion, seconds));
        assert!(furthest(&start[0], &start[1]) < 1e-3);
        let event =
            |motion: &Motion, seconds: f32| graph.edge(motion.playhead(graph, seconds).edge).event;
        assert!(event(&before, seconds).is_some());
        for later in [1e-3, exit.blend, 0.4] {
            assert_eq!(event(&motion, seconds + later), None);
        }
    }
}

#[test]
fn exits_turn_no_joint_faster_than_the_clips_do() {
    let shares = speed_shares(embedded(), left(embedded()));
    let of_a_hundred = shares[shares.len() * 99 / 100];
    assert!(of_a_hundred <= 1.05, "{of_a_hundred}");
}

on_both!(most_moments_are_near_a_branch_point);

fn most_moments_are_near_a_branch_point(baked: &BakedGraph) {
    let report = baked.entry_report();
    for stretches in [report.unbranched, report.unbranched_in_events] {
        assert!(0.0 < stretches.median && stretches.median <= stretches.longest);
        assert!(stretches.median <= 0.3, "{stretches:?}");
        // The embedded motions are few.
        let is_near = stretches.longest <= 0.8 || std::ptr::eq(baked, embedded());
        assert!(is_near, "{stretches:?}");
    }
}

#[test]
fn a_graph_without_events_has_no_entries_to_report() {
    let motions = demo::motions().unwrap();
    let mut source = motions.source();
    source.events = &[];
    let (graph, _) = graph::build(source, &GraphSettings::default()).unwrap();
    let baked = bake(graph, BakeSettings::default());
    assert_eq!(baked.entry_report(), EntryReport::default());
}
