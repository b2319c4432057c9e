//! Promise: what a warp bends is clean, within its bounds, and stays a body: feet stand, knees bend their own way.

use std::sync::OnceLock;

use glam::Vec3;
use sabaki::anim::{JointTransform, Leg, Pose};
use sabaki::graph::Motion;
use sabaki::maps::BakedGraph;
use sabaki::query::{Answer, Attack, Evaluation, Query, QuerySettings, WarpSettings};
use sabaki_fixtures::answer::answer_throw;
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::captures::fight;
use sabaki_fixtures::throw::throws;

use super::{assert_made_again, joints, naive_clearance, of_edges, taken_over, without_entries};

/// Which way a knee or an elbow bends: the axis of its bend, as long as the sine of it.
fn bend_axis(joints: &[JointTransform], leg: &Leg) -> Vec3 {
    let [hip, knee, foot] =
        [leg.hip, leg.knee, leg.foot].map(|joint| joints[joint.index()].translation);
    let axis = (knee - hip).normalize().cross((foot - knee).normalize());
    joints[leg.hip.index()].rotation.conjugate() * axis
}

/// Asserts that a warped motion avoids the attack within the bounds of the warp, and stays a body.
fn assert_sound(baked: &BakedGraph, attack: &Attack, motion: &Motion) {
    let (graph, bounds) = (baked.graph(), WarpSettings::default().bounds);
    let warp = *motion.warp().unwrap();
    let (bend, envelope) = (warp.bend, warp.envelope);
    let mut plain = motion.clone();
    plain.set_warp(None);
    assert!(bend.spine.length() <= bounds.spine + 1e-5, "{bend:?}");
    assert!(bend.pelvis.length() <= bounds.pelvis + 1e-5, "{bend:?}");
    assert!(bend.ahead.abs() <= bounds.time + 1e-5, "{bend:?}");
    for (limb, end) in bend.ends.iter().enumerate() {
        let most = bounds.end(limb) + 1e-5;
        assert!(end.length() <= most, "limb {limb}: {end}");
    }
    let naive = naive_clearance(baked, motion, attack, 600.0);
    assert!(naive >= -0.003, "hit, by the naive sampler: {naive}");
    let rate = 120.0;
    for step in 0..=((envelope.end + 0.2) * rate) as usize {
        let t = step as f32 / rate;
        let (pose, bent) = joints(baked, motion, t);
        let moment = warp.moment(t);
        let (own_pose, own) = joints(baked, &plain, moment);
        let (_, later) = joints(baked, &plain, moment + 1.0 / rate);
        if !(envelope.start..=envelope.end).contains(&t) {
            assert_eq!(pose, own_pose, "bent at {t}, outside of {envelope:?}");
            continue;
        }
        for (limb, leg) in graph.limbs().iter().enumerate() {
            let Some(leg) = leg else { continue };
            let (was, is) = (bend_axis(&own, leg), bend_axis(&bent, leg));
            // Of a straight limb nobody can tell.
            let is_backwards = was.length() > 0.15 && was.dot(is) < 0.0;
            assert!(!is_backwards, "limb {limb} bends backwards at {t}");
            if limb >= 2 {
                continue;
            }
            let toe = leg.toe_or_foot();
            for joint in [leg.foot, toe] {
                let [a, b] = [&own, &bent].map(|joints| joints[joint.index()].translation);
                // A foot that swings may be missed where the leg is too short.
                let way = later[joint.index()].translation.distance(a);
                let stands = bend.ends[limb] == Vec3::ZERO && a.y < 0.12 && way * rate < 0.3;
                let moved = a.distance(b);
                assert!(!stands || moved <= 0.002, "foot {limb}: {moved} m at {t}");
            }
            let [a, b] = [&own, &bent].map(|joints| joints[toe.index()].translation.y);
            let is_below = b < a - 0.005 && b < 0.0;
            assert!(!is_below, "toe {limb} under the ground at {t}: {b}");
        }
        // Bones keep their lengths.
        for (id, joint) in graph.skeleton().ids().zip(graph.skeleton().joints()) {
            let Some(parent) = joint.parent else { continue };
            let [own, bent] = [&own, &bent].map(|joints| {
                let [end, start] = [id, parent].map(|id| joints[id.index()].translation);
                end.distance(start)
            });
            assert!((own - bent).abs() <= 1e-4, "bone {} at {t}", joint.name);
        }
    }
}

/// The [`hits`] of the embedded motions.
fn of_embedded() -> &'static [(Attack, Answer)] {
    static HITS: OnceLock<Vec<(Attack, Answer)>> = OnceLock::new();
    HITS.get_or_init(|| hits(embedded(), 150))
}

/// Throws that hit without a warp, and what becomes of them with one.
fn hits(baked: &BakedGraph, count: u64) -> Vec<(Attack, Answer)> {
    let (settings, off) = (without_entries(), of_edges());
    let mut hits = Vec::new();
    for throw in throws(baked, 5, count) {
        let plain = answer_throw(&Query::new(baked, &off), &throw, Evaluation::Lazy);
        let answer = answer_throw(&Query::new(baked, &settings), &throw, Evaluation::Lazy);
        if plain.avoided {
            assert_eq!(answer.motion, plain.motion, "what is clean is not bent");
            assert_eq!(answer.chosen().warp, None);
        } else {
            hits.push((throw.attack, answer));
        }
    }
    hits
}

