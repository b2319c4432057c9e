//! Culling alone, from recording to polled counts, by number of candidates: the CPU's maps, the device's stencil buffer, and
//! its compute shader. Items are candidates: those of the query that has the most, over and over.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use std::fmt;
use std::sync::OnceLock;

use common::{Motions, throws};
use divan::Bencher;
use divan::counter::ItemsCount;
use sabaki::gpu::{Counting, Culler, CullerDesc};
use sabaki::maps::{BakedGraph, MapGrid};
use sabaki::query::cull::{Counted, CullCandidate, CullInput, CullPath, cpu};
use sabaki::query::{Query, QueryContext, QuerySettings};
use sabaki_app::demo::throw::Throw;
use sabaki_app::headless::{Headless, HeadlessDesc};

/// How many candidates are culled, on which maps, and what is counted of them.
#[derive(Clone, Copy)]
struct Row {
    count: usize,
    /// The paper's maps rather than the default ones.
    paper: bool,
    /// What a query's choice asks for rather than everything.
    choice: bool,
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let maps = if self.paper { "paper" } else { "default" };
        let counted = if self.choice { "choice" } else { "all" };
        write!(f, "{:5} {maps} {counted}", self.count)
    }
}

impl Row {
    fn counted(self) -> Counted {
        match self.choice {
            true => Counted::FOR_A_CHOICE,
            false => Counted::ALL,
        }
    }

    fn baked(self) -> &'static BakedGraph {
        static BAKED: [OnceLock<BakedGraph>; 2] = [const { OnceLock::new() }; 2];
        BAKED[usize::from(self.paper)].get_or_init(|| {
            let maps = match self.paper {
                true => MapGrid::PAPER,
                false => MapGrid::default(),
            };
            Motions::read().bake_on(maps)
        })
    }

    /// Calls `run` with an attack and candidates.
    fn cull(self, run: impl FnOnce(&CullInput<'_>)) {
        let (baked, settings) = (self.baked(), QuerySettings::default());
        let throws = throws(baked, 40);
        let query = Query::new(baked, &settings);
        let mut context = QueryContext::default();
        let mut candidates_of = |throw: &Throw| {
            let session = query.start(throw.request(), &mut context);
            session.cull_input().candidates.len()
        };
        let busiest = throws.iter().max_by_key(|throw| candidates_of(throw));
        let busiest = busiest.unwrap();
        let mut session = query.start(busiest.request(), &mut context);
        if !self.choice {
            session.draw_outer_maps();
        }
        let input = session.cull_input();
        let all = input.candidates.iter().copied();
        let candidates: Vec<CullCandidate> = all.cycle().take(self.count).collect();
        run(&CullInput {
            candidates: &candidates,
            ..input
        });
    }
}

fn rows() -> impl Iterator<Item = Row> {
    let sets = [(false, false), (false, true), (true, false), (true, true)];
    sets.into_iter().flat_map(|(paper, choice)| {
        [5, 100, 1000, 10_000].map(|count| Row {
            count,
            paper,
            choice,
        })
    })
}

fn main() {
    divan::main();
}

#[divan::bench(args = rows())]
fn by_cpu(bencher: Bencher<'_, '_>, row: &Row) {
    row.cull(|input| {
        let mut culler = cpu::Culler::default().counting(row.counted());
        let mut overlaps = Vec::new();
        bencher
            .counter(ItemsCount::new(row.count))
            .bench_local(|| culler.count(input, &mut overlaps));
    });
}

#[divan::bench(args = rows())]
fn by_stencil(bencher: Bencher<'_, '_>, row: &Row) {
    by_device(CullPath::Stencil, Counting::Queries, (bencher, row));
}

#[divan::bench(args = rows())]
fn by_stencil_and_atomics(bencher: Bencher<'_, '_>, row: &Row) {
    by_device(CullPath::Stencil, Counting::Atomics, (bencher, row));
}

#[divan::bench(args = rows())]
fn by_compute(bencher: Bencher<'_, '_>, row: &Row) {
    by_device(CullPath::Compute, Counting::default(), (bencher, row));
}

fn by_device(path: CullPath, counting: Counting, (bencher, row): (Bencher<'_, '_>, &Row)) {
    let mut device = Headless::new(&HeadlessDesc::default()).unwrap();
    let mut desc = CullerDesc {
        counted: row.counted(),
        ..CullerDesc::new(path, row.baked().atlas())
    };
    desc.stencil.counting = counting;
    if path == CullPath::Compute {
        desc.max_candidates = 10_000;
    }
    let mut culler = device
        .make(|context, memory| Culler::new(context, memory, &desc))
        .unwrap();
    row.cull(|input| {
        bencher
            .counter(ItemsCount::new(row.count))
            .bench_local(|| device.cull(&mut culler, input).unwrap());
    });
    culler.destroy(device.memory().unwrap());
    let _ = device.destroy();
}

/// What no cull on the device can be faster than: an empty command buffer, submitted and waited for.
#[divan::bench]
fn nothing_on_the_device(bencher: Bencher<'_, '_>) {
    let mut device = Headless::new(&HeadlessDesc::default()).unwrap();
    bencher.bench_local(|| device.run(|_| Ok(())).unwrap());
    let _ = device.destroy();
}
