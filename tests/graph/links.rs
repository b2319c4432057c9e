//! Links let more moments of a graph reach evasions, keep events that would be dropped, and never
//! cut an event. If an event cannot be linked, the report gives the reason.

use sabaki::anim::{Clip, EventKind};
use sabaki::graph::{
    self, BuildReport, EdgeMotion, GraphError, GraphSettings, LinkGoal, LinkObstacle, LinkReport,
    LinkSettings, MotionGraph,
};
use sabaki_fixtures::captures::{captures, source_of};
use sabaki_fixtures::clips::{evasion, small_skeleton, swinging_clip};
use sabaki_fixtures::demo;

use super::{alone, assert_events_are_whole, build, round_clip};

/// No node and no blend inside an event, and all that a graph promises.
fn assert_sound(graph: &MotionGraph) {
    graph.validate().unwrap();
    assert_events_are_whole(graph);
    for edge in graph.edges() {
        for node in [edge.from, edge.to].map(|node| graph.node(node)) {
            let cuts = |event: &graph::GraphEvent| {
                node.clip == event.clip && event.first < node.frame && node.frame < event.last
            };
            assert!(!graph.events().iter().any(cuts), "a node cuts");
        }
    }
}

/// How many different evasions can start within `seconds`, for each moment: every way again and
/// again until nothing changes.
fn evasions_within(graph: &MotionGraph, seconds: f64) -> Vec<usize> {
    let limit = (seconds * graph.frame_rate()).floor();
    let clip_edges = || {
        let edges = graph.edges().iter();
        edges.filter(|edge| edge.motion == EdgeMotion::Clip)
    };
    let moments: u32 = clip_edges().map(|edge| edge.frames).sum();
    let mut counts = vec![0; moments as usize];
    for (evasion, _) in graph.edges_with(EventKind::Evasion) {
        let mut waits = vec![f64::INFINITY; graph.nodes().len()];
        waits[graph.edge(evasion).from.index()] = 0.0;
        let mut changed = true;
        while std::mem::take(&mut changed) {
            for edge in graph.edges() {
                let over = waits[edge.to.index()] + f64::from(edge.frames);
                changed |= over < waits[edge.from.index()];
                waits[edge.from.index()] = waits[edge.from.index()].min(over);
            }
        }
        let to_go = clip_edges().flat_map(|edge| (1..=edge.frames).map(move |f| (edge.to, f)));
        for (count, (node, frames)) in counts.iter_mut().zip(to_go) {
            *count += usize::from(waits[node.index()] + f64::from(frames) <= limit);
        }
    }
    counts
}

/// Checks a report's figures against the graph.
fn assert_report(graph: &MotionGraph, report: &BuildReport) {
    assert_eq!(report.responsiveness.len(), 3);
    for found in &report.responsiveness {
        let mut counts = evasions_within(graph, found.seconds);
        let all = counts.len() as f64;
        let some = counts.iter().filter(|&&count| count > 0).count() as f64;
        assert!((found.share - some / all).abs() < 1e-9, "{found:?}");
        let sum: usize = counts.iter().sum();
        assert!((found.mean - sum as f64 / all).abs() < 1e-9, "{found:?}");
        counts.sort_unstable();
        assert_eq!(found.median, counts[counts.len() / 2]);
    }
    for found in &report.links.goals {
        let counts = evasions_within(graph, found.goal.seconds);
        let met = counts.iter().filter(|&&count| count >= found.goal.evasions);
        let share = met.count() as f64 / counts.len() as f64;
        assert!((found.reached - share).abs() < 1e-9, "{found:?}, {share}");
    }
}

fn without_links() -> GraphSettings {
    GraphSettings {
        links: None,
        ..alone()
    }
}

fn with(change: impl FnOnce(&mut LinkSettings)) -> GraphSettings {
    let mut links = LinkSettings::default();
    change(&mut links);
    GraphSettings {
        links: Some(links),
        ..alone()
    }
}

fn goal(seconds: f64, evasions: usize, share: f64) -> LinkGoal {
    LinkGoal {
        seconds,
        evasions,
        share,
    }
}

