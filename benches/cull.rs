//! Culling alone, from recording to polled counts: the CPU's maps, the device's compute shader, and its stencil buffer with
//! occlusion queries. First by number of candidates, which are those of the query that has the most, over and over;
//! then by number of queries in one submission. Where a table is of the device's timestamps, it leaves out the CPU, submission and
//! waiting.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;
#[path = "common/cullers.rs"]
mod cullers;

use std::process::ExitCode;

use common::bake_on;
use common::report::Report;
use cullers::{COLUMNS, Cullers, DeviceClock};
use sabaki::gpu::CullerDesc;
use sabaki::maps::{BakedGraph, MapGrid};
use sabaki::query::cull::{Counted, CullCandidate, CullInput};
use sabaki::query::{Query, QueryContext, QuerySettings, Session};
use sabaki_fixtures::headless::{Headless, HeadlessDesc, devices};
use sabaki_fixtures::throw::{Throw, throws};

/// Numbers of candidates. A device that is the CPU itself leaves out the last one.
const SIZES: [usize; 5] = [5, 100, 1000, 10_000, 100_000];
/// Numbers of queries in one submission.
const BATCHES: [usize; 4] = [1, 10, 50, 200];

fn main() -> ExitCode {
    Report::main("cull", measure)
}

fn measure(report: &mut Report) {
    let mut device = Headless::new(&HeadlessDesc::default()).unwrap();
    report.device(device.device_name());
    let clock = DeviceClock::new(&device).unwrap();
    // No cull on the device can be faster than this.
    report.table("the device alone", &["empty command buffer"]);
    report.row("submitted and waited for", |_| {
        device.run(|_| Ok(())).unwrap()
    });
    let maps = [("default", MapGrid::default()), ("paper's", MapGrid::PAPER)];
    let maps = maps.map(|(name, grid)| (name, bake_on(grid)));
    let sizes = match is_software(device.device_name()) {
        true => &SIZES[..SIZES.len() - 1],
        false => &SIZES[..],
    };
    let clocks = [
        ("", &COLUMNS[..], None),
        (", by the device's timestamps", &COLUMNS[1..], Some(&clock)),
    ];
    for (by, columns, clock) in clocks {
        report.table(&format!("candidates culled{by}"), columns);
        for (maps, baked) in &maps {
            for (counts, counted) in [("a choice", Counted::FOR_A_CHOICE), ("all", Counted::ALL)] {
                let name = format!("{maps} maps, counts for {counts}");
                let device = &mut device;
                of_candidates(device, baked, counted, sizes, |device, cullers, input| {
                    let name = format!("{name}, {:6}", input.candidates.len());
                    row(report, name, device, cullers, clock, &[*input]);
                });
            }
        }
    }
    for (by, columns, clock) in clocks {
        report.table(&format!("queries in one submission{by}"), columns);
        for (maps, baked) in &maps {
            of_queries(&mut device, baked, |device, cullers, inputs| {
                let name = format!("{maps} maps, {:3}", inputs.len());
                row(report, name, device, cullers, clock, inputs);
            });
        }
    }
    clock.destroy(&device);
    let _ = device.destroy();
}

/// Measures a row, by the device's clock if there is one.
fn row(
    report: &mut Report,
    name: String,
    device: &mut Headless,
    cullers: &mut Cullers,
    clock: Option<&DeviceClock>,
    inputs: &[CullInput<'_>],
) {
    match clock {
        None => report.row(name, |column| cullers.count(device, column, inputs)),
        Some(clock) => report.row_of_times(name, |column| {
            cullers.time_on_device(device, clock, column + 1, inputs)
        }),
    }
}

/// Whether the device is the CPU itself.
fn is_software(name: &str) -> bool {
    let all = devices().unwrap();
    let device = all.iter().find(|device| device.name == name);
    device.is_some_and(|device| device.kind == "software")
}

/// Calls `run` with so many candidates of one query, by size, and with the cullers that count them.
fn of_candidates(
    device: &mut Headless,
    baked: &BakedGraph,
    counted: Counted,
    sizes: &[usize],
    mut run: impl FnMut(&mut Headless, &mut Cullers, &CullInput<'_>),
) {
    let most = sizes.last().copied().unwrap() as u32;
    let mut cullers = Cullers::new(device, counted, |path| {
        let mut desc = CullerDesc::new(path, baked.atlas());
        desc.max_candidates = most;
        desc.frames_in_flight = 1;
        desc
    });
    for &size in sizes {
        with_candidates(baked, counted, size, |input| {
            cullers.check(device, &[*input]);
            run(device, &mut cullers, input);
        });
    }
    cullers.destroy(device);
}

/// Calls `run` with the candidates of so many queries, each of an attack of its own, and with the cullers that count them.
fn of_queries(
    device: &mut Headless,
    baked: &BakedGraph,
    mut run: impl FnMut(&mut Headless, &mut Cullers, &[CullInput<'_>]),
) {
    let settings = QuerySettings::default();
    let query = Query::new(baked, &settings);
    let most = BATCHES.last().copied().unwrap();
    let mut cullers = Cullers::new(device, Counted::FOR_A_CHOICE, |path| {
        CullerDesc::new(path, baked.atlas()).for_settings(&settings, most as u32)
    });
    let throws: Vec<Throw> = throws(baked, 5, 2 * most as u64).collect();
    let mut contexts: Vec<QueryContext> = throws.iter().map(|_| QueryContext::default()).collect();
    let pairs = throws.iter().zip(&mut contexts);
    let sessions = pairs.map(|(throw, context)| query.start(throw.request(), context));
    let sessions: Vec<Session<'_>> = sessions.collect();
    let inputs = sessions.iter().map(Session::cull_input);
    let fitting =
        inputs.filter(|input| !input.candidates.is_empty() && cullers.take(device, input));
    let inputs: Vec<CullInput<'_>> = fitting.take(most).collect();
    for size in BATCHES {
        let inputs = inputs.get(..size).unwrap();
        cullers.check(device, inputs);
        run(device, &mut cullers, inputs);
    }
    cullers.destroy(device);
}

/// Calls `run` with an attack and so many candidates.
fn with_candidates(
    baked: &BakedGraph,
    counted: Counted,
    size: usize,
    run: impl FnOnce(&CullInput<'_>),
) {
    let settings = QuerySettings::default();
    let throws: Vec<Throw> = throws(baked, 5, 40).collect();
    let query = Query::new(baked, &settings);
    let mut context = QueryContext::default();
    let mut candidates_of = |throw: &Throw| {
        let session = query.start(throw.request(), &mut context);
        session.cull_input().candidates.len()
    };
    let busiest = throws.iter().max_by_key(|throw| candidates_of(throw));
    let mut session = query.start(busiest.unwrap().request(), &mut context);
    if counted == Counted::ALL {
        session.draw_outer_maps();
    }
    let input = session.cull_input();
    let all = input.candidates.iter().copied();
    let candidates: Vec<CullCandidate> = all.cycle().take(size).collect();
    run(&CullInput {
        candidates: &candidates,
        ..input
    });
}
