//! Culling alone, from recording to counts, by number of candidates: the CPU's maps, the device's stencil buffer, and its
//! compute shader. Items are candidates.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use common::{Motions, throws};
use divan::Bencher;
use divan::counter::ItemsCount;
use sabaki::avoid::cull::{Counted, CullCandidate, CullInput, cpu};
use sabaki::avoid::{Query, QueryContext, QuerySettings};
use sabaki::demo::throw::Throw;
use sabaki::gpu::stencil::{Culler, CullerDesc};
use sabaki::gpu::{Headless, HeadlessDesc, compute};
use sabaki::region::{BakedGraph, MapGrid};

const COUNTS: [usize; 5] = [5, 100, 300, 1000, 10_000];

fn main() {
    divan::main();
}

/// Calls `run` with an attack and that many candidates: those of the query that has the most, over and over.
fn with_candidates(baked: &BakedGraph, count: usize, run: impl FnOnce(&CullInput<'_>)) {
    let settings = QuerySettings::default();
    let throws = throws(baked, 40);
    let query = Query::new(baked, &settings);
    let mut context = QueryContext::default();
    let mut candidates_of = |throw: &Throw| {
        let prepared = query.prepare(throw.playhead, &throw.attack, &mut context);
        prepared.cull_input().candidates.len()
    };
    let busiest = throws
        .iter()
        .max_by_key(|throw| candidates_of(throw))
        .unwrap();
    let prepared = query.prepare(busiest.playhead, &busiest.attack, &mut context);
    let input = prepared.cull_input();
    let candidates: Vec<CullCandidate> = input
        .candidates
        .iter()
        .copied()
        .cycle()
        .take(count)
        .collect();
    run(&CullInput {
        candidates: &candidates,
        ..input
    });
}

#[divan::bench(args = COUNTS)]
fn by_cpu(bencher: Bencher<'_, '_>, count: usize) {
    on_cpu(bencher, count, MapGrid::default());
}

#[divan::bench(args = COUNTS)]
fn by_cpu_on_the_papers_maps(bencher: Bencher<'_, '_>, count: usize) {
    on_cpu(bencher, count, MapGrid::PAPER);
}

#[divan::bench(args = COUNTS)]
fn by_stencil(bencher: Bencher<'_, '_>, count: usize) {
    on_stencil(bencher, count, (MapGrid::default(), Counted::default()));
}

#[divan::bench(args = COUNTS)]
fn by_stencil_on_the_papers_maps(bencher: Bencher<'_, '_>, count: usize) {
    on_stencil(bencher, count, (MapGrid::PAPER, Counted::default()));
}

/// What the paper counts: no outer maps.
#[divan::bench(args = COUNTS)]
fn by_stencil_as_the_paper(bencher: Bencher<'_, '_>, count: usize) {
    let counted = Counted {
        outer: false,
        ..Counted::default()
    };
    on_stencil(bencher, count, (MapGrid::PAPER, counted));
}

fn on_cpu(bencher: Bencher<'_, '_>, count: usize, maps: MapGrid) {
    let baked = Motions::read().bake_on(maps);
    with_candidates(&baked, count, |input| {
        let (mut culler, mut overlaps) = (cpu::Culler::default(), Vec::new());
        bencher
            .counter(ItemsCount::new(count))
            .bench_local(|| culler.count(input, &mut overlaps));
    });
}

fn on_stencil(bencher: Bencher<'_, '_>, count: usize, (maps, counted): (MapGrid, Counted)) {
    let baked = Motions::read().bake_on(maps);
    let mut device = Headless::new(&HeadlessDesc::default()).unwrap();
    let desc = CullerDesc {
        counted,
        ..CullerDesc::new("bench", baked.atlas())
    };
    let mut culler = device
        .make(|context, memory| Culler::new(context, memory, &desc))
        .unwrap();
    with_candidates(&baked, count, |input| {
        bencher
            .counter(ItemsCount::new(count))
            .bench_local(|| device.cull(&mut culler, input).unwrap());
    });
    culler.destroy(device.memory().unwrap());
    let _ = device.destroy();
}

#[divan::bench(args = COUNTS)]
fn by_compute(bencher: Bencher<'_, '_>, count: usize) {
    let baked = Motions::read().bake();
    let mut device = Headless::new(&HeadlessDesc::default()).unwrap();
    let desc = compute::CullerDesc::new("bench", baked.atlas());
    let mut culler = device
        .make(|context, memory| compute::Culler::new(context, memory, &desc))
        .unwrap();
    with_candidates(&baked, count, |input| {
        bencher
            .counter(ItemsCount::new(count))
            .bench_local(|| device.cull_compute(&mut culler, input).unwrap());
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
