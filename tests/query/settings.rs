//! Promise: settings out of range make an answer poor, and panic nowhere.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_fixtures as common;

use common::answer::answer_throw;
use common::baked::embedded;
use sabaki::query::{Evaluation, Query, QuerySettings};
use sabaki_fixtures::throw::{ThrowSettings, throw};

type Change = fn(&mut QuerySettings, f32);

const NUMBERS: [(&str, Change); 15] = [
    ("rates.slowest", |settings, value| {
        settings.rates.slowest = value
    }),
    ("rates.fastest", |settings, value| {
        settings.rates.fastest = value
    }),
    ("rates.tolerance", |settings, value| {
        settings.rates.tolerance = value
    }),
    ("rates.nearest", |settings, value| {
        settings.rates.nearest = value
    }),
    ("alike_distance", |settings, value| {
        settings.alike_distance = value
    }),
    ("alike_angle", |settings, value| {
        settings.alike_angle = value
    }),
    ("entries.slowest", |settings, value| {
        settings.entries.slowest = value
    }),
    ("entries.fastest", |settings, value| {
        settings.entries.fastest = value
    }),
    ("entries.longest_delay", |settings, value| {
        settings.entries.longest_delay = value
    }),
    ("moves.alike_distance", |settings, value| {
        settings.moves.alike_distance = value
    }),
    ("moves.alike_angle", |settings, value| {
        settings.moves.alike_angle = value
    }),
    ("weights.avoid", |settings, value| {
        settings.weights.avoid = value
    }),
    ("weights.distance", |settings, value| {
        settings.weights.distance = value
    }),
    ("weights.time", |settings, value| {
        settings.weights.time = value
    }),
    ("weights.warp", |settings, value| {
        settings.weights.warp = value
    }),
];

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
    for (name, change) in NUMBERS {
        for value in [
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::MAX,
            0.0,
            -1.0,
        ] {
            let mut settings = QuerySettings::default();
            change(&mut settings, value);
            answers(&format!("{name} {value}"), &settings);
        }
    }
}
