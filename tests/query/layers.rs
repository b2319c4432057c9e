//! Promise: a layered evasion leaves pelvis and legs as they are, begins and ends without a pop, is tested as it is played, and lets a
//! body that walks go on.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::sync::OnceLock;

use sabaki_fixtures as common;

use common::answer::answer_throw;
use common::baked::embedded;
use sabaki::anim::{JointTransform, Pose, forward_kinematics};
use sabaki::graph::Motion;
use sabaki::internal::{ExactTest, MotionBody};
use sabaki::query::{
    Answer, EntryUse, Evaluation, Query, QueryContext, QuerySettings, Request, WarpSettings,
};
use sabaki_fixtures::balls::{BallSettings, BallThrower, TimedThrow};
use sabaki_fixtures::throw::RandomDraw;

use super::entries::centres;

fn balls(count: u64) -> impl Iterator<Item = TimedThrow> {
    let thrower = BallThrower::new(embedded(), BallSettings::default());
    (0..count).filter_map(move |index| {
        let draw = RandomDraw { seed: 9, index };
        thrower.throw(0.45, draw).unwrap()
    })
}

fn settings() -> QuerySettings {
    QuerySettings {
        warp: WarpSettings::off(),
        ..QuerySettings::default()
    }
}

/// Answers whose chosen motion is layered.
fn layered() -> &'static [(TimedThrow, Answer)] {
    static LAYERED: OnceLock<Vec<(TimedThrow, Answer)>> = OnceLock::new();
    LAYERED.get_or_init(|| {
        let settings = settings();
        let query = Query::new(embedded(), &settings);
        let answered = balls(300).map(|thrown| {
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

fn joints(motion: &Motion, seconds: f32) -> (Pose, Vec<JointTransform>) {
    let graph = embedded().graph();
    let (mut pose, mut joints) = (Pose::default(), Vec::new());
    motion.sample(graph, seconds, &mut pose);
    forward_kinematics(graph.skeleton(), &pose, &mut joints);
    (pose, joints)
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
                [&answer.motion, &plain].map(|motion| joints(motion, seconds));
            assert_eq!(with.root, without.root);
            assert_eq!(with.rotations[0], without.rotations[0]);
            for leg in graph.limbs()[..2].iter().flatten() {
                for joint in [leg.hip, leg.knee, leg.foot] {
                    assert_eq!(places[joint.index()], others[joint.index()]);
                }
            }
            let apart = places.iter().zip(&others);
            let apart = apart.map(|(a, b)| a.translation.distance(b.translation));
            let apart = apart.fold(0.0, f32::max);
            moved = moved.max(apart);
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
            let ways = ends[0].iter().zip(&ends[1]).map(|(a, b)| a.distance(*b));
            let most = ways.fold(0.0, f32::max);
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
            let ways = at[0].iter().zip(&at[1]).map(|(a, b)| a.distance(*b));
            assert!(ways.fold(0.0, f32::max) < 1e-3);
        }
    }
}

#[test]
fn what_is_said_of_a_layer_is_measured() {
    let baked = embedded();
    for (thrown, answer) in layered() {
        let attack = &thrown.throw.attack;
        let test = ExactTest::new(baked, attack);
        let measured = test.on_motion(&answer.motion, &mut MotionBody::default());
        assert!(measured.is_clean());
        assert_eq!(measured.metres, answer.clearance().metres);
        let again = answer.motion_of(baked, thrown.throw.playhead, answer.chosen());
        let mut again = again.unwrap();
        again.extend(baked.graph(), attack.end());
        let [again, played] = [&again, &answer.motion].map(|m| centres(baked, m, 0.4));
        assert_eq!(again, played);
        assert!(answer.counts.layered > 0);
    }
}

#[test]
fn lazy_and_exhaustive_evaluation_agree_on_layers() {
    let settings = settings();
    let query = Query::new(embedded(), &settings);
    let without = QuerySettings {
        entries: EntryUse {
            layers: 0,
            ..EntryUse::default()
        },
        ..settings
    };
    let without = Query::new(embedded(), &without);
    let (mut more, mut fewer) = (0, 0);
    for thrown in balls(40) {
        let [lazy, all] = [Evaluation::Lazy, Evaluation::Exhaustive]
            .map(|evaluation| answer_throw(&query, &thrown.throw, evaluation));
        assert_eq!(lazy.avoided, all.avoided);
        let bare = answer_throw(&without, &thrown.throw, Evaluation::Lazy);
        assert_eq!(bare.counts.layered, 0);
        more += usize::from(lazy.avoided && !bare.avoided);
        fewer += usize::from(bare.avoided && !lazy.avoided);
    }
    assert!(fewer <= more, "{more} more, {fewer} fewer");
}

#[test]
fn an_attack_during_a_layer_is_answered_from_there() {
    let baked = embedded();
    let settings = settings();
    let query = Query::new(baked, &settings);
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    let mut asked = 0;
    for (thrown, first) in layered() {
        let layer = *first.motion.layer().unwrap();
        let now = 0.5 * (layer.envelope.start + layer.envelope.full);
        let request = Request::of_motion(
            baked.graph(),
            first.motion.moment_at(now),
            &thrown.throw.attack,
        );
        query.answer(request, &mut context, &mut answer);
        let here = [(&first.motion, now), (&answer.motion, 0.0)].map(|(m, t)| centres(baked, m, t));
        let ways = here[0].iter().zip(&here[1]).map(|(a, b)| a.distance(*b));
        assert!(ways.fold(0.0, f32::max) < 1e-3);
        let test = ExactTest::new(baked, &thrown.throw.attack);
        let measured = test.on_motion(&answer.motion, &mut MotionBody::default());
        assert_eq!(measured.is_clean(), answer.avoided);
        asked += 1;
    }
    assert!(asked > 3, "{asked}");
}
