//! Tests of `sabaki::graph`.

use sabaki::anim::{Clip, Event};
use sabaki::graph::{self, BuildReport, EdgeMotion, GraphError, GraphSettings, MotionGraph};
use sabaki_fixtures::clips::{small_skeleton, source, swinging_clip, twice};
use sabaki_fixtures::with;

mod build;
mod distance_map;
mod feet;
mod links;
mod overlapping_events;
mod search;

/// Default settings that join no clip that nothing near leads to.
fn alone() -> GraphSettings {
    with(|s: &mut GraphSettings| s.farthest_join = Some(0.0))
}

/// Of clips of the small skeleton.
fn build(
    clips: &[Clip],
    events: &[Event],
    settings: &GraphSettings,
) -> Result<(MotionGraph, BuildReport), GraphError> {
    graph::build(source(&small_skeleton(), clips, events), settings)
}

/// A swing of so many frames that is there twice, so that it comes round.
fn round_clip(frames: usize, seed: f32) -> Clip {
    let skeleton = small_skeleton();
    twice(&skeleton, &swinging_clip(&skeleton, frames, seed))
}

/// No transition blends a part of an event.
fn assert_events_are_whole(graph: &MotionGraph) {
    for edge in graph.edges() {
        if edge.motion == EdgeMotion::Clip {
            continue;
        }
        let [from, to] = [edge.from, edge.to].map(|node| graph.node(node));
        for event in graph.events() {
            let leaves = from.clip == event.clip
                && from.frame < event.last
                && event.first < from.frame + edge.frames;
            let arrives = to.clip == event.clip
                && to.frame > event.first
                && event.last > to.frame - edge.frames;
            assert!(!leaves && !arrives, "a transition blends an event");
        }
    }
}
