//! Promise: events may overlap. Each is an edge of its own, no transition blends a part of one, and what is not an event plays no part of
//! one.

use std::sync::{Arc, OnceLock};

use sabaki::anim::{Event, EventKind};
use sabaki::character::{CharacterSettings, Characters, Goal};
use sabaki::graph::{self, BuildReport, ClipSource, EdgeMotion, GraphSettings, MotionGraph};
use sabaki::maps::{BakeSettings, BakedGraph, Baker};
use sabaki::math::Rigid2;
use sabaki_fixtures::clips::{small_skeleton, swinging_clip};
use sabaki_fixtures::demo;

/// What is built of motions with events that overlap.
struct Overlapping {
    graph: MotionGraph,
    report: BuildReport,
    events: Vec<Event>,
}

/// The embedded motions. Of the first evasion the second half is also the first half of an attack; within the first attack of another clip
/// lies an evasion that starts with it.
fn overlapping() -> &'static Overlapping {
    static BUILT: OnceLock<Overlapping> = OnceLock::new();
    BUILT.get_or_init(build_overlapping)
}

fn build_overlapping() -> Overlapping {
    let motions = demo::motions().unwrap();
    let mut events = motions.events.clone();
    let evasion = events
        .iter()
        .find(|event| event.kind == EventKind::Evasion)
        .unwrap();
    let half = 0.5 * (evasion.end - evasion.start);
    let counter = Event {
        kind: EventKind::Attack,
        start: evasion.start + half,
        end: evasion.end + 0.2,
        ..evasion.clone()
    };
    let attack = events
        .iter()
        .find(|event| event.kind == EventKind::Attack && event.clip != evasion.clip)
        .unwrap();
    let within = Event {
        kind: EventKind::Evasion,
        end: attack.start + 0.7 * (attack.end - attack.start),
        joints: Vec::new(),
        ..attack.clone()
    };
    events.extend([counter, within]);
    let source = ClipSource {
        events: &events,
        ..motions.source()
    };
    let (graph, report) = graph::build(source, &GraphSettings::default()).unwrap();
    Overlapping {
        graph,
        report,
        events,
    }
}

fn baked() -> &'static Arc<BakedGraph> {
    static BAKED: OnceLock<Arc<BakedGraph>> = OnceLock::new();
    BAKED.get_or_init(|| {
        let baker = Baker::new(overlapping().graph.clone(), BakeSettings::default()).unwrap();
        Arc::new(baker.finish_on_cpu().unwrap())
    })
}

#[test]
fn each_event_is_one_edge_and_no_transition_blends_a_part_of_one() {
    let Overlapping {
        graph,
        report,
        events,
    } = overlapping();
    graph.validate().unwrap();
    assert_eq!(graph.events().len(), events.len());
    assert!(report.links.unlinked.is_empty());
    for id in 0..events.len() {
        let is_of = |edge: &&graph::Edge| edge.event.is_some_and(|event| event.index() == id);
        let edges: Vec<_> = graph.edges().iter().filter(is_of).collect();
        assert_eq!(edges.len(), 1);
        let [from, to] = [edges[0].from, edges[0].to].map(|node| graph.node(node));
        let event = &graph.events()[id];
        assert_eq!([from.frame, to.frame], [event.first, event.last]);
    }
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
            assert!(!leaves && !arrives);
        }
    }
    let seconds: f64 = demo::motions()
        .unwrap()
        .clips
        .iter()
        .map(|c| c.duration())
        .sum();
    assert!(graph.seconds_kept() <= seconds + 1e-9);
}

#[test]
fn natural_edges_play_no_part_of_an_event_and_all_else() {
    let Overlapping { graph, .. } = overlapping();
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
    let Overlapping { graph, .. } = overlapping();
    for first in graph.events() {
        let start = |edge: &graph::Edge| graph.node(edge.from);
        let edge = graph.edge_ids().find(|&id| {
            let edge = graph.edge(id);
            let event = edge.event.map(|event| graph.event(event));
            event == Some(first)
        });
        let mut edge = edge.unwrap();
        let mut at = (first.clip, first.first);
        for _ in 0..6 {
            if graph.edge(edge).motion != EdgeMotion::Clip {
                break;
            }
            let from = start(graph.edge(edge));
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
    let event = |index: usize| Event {
        clip: 0,
        kind: EventKind::Evasion,
        start: 5.0 + 0.1 * index as f64,
        end: 45.0 - 0.1 * index as f64,
        joints: Vec::new(),
    };
    let events: Vec<Event> = (0..100).map(event).collect();
    let source = ClipSource {
        skeleton: &skeleton,
        clips: &clips,
        events: &events,
    };
    let settings = GraphSettings {
        threshold: 10.0,
        ..GraphSettings::default()
    };
    let (graph, _) = graph::build(source, &settings).unwrap();
    assert_eq!(graph.events().len(), events.len());
    graph.validate().unwrap();
}
