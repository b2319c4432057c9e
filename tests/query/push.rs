//! Promise: no answer asks the body to push off harder than the limit that was learnt from the clips, unless all candidates do,
//! or the body does when it goes on as it is.

use glam::{Vec2, Vec3Swizzles};
use sabaki::graph::Motion;
use sabaki::maps::BakedGraph;
use sabaki::query::{Answer, CandidateResult, Evaluation, Query, QuerySettings};
use sabaki_fixtures::answer::answer_throw;
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::balls::TimedThrow;
use sabaki_fixtures::with;

use super::{balls_at, centres};

/// Largest horizontal acceleration of the centre of mass until `end`, from the definition: over a tenth of a second, every fiftieth.
fn push(baked: &BakedGraph, motion: &Motion, end: f32) -> f32 {
    let masses = baked.body().masses();
    let centre = |seconds: f32| -> Vec2 {
        let centres = centres(baked, motion, seconds);
        let weighted = centres.iter().zip(&masses);
        weighted.map(|(at, mass)| at.xz() * *mass).sum()
    };
    let starts = (0..).map(|step| 0.02 * step as f32);
    let starts = starts.take_while(|start| start + 0.2 <= end);
    let accelerations = starts.map(|start| {
        let [a, b, c] = [0.0, 0.1, 0.2].map(|later| centre(start + later));
        (a - 2.0 * b + c).length() / 0.01
    });
    accelerations.fold(0.0, f32::max)
}

fn answer(multiple: f32, thrown: &TimedThrow, evaluation: Evaluation) -> Answer {
    let settings = with(|s: &mut QuerySettings| s.push_off = multiple);
    let query = Query::new(embedded(), &settings);
    answer_throw(&query, &thrown.throw, evaluation)
}

#[test]
fn answers_push_no_harder_than_the_limit() {
    /// What lies between the twentieths of a second at which queries look may be a little more.
    const BETWEEN: f32 = 1.1;
    let baked = embedded();
    let (mut refused, mut harder) = (0, 0);
    /// The share of the limit that is allowed against an attack that arrives later than in 0.4 s.
    const GENTLE: f32 = 0.8;
    let throws = [0.3, 0.6, 0.9].map(|contact| {
        let thrown = balls_at(std::iter::repeat_n(contact, 30), 9);
        thrown.into_iter().map(move |thrown| (contact, thrown))
    });
    for (contact, thrown) in throws.into_iter().flatten() {
        let end = thrown.throw.attack.end();
        let limited = answer(1.0, &thrown, Evaluation::Lazy);
        let results = limited.candidates.iter().map(|report| report.result);
        let too_hard = results.filter(|&result| result == CandidateResult::TooHard);
        let count = too_hard.count();
        assert_eq!(count, limited.counts.too_hard);
        refused += count;
        let tested = limited.counts.hits + limited.counts.clean;
        let found = push(baked, &limited.motion, end);
        let mut natural = Motion::new(baked.graph(), thrown.throw.playhead, &[]);
        natural.extend(baked.graph(), end + 0.1);
        let share = if contact > 0.4 { GENTLE } else { 1.0 };
        let limit = (share * baked.push_limit()).max(push(baked, &natural, end));
        let within = found <= BETWEEN * limit;
        assert!(within || tested == 1, "{found} of {limit}");
        let free = answer(0.0, &thrown, Evaluation::Lazy);
        assert_eq!(free.counts.too_hard, 0);
        harder += usize::from(push(baked, &free.motion, end) > BETWEEN * limit);
        let all = answer(1.0, &thrown, Evaluation::Exhaustive);
        assert_eq!(all.avoided, limited.avoided);
    }
    let is_tried = refused > 3 && harder > 3;
    assert!(is_tried, "{refused} refused, {harder} harder");
}

#[test]
fn masses_are_shares_of_the_whole() {
    let masses = embedded().body().masses();
    assert_eq!(masses.len(), embedded().body().spheres.len());
    assert!(masses.iter().all(|&mass| mass > 0.0));
    assert!((masses.iter().sum::<f32>() - 1.0).abs() < 1e-4);
}
