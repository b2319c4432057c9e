//! Promise: the test of a motion against obstacles finds what a look at every sphere at every sample finds; an answer that avoids the attack
//! among obstacles enters none.

use glam::{Vec2, Vec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sabaki::graph::Played;
use sabaki::graph::{EdgeId, Motion, Playhead};
use sabaki::maps::BakedGraph;
use sabaki::math::Rigid2;
use sabaki::query::clearance::{MotionBody, ObstacleTest};
use sabaki::query::{Answer, Evaluation, Obstacle, Query, QueryContext, QuerySettings, Request};
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::throw::throws;

use super::{centres, measured, without_entries};

/// One obstacle of each kind near a place, some of which move.
fn obstacles(random: &mut Pcg64Mcg, near: Vec3) -> Vec<Obstacle> {
    let mut number = |most: f32| random.random_range(-most..most);
    let mut solids = Vec::new();
    for speed in [0.0, 2.0] {
        let mut place = || near + Vec3::new(number(2.0), number(0.6), number(2.0));
        let places = [(); 6].map(|()| place());
        let ground = |at: usize| Vec2::new(places[at].x, places[at].z);
        let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE].map(|corner| ground(4) + 0.5 * corner);
        let away = places[0] - near;
        for solid in [
            Obstacle::half_space(places[0], -away.with_y(0.1 * away.y)),
            Obstacle::block(places[1], Vec3::new(0.2, 0.4, 0.3), places[0].x),
            Obstacle::capsule(places[2], places[3], 0.1),
            Obstacle::polygon(&corners),
            Obstacle::disc(ground(5), 0.3),
        ] {
            let velocity = Vec3::new(number(1.0), number(0.3), number(1.0)) * speed;
            solids.push(solid.unwrap().moving(velocity).unwrap());
        }
    }
    solids
}

/// The deepest entry of any sphere at any sample; 0 for none.
fn naive(test: &ObstacleTest<'_>, motion: &Motion) -> f32 {
    let body = test.baked.body();
    let (from, to) = test.seconds;
    let ticks = ((to - from) * ObstacleTest::RATE).ceil() as usize;
    let mut worst = 0.0f32;
    for tick in 0..=ticks {
        let seconds = from + tick as f32 / ObstacleTest::RATE;
        let centres = centres(test.baked, motion, seconds);
        for (centre, part) in centres.iter().zip(&body.spheres) {
            for obstacle in test.obstacles {
                worst = worst.max(part.radius - obstacle.distance(*centre, seconds));
            }
        }
    }
    worst
}

on_both!(entries_into_obstacles_are_those_of_a_naive_search);

/// Motions from many edges, among them transitions and blends, one obstacle at a time.
fn entries_into_obstacles_are_those_of_a_naive_search(baked: &BakedGraph) {
    let graph = baked.graph();
    let mut random = Pcg64Mcg::seed_from_u64(31);
    let mut scratch = MotionBody::default();
    let (mut entered, mut free, mut blended) = (0, 0, 0);
    let count = graph.edges().len();
    for index in (0..count).step_by((count / 40).max(1)) {
        let place = Rigid2::new(index as f32, 3.0, -2.0);
        let at = Playhead::at(graph, EdgeId(index as u32), 0.4, place);
        let mut motion = Motion::new(graph, at, &[]);
        if index % 3 == 0 {
            let other = EdgeId(random.random_range(0..count) as u32);
            let from = Motion::new(graph, Playhead::at(graph, other, 0.0, place), &[]);
            let played = Played {
                motion: &from,
                seconds: 0.0,
                rate: 1.0,
            };
            motion.blend_from(graph, played, 0.2);
        }
        motion.extend(graph, 2.0);
        blended += usize::from(motion.is_blending(0.05));
        for obstacle in obstacles(&mut random, motion.root(graph, 1.0)) {
            // Weights of 1, so that harm is depth.
            let obstacle = obstacle.weighing(1.0).unwrap();
            let test = ObstacleTest {
                baked,
                obstacles: &[obstacle],
                seconds: (0.1, 1.9),
                enough: f32::INFINITY,
            };
            let found = scratch.worst_entry(&test, &motion);
            let wanted = naive(&test, &motion);
            let depth = found.map_or(0.0, |hit| hit.harm);
            let apart = (depth - wanted).abs();
            assert!(apart < 1e-5, "edge {index}: {depth} {wanted} {obstacle:?}");
            let mut first = test;
            first.enough = 0.0;
            let first = scratch.worst_entry(&first, &motion);
            assert_eq!(first.is_some(), wanted > 0.0, "edge {index}: {obstacle:?}");
            entered += usize::from(wanted > 0.0);
            free += usize::from(wanted == 0.0);
        }
    }
    assert!(
        entered.min(free) > 50 && blended > 3,
        "{entered} {free} {blended}"
    );
}

on_both!(fast_obstacles_are_seen_between_the_samples);

