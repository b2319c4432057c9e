//! Promise: the exact test finds the distances that a look at every sphere at every sample finds. Of what is known of an evasion's body
//! beforehand this is exact; motions that are sampled coarsely first are hit where they are said to be, and no nearer to the attack than is said
//! but by what a body can stray between two samples.

use glam::Vec3;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sabaki::graph::{EdgeId, Motion, MotionStep, Playhead};
use sabaki::maps::{BakedGraph, BodyTrack, MovingSphere, SphereKey};
use sabaki::math::Rigid2;
use sabaki::query::clearance::{
    ExactTest, Extent, MotionBody, PlayedTrack, SAMPLE_RATE, Sampling, closest,
};
use sabaki::query::{Attack, Clearance};
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::throw::{key, throws};

/// A sphere on a way of some keys near a body, within a track's time.
fn keys(rng: &mut impl Rng, evasion: &PlayedTrack<'_>) -> Vec<SphereKey> {
    let seconds = evasion.track.seconds();
    let count = rng.random_range(1..5);
    let grows = rng.random_range(0..3) == 0;
    let mut t = evasion.seconds.0 + rng.random_range(0.0..0.3) * seconds;
    let mut radius = rng.random_range(0.02..0.2);
    let key = |_| {
        let mut place = || rng.random_range(-1.5..1.5f32);
        let center = Vec3::new(place(), 1.0 + place(), place());
        let key = key(t, evasion.placement.point(center), radius);
        t += rng.random_range(0.004..0.2) * seconds;
        radius += if grows { 0.05 } else { 0.0 };
        key
    };
    (0..count).map(key).collect()
}

/// Every sphere, from every sample to the next.
fn naive(evasion: &PlayedTrack<'_>, radii: &[f32], attack: &Attack) -> f32 {
    let (track, back) = (evasion.track, evasion.placement.inverse());
    let mut least = f32::INFINITY;
    for sphere in attack.spheres() {
        let still = [sphere.keys()[0]; 2];
        let pairs = sphere.keys().windows(2).map(|pair| [pair[0], pair[1]]);
        let single = (sphere.keys().len() == 1).then_some(still);
        for pair in pairs.chain(single) {
            let times = pair.map(|key| (key.t - evasion.origin) * SAMPLE_RATE);
            for tick in times[0] as usize..=times[1] as usize {
                let span = [tick, tick + 1].map(|t| (t as f32).clamp(times[0], times[1]));
                let at = |time: f32, sphere: usize| {
                    let last = track.ticks() - 1;
                    let [a, b] = [tick, tick + 1].map(|t| track.centre(t.min(last), sphere));
                    a.lerp(b, time - tick as f32)
                };
                let ends = span.map(|t| {
                    MovingSphere::between(pair[0], pair[1], evasion.origin + t / SAMPLE_RATE)
                });
                for (index, own) in radii.iter().enumerate() {
                    let apart = [0, 1].map(|e| at(span[e], index) - back.point(ends[e].center));
                    least = least.min(closest(apart, ends.map(|end| end.radius + own)).1);
                }
            }
        }
    }
    least
}

#[test]
fn bounding_spheres_leave_out_nothing_that_is_near() {
    let baked = embedded();
    let radii: Vec<f32> = baked.body().spheres.iter().map(|s| s.radius).collect();
    let mut rng = Pcg64Mcg::seed_from_u64(9);
    let (mut scratch, mut hits, mut near) = (MotionBody::default(), 0, 0);
    for round in 0..400 {
        let track = baked.track(round % baked.evasions().len());
        let mut number = |most: f32| rng.random_range(-most..most);
        let placement = Rigid2::new(number(3.0), number(4.0), 1.0);
        let evasion = PlayedTrack::new(track, placement, rng.random_range(0.0..1.0));
        let spheres = (0..rng.random_range(1..4)).map(|_| keys(&mut rng, &evasion));
        let attack = Attack::new(spheres.collect()).unwrap();
        let mut of = |extent| -> Clearance {
            let no_motion = |_: &mut _| panic!("the track lasts as long as the attack");
            let mut test = ExactTest::new(baked, &attack);
            test.extent = extent;
            test.on_track(&evasion, &mut scratch, no_motion)
        };
        let expected = naive(&evasion, &radii, &attack);
        let found = of(Extent::WHOLE);
        let error = (found.metres - expected).abs();
        assert!(error < 2e-4, "{found:?} {expected}");
        let mut limit = Extent::WHOLE;
        limit.below = expected + rng.random_range(-0.2..0.2);
        let limited = of(limit);
        match limit.below > expected + 1e-3 {
            true => assert_eq!(limited, found),
            false => assert!(limited.metres >= found.metres.min(limit.below)),
        }
        assert_eq!(of(Extent::UNTIL_HIT).metres < 0.0, found.metres < 0.0);
        hits += usize::from(found.metres < 0.0);
        near += usize::from(found.metres < 0.3);
    }
    // Both ways are taken often.
    assert!(hits > 50 && near - hits > 50 && near < 380, "{hits} {near}");
}

