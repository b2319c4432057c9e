//! A whole query, over the same random attacks: candidates from the grid or from everywhere, culled
//! on the CPU or all tested exactly. Items are queries.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use common::{Motions, throws};
use divan::Bencher;
use divan::counter::ItemsCount;
use sabaki::query::cull::cpu;
use sabaki::query::{
    Answer, Enumerate, Judging, Lookup, Query, QueryContext, QuerySettings, Verdict,
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
fn prepare(bencher: Bencher<'_, '_>, place: usize) {
    let (baked, settings) = (Motions::read().bake(), settings(place));
    let throws = throws(&baked, ATTACKS);
    let (query, mut context) = (Query::new(&baked, &settings), QueryContext::default());
    bencher.counter(ItemsCount::new(ATTACKS)).bench_local(|| {
        let mut candidates = 0;
        for throw in &throws {
            let prepared = query.prepare(throw.playhead, &throw.attack, &mut context);
            candidates += prepared.cull_input().candidates.len();
        }
        candidates
    });
}

fn whole(bencher: Bencher<'_, '_>, place: usize, judging: Judging) {
    let (baked, settings) = (Motions::read().bake(), settings(place));
    let throws = throws(&baked, ATTACKS);
    let query = Query::new(&baked, &settings);
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    let mut overlaps = Vec::new();
    bencher.counter(ItemsCount::new(ATTACKS)).bench_local(|| {
        for throw in &throws {
            let mut prepared = query.prepare(throw.playhead, &throw.attack, &mut context);
            loop {
                cpu::count(&prepared.cull_input(), &mut overlaps);
                match prepared.decide(&overlaps, judging, &mut answer) {
                    Verdict::Answered => break,
                    Verdict::Widened(wider) => prepared = wider,
                }
            }
        }
    });
}

#[divan::bench(args = 0..PLACES.len())]
fn culled_on_the_cpu(bencher: Bencher<'_, '_>, place: usize) {
    whole(bencher, place, Judging::Needed);
}

#[divan::bench(args = 0..PLACES.len())]
fn exact(bencher: Bencher<'_, '_>, place: usize) {
    whole(bencher, place, Judging::All);
}
