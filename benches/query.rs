//! A whole query, over the same random attacks: candidates from the grid or from everywhere, culled
//! on the CPU or all tested exactly. Items are queries.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use common::{Motions, throws};
use divan::Bencher;
use divan::counter::ItemsCount;
use sabaki::query::cull::cpu;
use sabaki::query::{
    Answer, Enumerate, Evaluation, Lookup, Query, QueryContext, QuerySettings, Request,
};

const ATTACKS: u64 = 50;

fn main() {
    divan::main();
}

const PLACES: [Enumerate; 4] = [
    Enumerate::Grid(Lookup::Nearest),
    Enumerate::Grid(Lookup::NearestFiled),
    Enumerate::Grid(Lookup::Union),
    Enumerate::Whole,
];

fn settings(place: usize) -> QuerySettings {
    QuerySettings {
        enumerate: PLACES[place],
        ..QuerySettings::default()
    }
}

#[divan::bench(args = 0..PLACES.len())]
fn start(bencher: Bencher<'_, '_>, place: usize) {
    let (baked, settings) = (Motions::read().bake(), settings(place));
    let throws = throws(&baked, ATTACKS);
    let (query, mut context) = (Query::new(&baked, &settings), QueryContext::default());
    bencher.counter(ItemsCount::new(ATTACKS)).bench_local(|| {
        let mut candidates = 0;
        for throw in &throws {
            let session = query.start(throw.request(), &mut context);
            candidates += session.cull_input().candidates.len();
        }
        candidates
    });
}

fn whole(bencher: Bencher<'_, '_>, place: usize, evaluation: Evaluation) {
    let (baked, settings) = (Motions::read().bake(), settings(place));
    let throws = throws(&baked, ATTACKS);
    let query = Query::new(&baked, &settings);
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    let mut culler = cpu::Culler::default();
    bencher.counter(ItemsCount::new(ATTACKS)).bench_local(|| {
        for throw in &throws {
            let request = Request {
                evaluation,
                ..throw.request()
            };
            query
                .start(request, &mut context)
                .run_on_cpu(&mut culler, &mut answer);
        }
    });
}

#[divan::bench(args = 0..PLACES.len())]
fn culled_on_the_cpu(bencher: Bencher<'_, '_>, place: usize) {
    whole(bencher, place, Evaluation::Lazy);
}

#[divan::bench(args = 0..PLACES.len())]
fn exact(bencher: Bencher<'_, '_>, place: usize) {
    whole(bencher, place, Evaluation::Exhaustive);
}
