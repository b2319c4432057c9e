//! Skeletons, clips and events that nobody captures.

use std::iter::repeat;

use glam::Vec3;
use sabaki::anim::{Clip, Event, Skeleton};
use sabaki::graph::{self, GraphError, GraphSettings};

use super::MB;
use sabaki_fixtures::clips::{
    evasion, skeleton, small_skeleton, source, still_clip, swinging_clip,
};
use sabaki_fixtures::memory::{alone, held_at_most};
use sabaki_fixtures::with;

/// Builds in a gigabyte, and gives the error.
fn refused(skeleton: &Skeleton, clips: &[Clip], events: &[Event]) -> GraphError {
    let settings = with(|s: &mut GraphSettings| s.memory = 1 << 30);
    graph::build(source(skeleton, clips, events), &settings).unwrap_err()
}

/// A clip in which nothing moves, of two keys that lie far apart.
fn still(skeleton: &Skeleton, seconds: f64) -> Clip {
    still_clip(skeleton, "still", 1.0 / seconds, vec![Vec3::Y; 2])
}

#[test]
fn ten_hours_of_motion_make_no_graph() {
    alone(|| {
        // Ten hours in two frames: it is resampling that would fill the memory.
        let skeleton = small_skeleton();
        let (error, held) = held_at_most(|| refused(&skeleton, &[still(&skeleton, 36_000.0)], &[]));
        // 900 bytes for the joints of a frame, and 400 for the frame.
        let expected = GraphError::Memory {
            needed: 1_080_001 * 1300,
            most: 1 << 30,
        };
        assert_eq!(error, expected);
        assert!(held < MB, "{held}");
    });
}

#[test]
fn many_joints_for_long_are_refused() {
    alone(|| {
        let names: Vec<String> = (0..4096).map(|index| format!("j{index}")).collect();
        let parents = [None].into_iter().chain(repeat(Some(0)));
        let joints = names.iter().zip(parents);
        let joints: Vec<_> = joints
            .map(|(name, parent)| (&**name, parent, Vec3::Y))
            .collect();
        let skeleton = skeleton(&joints);
        let (error, held) = held_at_most(|| refused(&skeleton, &[still(&skeleton, 3600.0)], &[]));
        let words = "; 1.1 GB is the most";
        assert!(error.to_string().contains(words), "{error}");
        assert!(held < MB, "{held}");
    });
}

#[test]
fn a_clip_in_which_nothing_moves_is_answered() {
    alone(|| {
        // Each of 12 million pairs of frames is as good as all others.
        let skeleton = small_skeleton();
        let clips = [still(&skeleton, 165.0)];
        let settings = with(|s: &mut GraphSettings| s.links = None);
        let build = || graph::build(source(&skeleton, &clips, &[]), &settings);
        let (built, held) = held_at_most(build);
        assert!(built.is_ok() || matches!(built, Err(GraphError::TooMany { .. })));
        assert!(held < 1024 * MB, "{} MB", held / MB);
    });
}

#[test]
fn a_hundred_thousand_events_are_refused() {
    alone(|| {
        let skeleton = small_skeleton();
        let clips = [swinging_clip(&skeleton, 900, 0.3)];
        let event = |i| evasion(0, f64::from(i) * 1e-4, f64::from(i + 1) * 1e-4);
        let events: Vec<Event> = (0..100_000).map(event).collect();
        let (error, held) = held_at_most(|| refused(&skeleton, &clips, &events));
        assert_eq!(error.to_string(), "100000 events; 8192 is the most");
        assert!(held < MB, "{held}");
    });
}

#[test]
fn an_event_that_does_not_end_is_refused_by_number() {
    let skeleton = small_skeleton();
    let clips = [swinging_clip(&skeleton, 30 * 90, 0.3)];
    let named = format!("\"{}\", event 1 of all: ", clips[0].name());
    for (start, end) in [(3.0, 63.5), (f64::NEG_INFINITY, 1.0)] {
        let events = [evasion(0, 1.0, 2.0), evasion(0, start, end)];
        let error = refused(&skeleton, &clips, &events);
        assert!(matches!(error, GraphError::EventTooLong { .. }));
        for words in [named.as_str(), "60 s"] {
            assert!(error.to_string().contains(words), "{error}");
        }
    }
}

#[test]
fn events_that_are_there_twice_are_refused_with_both_numbers_clip_and_times() {
    let skeleton = small_skeleton();
    let clips = [swinging_clip(&skeleton, 300, 0.3)];
    let events = [
        evasion(0, 0.0, 1.0),
        evasion(0, 2.0, 3.0),
        evasion(0, 2.0, 3.001),
    ];
    let error = refused(&skeleton, &clips, &events);
    let expected = format!(
        "\"{}\" has two events of one kind in the same frames, from 2 s to 3 s (events 1 and 2 of all)",
        clips[0].name()
    );
    assert_eq!(error.to_string(), expected);
}