/// Discs of a radius of 0.1 m that fly through the middle of the body at 30 to 100 m/s, at moments between the samples too.
fn fast_obstacles_are_seen_between_the_samples(baked: &BakedGraph) {
    let graph = baked.graph();
    let mut random = Pcg64Mcg::seed_from_u64(43);
    let mut scratch = MotionBody::default();
    let count = graph.edges().len();
    let (mut seen, mut beside) = (0, 0);
    for index in (0..count).step_by((count / 40).max(1)) {
        let at = Playhead::at(graph, EdgeId(index as u32), 0.4, Rigid2::IDENTITY);
        let mut motion = Motion::new(graph, at, &[]);
        motion.extend(graph, 2.0);
        for speed in [30.0, 60.0, 99.0] {
            let passes = random.random_range(0.3..1.7);
            let way = Vec2::from_angle(random.random_range(0.0..6.3));
            let root = motion.root(graph, passes);
            let mut entered = |beside: f32| {
                let place = Vec2::new(root.x, root.z) + way.perp() * beside - way * speed * passes;
                let disc = Obstacle::disc(place, 0.1).unwrap();
                let velocity = Vec3::new(way.x, 0.0, way.y) * speed;
                let test = ObstacleTest {
                    baked,
                    obstacles: &[disc.moving(velocity).unwrap()],
                    seconds: (0.0, 2.0),
                    enough: 0.0,
                };
                scratch.worst_entry(&test, &motion)
            };
            let hit = entered(0.0).expect("a disc passes through the root unseen");
            assert!((hit.time - passes).abs() < 1.0 / 30.0, "{hit:?} {passes}");
            seen += 1;
            beside += usize::from(entered(3.0).is_none());
        }
    }
    assert!(seen > 50 && beside == seen, "{seen} {beside}");
}

on_both!(answers_among_obstacles_enter_none);

/// Answers among many obstacles, each tested again by the naive search and the exact test.
fn answers_among_obstacles_enter_none(baked: &BakedGraph) {
    let graph = baked.graph();
    let mut random = Pcg64Mcg::seed_from_u64(37);
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    let settings = QuerySettings::default();
    let (mut avoided, mut hit) = (0, 0);
    for (index, throw) in throws(baked, 41, 60).enumerate() {
        let root = Motion::new(graph, throw.playhead, &[]).root(graph, 0.0);
        let discs = (0..40).map(|_| {
            let way = Vec2::from_angle(random.random_range(0.0..6.3));
            let far = random.random_range(0.9..4.0);
            Obstacle::disc(Vec2::new(root.x, root.z) + way * far, 0.2).unwrap()
        });
        let solids: Vec<Obstacle> = discs.map(|disc| disc.weighing(1.0).unwrap()).collect();
        let mut request = throw.request();
        request.obstacles = &solids;
        Query::new(baked, &settings).answer(request, &mut context, &mut answer);
        if !answer.avoided {
            hit += 1;
            continue;
        }
        avoided += 1;
        let mut motion = answer.motion.clone();
        motion.extend(graph, throw.attack.end() + 0.1);
        let clearance = measured(baked, &motion, &throw.attack);
        assert!(clearance.metres > -0.005, "attack {index}: {clearance:?}");
        let test = ObstacleTest {
            baked,
            obstacles: &solids,
            seconds: (0.0, throw.attack.end()),
            enough: f32::INFINITY,
        };
        assert_eq!(naive(&test, &motion), 0.0, "attack {index}");
    }
    assert!(avoided > 5, "{avoided} avoided, {hit} hit");
}

/// The lazy evaluation orders hits by bounds of their depth, so that it may warp others, and now and then one more.
#[test]
fn both_evaluations_warp_hits_among_obstacles() {
    let baked = embedded();
    let settings = without_entries();
    let query = Query::new(baked, &settings);
    let mut context = QueryContext::default();
    let (mut warped, mut avoided, mut lazy_only) = ([0; 2], 0, 0);
    for (index, throw) in (0..).zip(throws(baked, 61, 200)) {
        let mut random = Pcg64Mcg::seed_from_u64(index);
        let natural = Motion::new(baked.graph(), throw.playhead, &[]);
        let root = natural.root(baked.graph(), 0.0);
        let way = Vec2::from_angle(random.random_range(0.0..std::f32::consts::TAU));
        let disc = Obstacle::disc(Vec2::new(root.x, root.z) + 1.5 * way, 0.3).unwrap();
        let [lazy, all] = [Evaluation::Lazy, Evaluation::Exhaustive].map(|evaluation| {
            let request = Request {
                obstacles: &[disc],
                evaluation,
                ..throw.request()
            };
            let mut answer = Answer::default();
            query.answer(request, &mut context, &mut answer);
            answer
        });
        avoided += usize::from(all.avoided);
        lazy_only += usize::from(lazy.avoided && !all.avoided);
        for (count, answer) in warped.iter_mut().zip([&lazy, &all]) {
            *count += usize::from(answer.avoided && answer.motion.warp().is_some());
        }
    }
    assert!(
        warped.iter().all(|&count| count > 0) && lazy_only * 20 <= avoided,
        "{warped:?} warped, {avoided} avoided, {lazy_only} by the lazy evaluation alone"
    );
}
