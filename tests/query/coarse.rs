//! Promise: motions that are sampled coarsely first are hit where they are said to be, and no nearer to the attack than
//! is said but by what a body can stray between two samples.
#![allow(clippy::unwrap_used)]

use sabaki_fixtures as common;

use common::baked::embedded;
use common::captures::fight;
use sabaki::graph::{Motion, MotionStep};
use sabaki::internal::{ExactTest, Extent, MotionBody, Sampling};
use sabaki::maps::BakedGraph;
use sabaki::query::Attack;
use sabaki_fixtures::throw::{ThrowSettings, throw};

/// Metres.
const STRAY: f32 = 0.025;

/// Some way through the graph, and an attack on who goes it.
fn walks(baked: &BakedGraph, count: u64) -> impl Iterator<Item = (Motion, Attack)> + '_ {
    (0..count).map(|index| {
        let throw = throw(baked, &ThrowSettings::default(), 31, index / 4).unwrap();
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

fn agree(baked: &BakedGraph, count: u64) {
    let (mut body, mut hits, mut near) = (MotionBody::default(), 0, 0);
    for (motion, attack) in walks(baked, count) {
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
        let extent = Extent {
            below,
            ..Extent::WHOLE
        };
        assert_eq!(test(Sampling::Each, extent), exact.min(below));
        assert_eq!(test(Sampling::CoarseFirst, extent), coarse.min(below));
        near += usize::from(exact < below);
        // And what is deeper than is asked for is deeper indeed.
        let enough = Extent {
            enough: -0.05,
            ..Extent::WHOLE
        };
        assert_eq!(test(Sampling::Each, enough) < -0.05, exact < -0.05);
    }
    let count = count as usize;
    assert!(
        hits > count / 5 && near < count,
        "{hits} hit, {near} are near, of {count}"
    );
}

#[test]
fn coarse_samples_say_what_all_of_them_say() {
    agree(embedded(), 800);
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn and_so_they_do_on_real_motion() {
    let baked = fight();
    agree(baked, 800);
}
