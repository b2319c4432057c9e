//! Building: the distance maps of all pairs of clips on one core, the graph, the bake.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use common::Motions;
use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use sabaki::graph::distance::{DistanceMap, Windows};
use sabaki::graph::{self, GraphSettings, PointCloud};
use sabaki::maps::{BakeSettings, Baker};
use sabaki::math::Isa;

fn main() {
    divan::main();
}

/// Items are pairs of windows. The layouts that the maps read are made anew each time.
#[divan::bench(args = Isa::available().collect::<Vec<_>>())]
fn distance_maps_one_core(bencher: Bencher<'_, '_>, isa: Isa) {
    let motions = Motions::read();
    let weights = vec![1.0; motions.skeleton.len()];
    let cloud = |clip: &sabaki::anim::Clip| {
        PointCloud::new(&motions.skeleton, &clip.resampled(30.0).unwrap(), &weights)
    };
    let clouds: Vec<PointCloud> = motions.clips.iter().map(cloud).collect();
    let for_each_pair = |call: &mut dyn FnMut(&Windows, &Windows)| {
        let windows: Vec<Windows> = clouds.iter().map(|cloud| Windows::new(cloud, 10)).collect();
        for (i, a) in windows.iter().enumerate() {
            windows[i..].iter().for_each(|b| call(a, b));
        }
    };
    let mut count = 0;
    for_each_pair(&mut |a, b| count += a.count() * b.count());
    bencher.counter(ItemsCount::new(count)).bench_local(|| {
        for_each_pair(&mut |a, b| {
            let map = DistanceMap::new(a, b).with_isa(isa);
            map.for_each_row(|_, row| {
                black_box(row);
            });
        });
    });
}

#[divan::bench(args = [1, 2])]
fn build(bencher: Bencher<'_, '_>, threads: usize) {
    let motions = Motions::read();
    let settings = GraphSettings {
        threads,
        ..GraphSettings::default()
    };
    bencher.bench_local(|| graph::build(motions.source(), &settings).unwrap());
}

#[divan::bench]
fn build_without_links(bencher: Bencher<'_, '_>) {
    let motions = Motions::read();
    let settings = GraphSettings {
        threads: 1,
        links: None,
        ..GraphSettings::default()
    };
    bencher.bench_local(|| graph::build(motions.source(), &settings).unwrap());
}

#[divan::bench]
fn bake_on_the_cpu(bencher: Bencher<'_, '_>) {
    let motions = Motions::read();
    let (graph, _) = graph::build(motions.source(), &GraphSettings::default()).unwrap();
    bencher
        .with_inputs(|| graph.clone())
        .bench_local_values(|graph| {
            Baker::new(graph, BakeSettings::default())
                .unwrap()
                .finish_on_cpu()
                .unwrap()
        });
}
