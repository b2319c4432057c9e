//! A whole query, over the same random attacks: candidates from the grid or from everywhere, culled on the CPU or all
//! evaluated exactly.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use std::process::ExitCode;

use common::report::Report;
use common::{bake_on, throws};
use sabaki::maps::MapGrid;
use sabaki::query::cull::cpu;
use sabaki::query::{Answer, Enumerate, Evaluation, Query, QueryContext, QuerySettings, Request};

const ATTACKS: u64 = 50;

/// Where candidates come from.
const SOURCES: [(&str, Enumerate); 4] = [
    ("grid, nearest cell", Enumerate::NearestCell),
    ("grid, nearest filed cell", Enumerate::NearestFiledCell),
    ("grid, cells around", Enumerate::TouchedCells),
    ("whole search", Enumerate::Whole),
];

const COLUMNS: [&str; 3] = ["candidates alone", "culled on the CPU", "all evaluated"];

fn main() -> ExitCode {
    Report::main("query", measure)
}

fn measure(report: &mut Report) {
    let baked = bake_on(MapGrid::default());
    let throws = throws(&baked, ATTACKS);
    report.table(
        &format!("{ATTACKS} queries, by source of the candidates"),
        &COLUMNS,
    );
    for (name, enumerate) in SOURCES {
        let settings = QuerySettings {
            enumerate,
            ..QuerySettings::default()
        };
        let query = Query::new(&baked, &settings);
        let (mut context, mut answer) = (QueryContext::default(), Answer::default());
        let mut culler = cpu::Culler::default();
        report.row(name, |column| {
            let mut candidates = 0;
            for throw in &throws {
                let evaluation = match column {
                    2 => Evaluation::Exhaustive,
                    _ => Evaluation::Lazy,
                };
                let request = Request {
                    evaluation,
                    ..throw.request()
                };
                let mut session = query.start(request, &mut context);
                candidates += session.cull_input().candidates.len();
                if column > 0 {
                    session.run_on_cpu(&mut culler, &mut answer);
                }
            }
            candidates
        });
    }
    // A query enters about six, a crowd's frame three.
    report.table("tracing spans without a subscriber", &["1,000 spans"]);
    report.row("entered and left", |_| {
        for number in 0..1000 {
            let _span = tracing::trace_span!("nobody hears", number).entered();
        }
    });
}
