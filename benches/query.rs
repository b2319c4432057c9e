//! A whole query, without culling and culled on the CPU, over the same random attacks: by source of the candidates, and by number of balls
//! in an attack. Each table has one evaluation: lazy, as the library evaluates by default, or of every kept candidate over the whole attack,
//! as in the paper. Without culling, the evasion maps are still counted, because the score needs them.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use std::process::ExitCode;

use common::bake_on;
use common::report::Report;
use sabaki::maps::{BakedGraph, MapGrid};
use sabaki::query::cull::{Counted, cpu};
use sabaki::query::{
    Answer, Attack, Enumerate, Evaluation, Query, QueryContext, QuerySettings, Request,
};
use sabaki_fixtures::throw::{Aim, Throw, aimed, throws};

const ATTACKS: u64 = 50;

/// Where candidates come from.
const SOURCES: [(&str, Enumerate); 4] = [
    ("grid, nearest cell", Enumerate::NearestCell),
    ("grid, nearest filed cell", Enumerate::NearestFiledCell),
    ("grid, cells around", Enumerate::TouchedCells),
    ("whole search", Enumerate::Whole),
];
/// Numbers of balls that are thrown at once, from all sides.
const BALLS: [usize; 3] = [1, 10, 100];

fn main() -> ExitCode {
    Report::main("query", measure)
}

fn measure(report: &mut Report) {
    let baked = bake_on(MapGrid::default());
    let random: Vec<Throw> = throws(&baked, 5, ATTACKS).collect();
    for (name, evaluation) in [
        ("lazily", Evaluation::Lazy),
        ("of all that is kept", Evaluation::Kept),
    ] {
        report.table(
            &format!("{ATTACKS} queries, evaluated {name}"),
            &["without culling", "culled on the CPU"],
        );
        for (source, enumerate) in SOURCES {
            queries(report, &baked, source, (enumerate, evaluation), &random);
        }
        for balls in BALLS {
            let name = format!("balls at once: {balls:3}");
            let throws: Vec<Throw> = (0..ATTACKS).map(|at| volley(&baked, balls, at)).collect();
            let method = (Enumerate::default(), evaluation);
            queries(report, &baked, &name, method, &throws);
        }
    }
    // A query enters about six, a crowd's frame three.
    report.table("tracing spans without a subscriber", &["1,000 spans"]);
    report.row("entered and left", |_| {
        for number in 0..1000 {
            let _span = tracing::trace_span!("nobody hears", number).entered();
        }
    });
}

/// Measures a row of the last table.
fn queries(
    report: &mut Report,
    baked: &BakedGraph,
    name: &str,
    (enumerate, evaluation): (Enumerate, Evaluation),
    throws: &[Throw],
) {
    let settings = QuerySettings {
        enumerate,
        ..QuerySettings::default()
    };
    let query = Query::new(baked, &settings);
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    let counted = [Counted::FOR_A_SCORE, Counted::FOR_A_CHOICE];
    let mut cullers = counted.map(|counted| cpu::Culler::default().counting(counted));
    report.row(name, |column| {
        for throw in throws {
            let request = Request {
                evaluation,
                ..throw.request()
            };
            let mut session = query.start(request, &mut context);
            session.run_on_cpu(&mut cullers[column], &mut answer);
        }
    });
}

/// Balls from all sides at all heights, thrown at once at a random moment.
fn volley(baked: &BakedGraph, balls: usize, index: u64) -> Throw {
    let aim = |ball: usize| Aim {
        from: ball as f32 * 2.4,
        height: 0.1 + 0.85 * ((ball as f32 * 0.618).fract()),
        lead: 0.5 + 0.4 * ((ball as f32 * 0.414).fract()),
        speed: 10.0,
        radius: 0.1,
        distance: 3.0,
    };
    let throws = (0..balls).map(|ball| aimed(baked, &aim(ball), 5, index).unwrap());
    let throws: Vec<Throw> = throws.collect();
    let spheres = throws.iter().flat_map(|throw| throw.attack.spheres());
    let attack = Attack::new(spheres.map(|sphere| sphere.keys().to_vec()).collect()).unwrap();
    Throw {
        playhead: throws[0].playhead,
        attack,
    }
}
