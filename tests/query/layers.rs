//! Promise: a layered evasion leaves pelvis and legs as they are, begins and ends without a pop, is tested as it is played, and lets a
//! body that walks go on.

use std::sync::OnceLock;

use sabaki::graph::Motion;
use sabaki::query::{Answer, Evaluation, Query};
use sabaki_fixtures::answer::answer_throw;
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::balls::TimedThrow;
use sabaki_fixtures::clips::most_apart;

use super::{
    assert_made_again, balls_at, centres, furthest, joints, measured, taken_over, unwarped,
};

/// Answers whose chosen motion is layered.
fn layered() -> &'static [(TimedThrow, Answer)] {
    static LAYERED: OnceLock<Vec<(TimedThrow, Answer)>> = OnceLock::new();
    LAYERED.get_or_init(|| {
        let settings = unwarped();
        let query = Query::new(embedded(), &settings);
        let thrown = balls_at(std::iter::repeat_n(0.45, 300), 9).into_iter();
        let answered = thrown.map(|thrown| {
            let answer = answer_throw(&query, &thrown.throw, Evaluation::Lazy);
            (thrown, answer)
        });
        let is_layered =
            |(_, answer): &(TimedThrow, Answer)| answer.avoided && answer.chosen().layer.is_some();
        let found: Vec<_> = answered.filter(is_layered).collect();
        assert!(found.len() > 5, "{}", found.len());
        found
    })
}

#[test]
fn pelvis_and_legs_go_on_to_the_bit() {
    let graph = embedded().graph();
    for (_, answer) in layered() {
        let layer = *answer.motion.layer().unwrap();
        let mut plain = answer.motion.clone();
        plain.set_layer(None);
        let mut moved = 0.0f32;
        for step in 0..60 {
            let seconds = step as f32 * 0.02;
            let [(with, places), (without, others)] =
                [&answer.motion, &plain].map(|motion| joints(embedded(), motion, seconds));
            assert_eq!(with.root, without.root);
            assert_eq!(with.rotations[0], without.rotations[0]);
            for leg in graph.limbs()[..2].iter().flatten() {
                for joint in [leg.hip, leg.knee, leg.foot] {
                    assert_eq!(places[joint.index()], others[joint.index()]);
                }
            }
            moved = moved.max(most_apart(&places, &others));
            if layer.weight(seconds) == 0.0 {
                assert_eq!(with, without);
            }
        }
        assert!(moved > 0.05, "{moved}");
    }
}

#[test]
fn a_layer_fades_in_and_out_without_a_pop() {
    let baked = embedded();
    for (_, answer) in layered() {
        let mut motion = answer.motion.clone();
        motion.extend(baked.graph(), 2.5);
        let end = motion.layer().unwrap().end();
        for step in 0..(end * 500.0) as usize + 10 {
            let seconds = step as f32 / 500.0;
            let ends = [seconds, seconds + 0.002].map(|t| centres(baked, &motion, t));
            let most = furthest(&ends[0], &ends[1]);
            assert!(most < 0.03, "{most} m in 2 ms at {seconds}");
        }
        // The rest of the motion, and a copy from a file, play the same.
        let rest = motion.rest(baked.graph(), 0.3);
        let text = serde_json::to_string(&motion).unwrap();
        let read: Motion = serde_json::from_str(&text).unwrap();
        assert_eq!(read, motion);
        for seconds in [0.3, 0.4, 0.55] {
            let at = [
                centres(baked, &motion, seconds),
                centres(baked, &rest, seconds - 0.3),
            ];
            assert!(furthest(&at[0], &at[1]) < 1e-3);
        }
    }
}

#[test]
fn what_is_said_of_a_layer_is_measured() {
    for (thrown, answer) in layered() {
        let measured = measured(embedded(), &answer.motion, &thrown.throw.attack);
        assert!(measured.is_clean());
        assert_eq!(measured.metres, answer.clearance().metres);
        assert_made_again(answer, &thrown.throw);
        assert!(answer.counts.layered > 0);
    }
}

#[test]
fn an_attack_during_a_layer_is_answered_from_there() {
    let settings = unwarped();
    let query = Query::new(embedded(), &settings);
    let mut asked = 0;
    for (thrown, first) in layered() {
        let layer = *first.motion.layer().unwrap();
        let now = 0.5 * (layer.envelope.start + layer.envelope.full);
        let from = (&first.motion, now);
        taken_over(&query, embedded(), from, &thrown.throw.attack, 1e-3);
        asked += 1;
    }
    assert!(asked > 3, "{asked}");
}
