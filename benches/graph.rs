//! Building: the distance maps of all pairs of clips on one core, the graph, the bake.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use common::Motions;
use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use sabaki::graph::{self, GraphSettings, PointCloud, distance};
use sabaki::region::{BakeSettings, Baker};

fn main() {
    divan::main();
}

/// Items are pairs of windows.
#[divan::bench]
fn distance_maps_one_core(bencher: Bencher<'_, '_>) {
    let motions = Motions::read();
    let weights = vec![1.0; motions.skeleton.len()];
    let cloud = |clip: &sabaki::anim::Clip| {
        PointCloud::new(&motions.skeleton, &clip.resampled(30.0).unwrap(), &weights)
    };
    let clouds: Vec<PointCloud> = motions.clips.iter().map(cloud).collect();
    let windows = |cloud: &PointCloud| (cloud.frames() + 1).saturating_sub(10);
    let pairs = || {
        clouds
            .iter()
            .enumerate()
            .flat_map(|(i, a)| clouds[i..].iter().map(move |b| (a, b)))
    };
    let count: usize = pairs().map(|(a, b)| windows(a) * windows(b)).sum();
    bencher.counter(ItemsCount::new(count)).bench_local(|| {
        for (a, b) in pairs() {
            distance::for_each_row(a, b, 10, |_, row| {
                black_box(row);
            });
        }
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