/// At least `share` of the hits are cured, and every cure is one.
fn holds(baked: &BakedGraph, hits: &[(Attack, Answer)], share: f32) {
    let mut cured = 0;
    for (attack, answer) in hits {
        assert_eq!(answer.avoided, answer.chosen().warp.is_some());
        if !answer.avoided {
            continue;
        }
        cured += 1;
        let score = answer.chosen().score.unwrap();
        let has_price = score.warp > 0.0 && score.total > 0.0;
        assert!(has_price, "{score:?}");
        assert_sound(baked, attack, &answer.motion);
        let exact = answer.clearance().metres;
        let naive = naive_clearance(baked, &answer.motion, attack, 1200.0);
        assert!((exact - naive).abs() < 0.003, "{exact} and {naive}");
    }
    let found = cured as f32 / hits.len().max(1) as f32;
    assert!(found >= share, "{cured} of {} hits are cured", hits.len());
}

#[test]
fn warped_answers_are_clean_and_bodies() {
    holds(embedded(), of_embedded(), 0.2);
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn warped_answers_of_captures_are_clean_and_bodies() {
    holds(fight(), &hits(fight(), 150), 0.4);
}

#[test]
fn a_warp_is_the_same_again_by_its_report() {
    let (baked, settings) = (embedded(), without_entries());
    let query = Query::new(baked, &settings);
    let mut warped = 0;
    for throw in throws(baked, 5, 80) {
        let answer = answer_throw(&query, &throw, Evaluation::Lazy);
        if answer.chosen().warp.is_none() {
            continue;
        }
        assert_made_again(&answer, &throw);
        warped += 1;
    }
    assert!(warped > 0);
}

#[test]
fn the_rest_of_a_bent_motion_goes_on_as_it_was() {
    let baked = embedded();
    let warped = of_embedded().iter().filter(|(_, answer)| answer.avoided);
    let (mut a, mut b) = (Pose::default(), Pose::default());
    let mut seen = 0;
    for (_, answer) in warped {
        let envelope = answer.chosen().warp.unwrap().envelope;
        for share in [-0.2, 0.2, 0.6, 0.9, 1.1] {
            let from = (envelope.start + share * (envelope.end - envelope.start)).max(0.0);
            let rest = answer.motion.rest(baked.graph(), from);
            for step in 0..20 {
                let t = step as f32 / 40.0;
                if from + t > answer.motion.duration() {
                    break;
                }
                answer.motion.sample(baked.graph(), from + t, &mut a);
                rest.sample(baked.graph(), t, &mut b);
                assert!(a.root.distance(b.root) < 1e-3);
                for (a, b) in a.rotations.iter().zip(&b.rotations) {
                    assert!(a.angle_between(*b) < 5e-3);
                }
                seen += 1;
            }
        }
    }
    assert!(seen > 0);
}

/// What an answer is by default, and what it is with settings that bend clean ones.
fn adjusted(change: impl Fn(&mut WarpSettings)) -> Vec<(Attack, Answer, Answer)> {
    let baked = embedded();
    let mut settings = QuerySettings::default();
    change(&mut settings.warp);
    let answers = throws(baked, 9, 100).map(|throw| {
        let [usual, other] = [QuerySettings::default(), settings]
            .map(|settings| answer_throw(&Query::new(baked, &settings), &throw, Evaluation::Lazy));
        (throw.attack, usual, other)
    });
    answers
        .filter(|(_, usual, _)| usual.chosen().warp.is_none() && usual.avoided)
        .collect()
}

#[test]
fn close_misses_are_bent_away_where_settings_say_so() {
    let mut bent = 0;
    for (attack, usual, other) in adjusted(|warp| warp.nearest = 0.05) {
        let [before, after] = [&usual, &other].map(|answer| answer.clearance().metres);
        let warp = other.chosen().warp;
        assert_eq!(warp.is_none(), before == after);
        if warp.is_some() {
            bent += 1;
            assert!(before < 0.05 && after > before, "{before} and {after}");
            assert_sound(embedded(), &attack, &other.motion);
        }
    }
    assert!(bent > 2, "{bent}");
}

#[test]
fn wide_misses_are_lessened_where_settings_say_so() {
    let mut bent = 0;
    for (attack, usual, other) in adjusted(|warp| warp.widest = Some(0.03)) {
        let [before, after] = [&usual, &other].map(|answer| answer.clearance().metres);
        if other.chosen().warp.is_some() {
            bent += 1;
            let is_less = before > 0.03 && after < before && after >= 0.0;
            assert!(is_less, "{before} and {after}");
            let [own, score] = [&usual, &other].map(|answer| answer.chosen().score.unwrap().total);
            assert!(score < own, "{score} and {own}");
            assert_sound(embedded(), &attack, &other.motion);
        }
    }
    assert!(bent > 2, "{bent}");
}

/// Warped answers are taken over in the middle of their warps.
fn bends_fade_out(baked: &BakedGraph, hits: &[(Attack, Answer)]) {
    let settings = QuerySettings::default();
    let query = Query::new(baked, &settings);
    let mut asked = 0;
    for (attack, first) in hits {
        let Some(warp) = first.motion.warp().copied() else {
            continue;
        };
        let envelope = warp.envelope;
        for share in [0.2, 0.5, 0.8] {
            let now = envelope.start + share * (envelope.end - envelope.start);
            let answer = taken_over(&query, baked, (&first.motion, now), attack, 0.005);
            let naive = naive_clearance(baked, &answer.motion, attack, 600.0);
            assert!(!answer.avoided || naive > -0.003, "{naive}");
            asked += 1;
        }
    }
    assert!(asked > 5, "{asked}");
}

#[test]
fn an_attack_during_a_warp_is_answered_from_the_bent_body() {
    bends_fade_out(embedded(), of_embedded());
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn an_attack_during_a_warp_of_captures_is_answered_from_the_bent_body() {
    bends_fade_out(fight(), &hits(fight(), 60));
}
