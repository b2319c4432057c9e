//! Promise: what is called clean is clean, nothing clean is hidden by the maps, evasions are in
//! time, and the motion is continuous.

use sabaki::anim::Pose;
use sabaki::graph::{EdgeId, NodeId};
use sabaki::query::clearance::{ExactTest, MotionBody, SAMPLE_RATE};
use sabaki::query::{
    Answer, CandidateReport, CandidateResult, Enumerate, Evaluation, Query, QuerySettings,
};
use sabaki_fixtures::answer::answer_throw;
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::clips::joints_of;
use sabaki_fixtures::throw::{Throw, throws};
use sabaki_fixtures::with;

use super::{centres, furthest, naive_clearance, of_edges};

fn some() -> impl Iterator<Item = Throw> {
    throws(embedded(), 7, 60)
}

fn answer(settings: &QuerySettings, throw: &Throw, evaluation: Evaluation) -> Answer {
    answer_throw(&Query::new(embedded(), settings), throw, evaluation)
}

#[test]
fn the_exact_clearance_is_that_of_stepping_through_time() {
    let settings = QuerySettings::default();
    for throw in some() {
        let answer = answer(&settings, &throw, Evaluation::Lazy);
        let stepped = naive_clearance(embedded(), &answer.motion, &throw.attack, 8.0 * SAMPLE_RATE);
        let exact = answer.clearance().metres;
        // A ball at 15 m/s flies 1.6 cm between steps, and passes a grazed sphere within that.
        let range = stepped - 0.02..=stepped + BETWEEN_SAMPLES;
        assert!(range.contains(&exact), "exact {exact}, stepped {stepped}");
        assert_eq!(answer.avoided, exact >= 0.0);
    }
}

/// What two ways of taking samples of one motion may differ by: a limb's arc leaves its chord by
/// less, metres.
const BETWEEN_SAMPLES: f32 = 0.002;

/// The chosen candidate's score.
fn best(answer: &Answer) -> f32 {
    answer.chosen().score.unwrap().total
}

/// The best score of the candidates that the maps let pass with a clearance above `metres`, or of all candidates if there are none.
/// Everything was evaluated.
fn best_passed(all: &Answer, metres: f32) -> f32 {
    let passed = |c: &&CandidateReport| c.overlap.is_none_or(|overlap| overlap.body == 0);
    all.candidates
        .iter()
        .filter(passed)
        .filter(|c| c.clearance.is_some_and(|clear| clear.metres > metres))
        .filter_map(|c| c.score)
        .map(|score| score.total)
        .min_by(f32::total_cmp)
        .unwrap_or_else(|| best(all))
}

/// Holds a choice to what the exact test of everything says: no worse than the best candidate that
/// is clear for certain, no better than the best of all.
fn assert_best(settings: &QuerySettings, needed: &Answer, all: &Answer) {
    let slack = settings.weights.distance.abs() * BETWEEN_SAMPLES;
    let [clear, any] = [BETWEEN_SAMPLES, -1.0].map(|metres| best_passed(all, metres));
    let chosen = best(needed);
    assert!(chosen <= clear + slack, "{chosen}, and {clear} is better");
    assert!(chosen >= any - slack, "{chosen}, and {any} is the least");
}

#[test]
fn a_weight_that_rewards_distance_finds_the_widest_miss() {
    let mut settings = of_edges();
    settings.weights.distance = -4.0;
    let mut decided_by_distance = 0;
    for throw in some().take(20) {
        let needed = answer(&settings, &throw, Evaluation::Lazy);
        let all = answer(&settings, &throw, Evaluation::Exhaustive);
        if all.avoided {
            assert_best(&settings, &needed, &all);
            let usual = answer(&of_edges(), &throw, Evaluation::Lazy);
            let gained = needed.clearance().metres - usual.clearance().metres;
            decided_by_distance += usize::from(gained > 0.01);
        }
    }
    assert!(decided_by_distance > 5, "{decided_by_distance}");
}

/// The exhaustive test and the lazy one sample evasions differently; what they choose must not hang on that.
#[test]
fn the_exact_search_and_the_culled_one_choose_the_same_path() {
    let chosen = |answer: &Answer| {
        let path: Vec<EdgeId> = answer.path(embedded(), answer.chosen()).collect();
        (answer.avoided, answer.chosen().evasion, path)
    };
    for enumerate in [Enumerate::default(), Enumerate::Whole] {
        let settings = with(|s: &mut QuerySettings| s.enumerate = enumerate);
        for (index, throw) in throws(embedded(), 1, 480).enumerate() {
            let lazy = answer(&settings, &throw, Evaluation::Lazy);
            let exact = answer(&settings, &throw, Evaluation::Exhaustive);
            let (lazy, exact) = (chosen(&lazy), chosen(&exact));
            assert_eq!(lazy, exact, "{enumerate:?}, attack {index}");
        }
    }
}

