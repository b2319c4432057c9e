//! A whole query and its parts, over the same random attacks. Items are queries.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use common::{Motions, prepare, throws};
use divan::Bencher;
use divan::counter::ItemsCount;
use sabaki::avoid::cull::cpu;
use sabaki::avoid::{Judging, QuerySettings};

const ATTACKS: u64 = 50;

fn main() {
    divan::main();
}

#[divan::bench]
fn enumerate(bencher: Bencher<'_, '_>) {
    let (baked, settings) = (Motions::read().bake(), QuerySettings::default());
    let throws = throws(&baked, ATTACKS);
    bencher.counter(ItemsCount::new(ATTACKS)).bench_local(|| {
        throws
            .iter()
            .map(|throw| {
                prepare(&baked, &settings, throw)
                    .cull_input()
                    .candidates
                    .len()
            })
            .sum::<usize>()
    });
}

fn whole(bencher: Bencher<'_, '_>, judging: Judging) {
    let (baked, settings) = (Motions::read().bake(), QuerySettings::default());
    let throws = throws(&baked, ATTACKS);
    bencher.counter(ItemsCount::new(ATTACKS)).bench_local(|| {
        let mut overlaps = Vec::new();
        let answer = |throw| {
            let prepared = prepare(&baked, &settings, throw);
            cpu::count(&prepared.cull_input(), &mut overlaps);
            prepared.decide(&overlaps, judging).avoided
        };
        throws.iter().map(answer).filter(|&avoided| avoided).count()
    });
}

#[divan::bench]
fn culled_on_the_cpu(bencher: Bencher<'_, '_>) {
    whole(bencher, Judging::Needed);
}

#[divan::bench]
fn exact(bencher: Bencher<'_, '_>) {
    whole(bencher, Judging::All);
}