#[test]
fn the_embedded_motions_reach_their_goals() {
    let motions = demo::motions().unwrap();
    let source = motions.source();
    let (plain, before) = graph::build(source, &without_links()).unwrap();
    assert_eq!(before.links, LinkReport::default());
    assert!(plain.edges().iter().all(|edge| match edge.motion {
        EdgeMotion::Clip => true,
        EdgeMotion::Transition { distance, .. } => distance < 0.1 && edge.frames == 10,
    }));
    let (graph, report) = graph::build(source, &alone()).unwrap();
    assert_sound(&graph);
    assert_report(&graph, &report);
    assert!(report.links.links > 0 && report.links.unlinked.is_empty());
    assert_eq!(graph.events().len(), motions.events.len());
    // The last one, eight evasions within 0.7 s, is as near as links that are not too loose bring it.
    let [reached @ .., eight] = &report.links.goals[..] else {
        panic!("no goals");
    };
    for found in reached {
        assert!(found.reached >= found.goal.share, "{found:?}");
    }
    assert!(eight.reached > eight.before.max(0.7), "{eight:?}");
    // Enough is enough.
    assert!(graph.edges().len() < plain.edges().len() * 2);
    let longest = 0.5 * graph.frame_rate();
    for edge in graph.edges() {
        if let EdgeMotion::Transition { distance, .. } = edge.motion {
            assert!(distance <= report.links.loosest.max(0.1));
            assert!(f64::from(edge.frames) <= longest && edge.frames >= 5);
        }
    }
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn real_motion_capture_becomes_responsive() {
    let set = captures("fight");
    let source = source_of(&set);
    let (plain, _) = graph::build(source, &without_links()).unwrap();
    let (graph, report) = graph::build(source, &alone()).unwrap();
    assert_sound(&graph);
    assert_report(&graph, &report);
    assert_eq!(graph.events().len(), set.events.len());
    assert!(plain.responsiveness(1.0).share < 0.6);
    assert!(graph.responsiveness(1.0).share >= 0.8);
    assert!(graph.responsiveness(1.5).share >= 0.95);
    assert!(graph.edges().len() < plain.edges().len() * 2);
    let threads = |threads| GraphSettings { threads, ..alone() };
    for count in [1, 2, 3] {
        assert_eq!(graph::build(source, &threads(count)).unwrap().0, graph);
    }
}

/// Two clips of the same motion, 2 s each, that come round.
fn round_clips() -> Vec<Clip> {
    vec![round_clip(30, 0.4); 2]
}

#[test]
fn events_near_the_ends_of_clips_are_linked_by_short_blends_or_named() {
    let clips = round_clips();
    // Frames of motion before it, after it.
    for (before, after) in [(5, 5), (6, 12), (15, 5), (5, 20), (4, 10), (10, 4), (0, 0)] {
        let event = evasion(1, f64::from(before) / 30.0, f64::from(59 - after) / 30.0);
        let settings = with(|links| links.loosest = 10.0);
        let (graph, report) = build(&clips, &[event], &settings).unwrap();
        assert_sound(&graph);
        let unlinked: Vec<_> = report.links.unlinked.iter().map(|u| u.obstacle).collect();
        let is_linked = before >= 5 && after >= 5;
        let (linked, missing) = (usize::from(is_linked), usize::from(!is_linked));
        let found = (graph.events().len(), unlinked.len());
        assert_eq!(found, (linked, missing), "{before}, {after}");
        if is_linked {
            assert!(report.links.joins > 0);
        } else {
            let lead_in = matches!(unlinked[0], LinkObstacle::NoLeadIn { .. });
            let tail = matches!(unlinked[0], LinkObstacle::NoTail { .. });
            assert_eq!((lead_in, tail), (before < 5, before >= 5));
            let name = &report.links.unlinked[0].event;
            assert_eq!(*report.dropped.evasions, [name.as_str()]);
        }
    }
}

#[test]
fn an_event_without_anything_near_is_named() {
    let events = [evasion(1, 0.8, 1.2), evasion(0, 0.5, 0.51)];
    let mut clips = round_clips();
    let mut desc = clips[1].desc().clone();
    // A body whose every joint is bent as nowhere else.
    for rotation in &mut desc.rotations {
        *rotation *= glam::Quat::from_rotation_z(1.5);
    }
    clips[1] = Clip::new(&small_skeleton(), desc).unwrap();
    let (graph, report) = build(&clips, &events, &alone()).unwrap();
    assert!(graph.events().is_empty());
    let obstacles: Vec<_> = report.links.unlinked.iter().map(|u| u.obstacle).collect();
    assert!(matches!(obstacles[0], LinkObstacle::NothingNear { loosest } if loosest == 0.35));
    assert_eq!(obstacles[1], LinkObstacle::TooShort);
}

#[test]
fn one_clip_that_never_comes_round_becomes_a_graph_by_its_event() {
    let skeleton = small_skeleton();
    let clips = [swinging_clip(&skeleton, 90, 0.0)];
    let tight = |links| GraphSettings {
        threshold: 1e-4,
        links,
        ..alone()
    };
    let event = [evasion(0, 1.0, 1.5)];
    let error = build(&clips, &event, &tight(None)).unwrap_err();
    assert!(matches!(error, GraphError::NoCycle { .. }));
    let loose = LinkSettings {
        loosest: 5.0,
        ..LinkSettings::default()
    };
    let (graph, report) = build(&clips, &event, &tight(Some(loose.clone()))).unwrap();
    assert_sound(&graph);
    assert_report(&graph, &report);
    assert_eq!(graph.events().len(), 1);
    // Nothing to link: no clip, no graph as before.
    assert!(build(&clips, &[], &tight(Some(loose.clone()))).is_err());
    let short = [7, 1].map(|frames| swinging_clip(&skeleton, frames, 0.0));
    assert!(build(&short, &[evasion(0, 0.1, 0.2)], &tight(Some(loose))).is_err());
}

#[test]
fn what_is_wanted_bounds_what_is_made() {
    let motions = demo::motions().unwrap();
    let source = motions.source();
    let made = |change: &dyn Fn(&mut LinkSettings)| {
        let (graph, report) = graph::build(source, &with(change)).unwrap();
        assert_sound(&graph);
        report
    };
    let nothing = made(&|links| links.goals.clear());
    assert_eq!((nothing.links.links, nothing.links.goals.len()), (0, 0));
    let few = made(&|links| {
        links.goals = vec![goal(1.0, 6, 1.0)];
        links.most_per_second = 0.2;
    });
    assert_eq!(few.links.links, (few.seconds * 0.2) as usize);
    // Wanted of every moment: not to be had, and the report says so.
    let all = made(&|links| links.goals = vec![goal(0.6, 1, 1.0)]);
    let found = all.links.goals[0];
    assert!(found.before < found.reached && found.reached < 1.0);
    assert!(all.links.loosest <= 0.35);
}
