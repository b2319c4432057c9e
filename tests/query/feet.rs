//! Promise: in an entry one foot stays where it is planted, and no toe goes below both motions.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use glam::Vec3;
use sabaki::anim::{Pose, forward_kinematics};
use sabaki::graph::{Motion, MotionGraph};
use sabaki_fixtures::baked::embedded;

use super::entries::entered;

fn toes(graph: &MotionGraph, pose: &Pose) -> Vec<Vec3> {
    let mut joints = Vec::new();
    forward_kinematics(graph.skeleton(), pose, &mut joints);
    let legs = graph.feet().legs().iter();
    legs.map(|leg| joints[leg.toe_or_foot().index()].translation)
        .collect()
}

fn played(graph: &MotionGraph, motion: &Motion, seconds: f32) -> Vec<Vec3> {
    let mut pose = Pose::default();
    motion.sample(graph, seconds, &mut pose);
    toes(graph, &pose)
}

#[test]
fn one_foot_stays_while_an_evasion_is_entered() {
    let graph = embedded().graph();
    let step = 1.0 / graph.frame_rate() as f32;
    let mut slides = Vec::new();
    for (before, seconds, entry) in entered(embedded()) {
        let mut motion = before;
        motion.enter(graph, seconds, &entry);
        motion.extend(graph, 2.0);
        let frames = (entry.blend / step).ceil() as usize;
        let at = |frame: usize| played(graph, &motion, seconds + frame as f32 * step);
        let slower = |frame: usize| {
            let (from, to) = (at(frame), at(frame + 1));
            let ways = from.iter().zip(&to);
            ways.map(|(from, to)| (*to - *from).with_y(0.0).length())
                .fold(f32::INFINITY, f32::min)
        };
        slides.push((0..frames).map(slower).sum::<f32>());
    }
    slides.sort_by(f32::total_cmp);
    // Moments between those of the bake, and moments at which no foot stands, may slide more.
    let of_ten = slides[slides.len() * 9 / 10];
    assert!(of_ten <= 0.03, "{of_ten}");
}

#[test]
fn no_toe_goes_below_both_motions() {
    let graph = embedded().graph();
    for (before, seconds, entry) in entered(embedded()) {
        let start = played(graph, &before, seconds);
        let mut motion = before;
        motion.enter(graph, seconds, &entry);
        motion.extend(graph, 2.0);
        for part in 1..10 {
            let seconds = seconds + entry.blend * part as f32 / 10.0;
            let mut pose = Pose::default();
            motion.playhead(graph, seconds).pose(graph, &mut pose);
            let lowest = toes(graph, &pose).into_iter().zip(&start);
            let now = played(graph, &motion, seconds);
            for (toe, (target, start)) in now.iter().zip(lowest) {
                let floor = target.y.min(start.y);
                assert!(toe.y > floor - 0.01, "{} under {floor}", toe.y);
            }
        }
    }
}
