//! Promise: events may overlap. Each is an edge of its own, no transition blends a part of one, and what is not an event plays no part of
//! one.

use std::sync::{Arc, OnceLock};

use sabaki::anim::{Clip, Event, EventKind};
use sabaki::character::{CharacterSettings, Characters, Goal};
use sabaki::graph::{self, BuildReport, EdgeMotion, GraphSettings, MotionGraph};
use sabaki::maps::{BakeSettings, BakedGraph};
use sabaki::math::Rigid2;
use sabaki_fixtures::baked::bake;
use sabaki_fixtures::clips::{evasion, small_skeleton, swinging_clip};
use sabaki_fixtures::demo;
use sabaki_fixtures::with;

use super::{assert_events_are_whole, build};

/// The embedded motions. Of the first evasion the second half is also the first half of an attack; within the first attack of another clip
/// lies an evasion that starts with it.
fn build_overlapping() -> (MotionGraph, BuildReport) {
    let motions = demo::motions().unwrap();
    let mut events = motions.events.clone();
    let first = |is: &dyn Fn(&&Event) -> bool| events.iter().find(is).unwrap();
    let evasion = first(&|event| event.kind == EventKind::Evasion);
    let half = 0.5 * (evasion.end - evasion.start);
    let counter = Event {
        kind: EventKind::Attack,
        start: evasion.start + half,
        end: evasion.end + 0.2,
        ..evasion.clone()
    };
    let attack = first(&|event| event.kind == EventKind::Attack && event.clip != evasion.clip);
    let within = Event {
        kind: EventKind::Evasion,
        end: attack.start + 0.7 * (attack.end - attack.start),
        joints: Vec::new(),
        ..attack.clone()
    };
    events.extend([counter, within]);
    let mut source = motions.source();
    source.events = &events;
    graph::build(source, &GraphSettings::default()).unwrap()
}

fn overlapping() -> &'static (MotionGraph, BuildReport) {
    static BUILT: OnceLock<(MotionGraph, BuildReport)> = OnceLock::new();
    BUILT.get_or_init(build_overlapping)
}

fn baked() -> &'static Arc<BakedGraph> {
    static BAKED: OnceLock<Arc<BakedGraph>> = OnceLock::new();
    BAKED.get_or_init(|| Arc::new(bake(overlapping().0.clone(), BakeSettings::default())))
}

#[test]
fn each_event_is_one_edge_and_no_transition_blends_a_part_of_one() {
    let (graph, report) = overlapping();
    let motions = demo::motions().unwrap();
    let events = motions.events.len() + 2;
    graph.validate().unwrap();
    assert_eq!(graph.events().len(), events);
    assert!(report.links.unlinked.is_empty());
    for id in 0..events {
        let is_of = |edge: &&graph::Edge| edge.event.is_some_and(|event| event.index() == id);
        let edges: Vec<_> = graph.edges().iter().filter(is_of).collect();
        assert_eq!(edges.len(), 1);
        let [from, to] = [edges[0].from, edges[0].to].map(|node| graph.node(node));
        let event = &graph.events()[id];
        assert_eq!([from.frame, to.frame], [event.first, event.last]);
    }
    assert_events_are_whole(graph);
    let seconds: f64 = motions.clips.iter().map(Clip::duration).sum();
    assert!(graph.seconds_kept() <= seconds + 1e-9);
}

#[test]
fn natural_edges_play_no_part_of_an_event_and_all_else() {
    let (graph, _) = overlapping();
    let frames = |edge: &graph::Edge| {
        let from = graph.node(edge.from);
        (from.frame..from.frame + edge.frames).map(move |frame| (from.clip, frame))
    };
    let mut natural: Vec<_> = graph
        .natural_edges()
        .flat_map(|id| frames(graph.edge(id)))
        .collect();
    let mut wanted: Vec<_> = graph
        .edges()
        .iter()
        .filter(|edge| edge.motion == EdgeMotion::Clip)
        .flat_map(frames)
        .filter(|&(clip, frame)| {
            let plays = |event: &graph::GraphEvent| {
                event.clip == clip && (event.first..event.last).contains(&frame)
            };
            !graph.events().iter().any(plays)
        })
        .collect();
    natural.sort_unstable();
    wanted.sort_unstable();
    wanted.dedup();
    assert_eq!(natural, wanted);
}

#[test]
fn the_clip_goes_on_through_events_that_overlap() {
    let (graph, _) = overlapping();
    for first in graph.events() {
        let plays = |id: &graph::EdgeId| {
            let event = graph.edge(*id).event;
            event.map(|event| graph.event(event)) == Some(first)
        };
        let mut edge = graph.edge_ids().find(plays).unwrap();
        let mut at = (first.clip, first.first);
        for _ in 0..6 {
            if graph.edge(edge).motion != EdgeMotion::Clip {
                break;
            }
            let from = graph.node(graph.edge(edge).from);
            assert_eq!((from.clip, from.frame), at);
            at.1 += graph.edge(edge).frames;
            edge = graph.natural_edge(graph.edge(edge).to);
        }
        assert!(at.1 >= first.last);
    }
}

#[test]
fn evasions_that_start_in_one_frame_are_both_found_and_the_file_holds_them() {
    let baked = baked();
    let evasions = baked.graph().edges_with(EventKind::Evasion).count();
    assert_eq!(baked.evasions().len(), evasions);
    let attacks = baked.graph().edges_with(EventKind::Attack).count();
    assert_eq!(baked.attack_moves().len(), attacks);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("overlapping.sabaki");
    sabaki::archive::write(&path, baked).unwrap();
    assert_eq!(&sabaki::archive::read(&path).unwrap(), baked.as_ref());
}

#[test]
fn what_is_steered_plays_no_part_of_an_event() {
    let baked = baked();
    let graph = baked.graph();
    let mut characters = Characters::new(Arc::clone(baked), CharacterSettings::default()).unwrap();
    let id = characters.spawn(Rigid2::IDENTITY).unwrap();
    let mut natural = vec![false; graph.edges().len()];
    graph
        .natural_edges()
        .for_each(|edge| natural[edge.index()] = true);
    let mut events = Vec::new();
    for frame in 0..60 * 30 {
        let goal = match frame / 240 % 2 {
            0 => Goal::Idle,
            _ => Goal::Stop,
        };
        characters.steer(id, goal).unwrap();
        characters.step(1.0 / 60.0, &[], &mut events);
        let edge = characters.playhead(id).unwrap().edge;
        let is_clip = graph.edge(edge).motion == EdgeMotion::Clip;
        assert!(!is_clip || natural[edge.index()], "frame {frame}");
    }
}

#[test]
fn many_events_that_lie_in_each_other_build() {
    let skeleton = small_skeleton();
    let clips = [swinging_clip(&skeleton, 30 * 90, 0.3)];
    let inset = (0..100).map(|index| 0.1 * f64::from(index));
    let events: Vec<Event> = inset.map(|by| evasion(0, 5.0 + by, 45.0 - by)).collect();
    let settings = with(|s: &mut GraphSettings| s.threshold = 10.0);
    let (graph, _) = build(&clips, &events, &settings).unwrap();
    assert_eq!(graph.events().len(), events.len());
    graph.validate().unwrap();
}
