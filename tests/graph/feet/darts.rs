//! Toes in transitions, measured naively.

use sabaki::anim::Pose;
use sabaki::graph::{EdgeId, GraphSettings, MotionGraph};

use super::common::baked::{embedded, embedded_graph};
use super::common::captures::fight;
use super::{places, places_at, transitions};

/// Speed of the fastest toe between places that follow each other `rate` times a second, metres per second.
fn fastest(graph: &MotionGraph, poses: &[Vec<glam::Vec3>], rate: f32) -> f32 {
    let speed = |pair: &[Vec<glam::Vec3>]| {
        let toes = graph.limbs()[..2].iter().flatten();
        let toes = toes.map(|leg| leg.toe.unwrap_or(leg.foot).index());
        toes.map(|toe| pair[0][toe].distance(pair[1][toe]) * rate)
            .fold(0.0, f32::max)
    };
    poses.windows(2).map(speed).fold(0.0, f32::max)
}

/// Speed of the fastest toe in a transition, and in the frames of both clips that it blends.
fn speeds(graph: &MotionGraph, id: EdgeId) -> [f32; 2] {
    let (edge, rate) = (graph.edge(id), graph.frame_rate() as f32);
    let (from, to) = (graph.node(edge.from), graph.node(edge.to));
    let halves = (0..=2 * edge.frames).map(|half| half as f32 / 2.0);
    let played: Vec<_> = halves
        .map(|frame| places_at(graph, MotionGraph::sample_edge, id, frame))
        .collect();
    let clip = |clip, first: u32| {
        let pose = |frame: u32| {
            let mut pose = Pose::default();
            graph.clip(clip).pose(frame as usize, &mut pose);
            places(graph, &pose)
        };
        let poses: Vec<_> = (first..=first + edge.frames).map(pose).collect();
        fastest(graph, &poses, rate)
    };
    let sides = clip(from.clip, from.frame).max(clip(to.clip, to.frame - edge.frames));
    [fastest(graph, &played, 2.0 * rate), sides]
}

fn darting(graph: &MotionGraph) -> usize {
    let darts = |&id: &EdgeId| {
        let [played, sides] = speeds(graph, id);
        played > 1e-3 + (1.3 * sides).max(5.0)
    };
    transitions(graph).filter(darts).count()
}

#[test]
fn no_foot_darts_in_a_transition() {
    assert_eq!(darting(embedded().graph()), 0);
    let all = embedded_graph(&GraphSettings {
        fastest_step: None,
        ..GraphSettings::default()
    });
    assert!(darting(&all) > 0);
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn no_foot_darts_in_a_transition_of_real_capture() {
    assert_eq!(darting(fight().graph()), 0);
}
