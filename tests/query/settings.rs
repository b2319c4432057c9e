//! Promise: settings out of range make an answer poor, and panic nowhere.

use sabaki::query::{Evaluation, Query, QuerySettings};
use sabaki_fixtures::answer::answer_throw;
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::throw::{ThrowSettings, throw};

fn numbers(settings: &mut QuerySettings) -> [&mut f32; 15] {
    let (rates, entries) = (&mut settings.rates, &mut settings.entries);
    let (moves, weights) = (&mut settings.moves, &mut settings.weights);
    [
        &mut rates.slowest,
        &mut rates.fastest,
        &mut rates.tolerance,
        &mut rates.nearest,
        &mut settings.alike_distance,
        &mut settings.alike_angle,
        &mut entries.slowest,
        &mut entries.fastest,
        &mut entries.longest_delay,
        &mut moves.alike_distance,
        &mut moves.alike_angle,
        &mut weights.avoid,
        &mut weights.distance,
        &mut weights.time,
        &mut weights.warp,
    ]
}

/// Throws that are avoided, throws that are not, and throws that nothing but a move can answer.
fn answers(what: &str, settings: &QuerySettings) {
    let query = Query::new(embedded(), settings);
    for seconds in [0.05, 0.3, 1.0] {
        let thrown = ThrowSettings {
            lead: (seconds, seconds + 0.1),
            ..ThrowSettings::default()
        };
        for index in 0..4 {
            let throw = throw(embedded(), &thrown, 17, index).unwrap();
            for evaluation in [Evaluation::Lazy, Evaluation::Exhaustive] {
                let answer = answer_throw(&query, &throw, evaluation);
                assert!(answer.chosen < answer.candidates.len(), "{what}");
            }
        }
    }
}

#[test]
fn numbers_that_are_infinite_or_none_are_answered() {
    let infinite = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX];
    for index in 0..15 {
        for value in infinite.into_iter().chain([0.0, -1.0]) {
            let mut settings = QuerySettings::default();
            *numbers(&mut settings)[index] = value;
            answers(&format!("number {index}: {value}"), &settings);
        }
    }
}