#[test]
fn the_evasion_starts_when_the_attack_does() {
    let (mut settings, baked) = (of_edges(), embedded());
    settings.rates.nearest = 0.0;
    let mut evasions = 0;
    for throw in some() {
        let answer = answer(&settings, &throw, Evaluation::Lazy);
        let chosen = answer.chosen();
        let path: Vec<_> = answer.path(baked, chosen).collect();
        let Some(evasion) = chosen.evasion else {
            continue;
        };
        evasions += 1;
        let mut start = throw.playhead.seconds_to_next_node(baked.graph());
        let steps: Vec<_> = answer.motion.steps().collect();
        for step in steps.iter().take(path.len()) {
            start += baked.graph().seconds(step.edge) / step.rate;
        }
        assert_eq!(steps[path.len()].edge, evasion);
        let late = (start - throw.attack.start()).abs();
        assert!(late <= settings.rates.tolerance + 1e-4, "{late} s off");
        let range = settings.rates.slowest..=settings.rates.fastest;
        assert!(steps.iter().all(|step| range.contains(&step.rate)));
    }
    assert!(evasions > 10);
}

#[test]
fn where_nothing_is_in_time_the_nearest_is_taken() {
    let near = of_edges();
    let mut strict = near;
    strict.rates.nearest = 0.0;
    let mut taken = 0;
    for throw in throws(embedded(), 77, 400) {
        let of = |settings| answer(settings, &throw, Evaluation::Lazy).counts;
        let (found, in_time) = (of(&near), of(&strict));
        // Every path is either a candidate, alike another one, or late: none is lost.
        assert!(found.not_in_time <= in_time.not_in_time);
        if in_time.with_evasion > 0 {
            assert_eq!(found.with_evasion, in_time.with_evasion);
        } else {
            taken += usize::from(found.with_evasion > 0);
        }
    }
    assert!(taken > 5, "{taken}");
}

#[test]
fn paths_are_connected_and_motion_is_continuous() {
    let (settings, baked) = (of_edges(), embedded());
    for throw in some().take(20) {
        let answer = answer(&settings, &throw, Evaluation::Lazy);
        let mut node: NodeId = throw.playhead.next_node(baked.graph());
        for step in answer.motion.steps() {
            assert_eq!(baked.graph().edge(step.edge).from, node);
            node = baked.graph().edge(step.edge).to;
        }
        let start = centres(baked, &answer.motion, 0.0);
        let mut pose = Pose::default();
        throw.playhead.pose(baked.graph(), &mut pose);
        let joints = joints_of(baked.graph().skeleton(), &pose);
        let first = baked.body().spheres[0].centre(&joints);
        assert!(first.distance(start[0]) < 1e-4, "it starts elsewhere");
        let step = 1.0 / 240.0;
        let mut before = start;
        for tick in 1..(answer.motion.duration() / step) as usize {
            let seconds = tick as f32 * step;
            let now = centres(baked, &answer.motion, seconds);
            let moved = furthest(&before, &now);
            // No part of the embedded motions is faster than 15 m/s, at twice the rate 30.
            assert!(moved < 30.0 * step, "a jump of {moved} m at {seconds} s");
            before = now;
        }
    }
}

#[test]
fn what_is_called_a_hit_is_one_and_none_is_less_deep_than_what_is_chosen() {
    /// What an evasion is known by beforehand lies elsewhere between the samples of the motion that is played, metres.
    const SAMPLES: f32 = 2e-3;
    let baked = embedded();
    let settings = of_edges();
    let query = Query::new(baked, &settings);
    let (mut body, mut hits) = (MotionBody::default(), 0);
    for (index, throw) in throws(baked, 41, 150).enumerate() {
        let answer = answer_throw(&query, &throw, Evaluation::Lazy);
        if answer.avoided {
            continue;
        }
        let end = throw.attack.end();
        let mut exact = |report| {
            let mut motion = answer.motion_of(baked, throw.playhead, report).unwrap();
            motion.extend(baked.graph(), end + 0.1);
            let test = ExactTest::new(baked, &throw.attack);
            test.on_motion(&motion, &mut body).metres
        };
        let chosen = exact(answer.chosen());
        let may_be_chosen =
            |one: &&CandidateReport| one.rate.is_ok() && one.result != CandidateResult::TooHard;
        for report in answer.candidates.iter().filter(may_be_chosen) {
            let (said, deepest) = (report.clearance.unwrap().metres, exact(report));
            assert!(said < 0.0 && deepest < 0.0, "{index}: {report:?}");
            assert!(said > deepest - SAMPLES, "{index}: {said} of {deepest}");
            assert!(deepest < chosen + SAMPLES, "{index}: {deepest} {chosen}");
            hits += 1;
        }
    }
    assert!(hits > 100, "{hits}");
}