/// An attack of so many lines is bounded as a whole first; each of its spheres alone is not.
#[test]
fn of_many_spheres_the_nearest_one_counts() {
    let baked = embedded();
    let mut rng = Pcg64Mcg::seed_from_u64(14);
    let (mut scratch, mut hits, mut clean) = (MotionBody::default(), 0, 0);
    for round in 0..12 {
        let track = baked.track(7 * round % baked.evasions().len());
        let placement = Rigid2::new(rng.random_range(-3.0..3.0), 2.0, -1.0);
        let evasion = PlayedTrack::new(track, placement, 0.1);
        // They pass the middle of the body at this distance, so that in some rounds none hits.
        let outside = rng.random_range(0.2..1.2f32);
        let sphere = |_| {
            let (t, angle) = (rng.random_range(0.2..0.5f32), rng.random_range(-3.1..3.1));
            let height = rng.random_range(0.1..2.2);
            let way = evasion.placement * Rigid2::new(angle, 0.0, 0.0);
            let at = |t, along| key(t, way.point(Vec3::new(outside, height, along)), 0.05);
            vec![at(t, 2.5), at(t + 0.2, rng.random_range(-2.0..2.0))]
        };
        let spheres: Vec<Vec<SphereKey>> = (0..3000).map(sphere).collect();
        let graph = baked.graph();
        let playhead = Playhead::at(graph, EdgeId(round as u32), 0.0, evasion.placement);
        let mut motion = Motion::new(graph, playhead, &[]);
        motion.extend(graph, 1.0);
        let mut nearest = |spheres: &[Vec<SphereKey>], sampling| {
            let attack = Attack::new(spheres.to_vec()).unwrap();
            let mut test = ExactTest::new(baked, &attack);
            test.sampling = sampling;
            let no_motion = |_: &mut _| panic!("the track lasts as long as the attack");
            [
                test.on_motion(&motion, &mut scratch).metres,
                test.on_track(&evasion, &mut scratch, no_motion).metres,
            ]
        };
        for sampling in [Sampling::Each, Sampling::CoarseFirst] {
            let all = nearest(&spheres, sampling);
            let each = spheres.chunks(1).map(|one| nearest(one, sampling));
            let least = each.reduce(|a, b| [a[0].min(b[0]), a[1].min(b[1])]);
            assert_eq!(Some(all), least, "{sampling:?}");
            hits += all.iter().filter(|&&metres| metres < 0.0).count();
            clean += all.iter().filter(|&&metres| metres > 0.0).count();
        }
    }
    assert!(hits > 3 && clean > 3, "{hits} {clean}");
}

#[test]
fn a_tracks_bounding_spheres_hold_the_body() {
    let baked = embedded();
    for index in 0..baked.evasions().len() {
        let track = baked.track(index);
        for tick in 0..track.ticks() {
            let bound = track.bounding_sphere(tick / BodyTrack::INTERVAL);
            for (at, sphere) in baked.body().spheres.iter().enumerate() {
                let away = track.centre(tick, at).distance(bound.centre) + sphere.radius;
                assert!(away <= bound.radius + 1e-4, "{away} {bound:?}");
            }
        }
    }
}

/// How far a body may stray from the line between two coarse samples, in metres.
const STRAY: f32 = 0.025;

/// Some way through the graph, and an attack on who goes it.
fn walks(baked: &BakedGraph, count: u64) -> impl Iterator<Item = (Motion, Attack)> + '_ {
    let each_four_times = throws(baked, 31, count / 4).flat_map(|throw| vec![throw; 4]);
    (0..).zip(each_four_times).map(|(index, throw)| {
        let graph = baked.graph();
        let (mut node, mut steps) = (throw.playhead.next_node(graph), Vec::new());
        for turn in 0..12 {
            let edges: Vec<_> = graph.edges_from(node).collect();
            let edge = edges[(index * 7 + turn * 5) as usize % edges.len()];
            steps.push(MotionStep { edge, rate: 1.0 });
            node = graph.edge(edge).to;
        }
        let mut motion = Motion::new(graph, throw.playhead, &steps);
        motion.extend(graph, throw.attack.end() + 0.1);
        (motion, throw.attack)
    })
}

on_both!(coarse_samples_say_what_all_of_them_say);

fn coarse_samples_say_what_all_of_them_say(baked: &BakedGraph) {
    const COUNT: usize = 800;
    let (mut body, mut hits, mut near) = (MotionBody::default(), 0, 0);
    for (motion, attack) in walks(baked, COUNT as u64) {
        let mut test = |sampling, extent| {
            let test = ExactTest {
                extent,
                sampling,
                ..ExactTest::new(baked, &attack)
            };
            test.on_motion(&motion, &mut body).metres
        };
        let exact = test(Sampling::Each, Extent::WHOLE);
        let coarse = test(Sampling::CoarseFirst, Extent::WHOLE);
        assert!(coarse > exact - 1e-5, "{coarse} is nearer than {exact}");
        assert!(coarse < exact + STRAY, "{coarse} is further than {exact}");
        // Up to the first hit it is a hit all the same, and no deeper than the deepest.
        for sampling in [Sampling::Each, Sampling::CoarseFirst] {
            let first = test(sampling, Extent::UNTIL_HIT);
            assert_eq!(first < 0.0, test(sampling, Extent::WHOLE) < 0.0);
            assert!(first > exact - 1e-5);
        }
        hits += usize::from(exact < 0.0);
        // What lies further away than is asked for is not told apart.
        let below = 0.05;
        let mut extent = Extent::WHOLE;
        extent.below = below;
        assert_eq!(test(Sampling::Each, extent), exact.min(below));
        assert_eq!(test(Sampling::CoarseFirst, extent), coarse.min(below));
        near += usize::from(exact < below);
        // And what is deeper than is asked for is deeper indeed.
        let mut enough = Extent::WHOLE;
        enough.enough = -0.05;
        assert_eq!(test(Sampling::Each, enough) < -0.05, exact < -0.05);
    }
    assert!(
        hits > COUNT / 5 && near < COUNT,
        "{hits} and {near} of {COUNT}"
    );
}
