//! Posing crowds: every figure in nanoseconds per joint and character (divan's items are joints).
//!
//! The clip is `SABAKI_MOCAP`'s walk where it is set, else an embedded motion.
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "common/plain.rs"]
mod plain;
#[path = "common/crowd.rs"]
mod scene;

use divan::Bencher;
use divan::counter::ItemsCount;
use plain::PlainMemory;
use sabaki::crowd::{CrowdSettings, Form, Layout, Output, WriteMode};
use sabaki::math::Isa;
use scene::Scene;

const COUNT: usize = 10_000;

fn main() {
    divan::main();
}

fn available() -> Vec<Isa> {
    Isa::available().collect()
}

/// Frame after frame of a whole crowd, into the same memory.
fn frames(bencher: Bencher<'_, '_>, scene: &Scene, settings: CrowdSettings) {
    let mut crowd = scene.crowd(settings);
    let mut out = scene.memory(&mut crowd);
    let joints = scene.joints();
    bencher.counter(ItemsCount::new(joints)).bench_local(|| {
        crowd.advance(1.0 / 60.0);
        crowd.pose(&mut out).unwrap();
    });
}

fn default() -> CrowdSettings {
    CrowdSettings::default()
}

fn output(form: Form, layout: Layout, write: WriteMode) -> CrowdSettings {
    let output = Output {
        form,
        layout,
        write,
    };
    CrowdSettings {
        output,
        ..default()
    }
}

/// The plain way, as the program was built: with `RUSTFLAGS='-C target-cpu=x86-64-v3'` for the
/// registers that it should have.
#[divan::bench]
fn plain(bencher: Bencher<'_, '_>) {
    let scene = Scene::one_clip(COUNT);
    let (clip, characters) = scene.plain();
    let mut memory = PlainMemory {
        out: vec![glam::Affine3A::IDENTITY; scene.joints()],
        ..PlainMemory::default()
    };
    let mut now = 0.0;
    let joints = ItemsCount::new(scene.joints());
    bencher.counter(joints).bench_local(|| {
        now += 1.0 / 60.0;
        clip.pose(&characters, now, &mut memory);
    });
}

#[divan::bench(args = available())]
fn matrices(bencher: Bencher<'_, '_>, isa: Isa) {
    let settings = CrowdSettings { isa, ..default() };
    frames(bencher, &Scene::one_clip(COUNT), settings);
}

#[divan::bench(args = available())]
fn rotations(bencher: Bencher<'_, '_>, isa: Isa) {
    let settings = CrowdSettings {
        isa,
        ..output(Form::Rotations, Layout::Blocks, WriteMode::Cached)
    };
    frames(bencher, &Scene::one_clip(COUNT), settings);
}

#[divan::bench]
fn rows_of_matrices(bencher: Bencher<'_, '_>) {
    let settings = output(Form::Matrices, Layout::Rows, WriteMode::Cached);
    frames(bencher, &Scene::one_clip(COUNT), settings);
}

/// Everybody with so many joints.
#[divan::bench(args = [24, 12, 6])]
fn level_of_joints(bencher: Bencher<'_, '_>, joints: usize) {
    frames(
        bencher,
        &Scene::one_clip(COUNT).with_joints(joints),
        default(),
    );
}

#[divan::bench]
fn column_by_distance(bencher: Bencher<'_, '_>) {
    frames(bencher, &Scene::one_clip(COUNT).in_a_column(), default());
}

#[divan::bench(args = [1, 2])]
fn threads(bencher: Bencher<'_, '_>, threads: usize) {
    let settings = CrowdSettings {
        threads,
        ..default()
    };
    frames(bencher, &Scene::one_clip(COUNT), settings);
}

#[divan::bench]
fn eight_clips_placed_and_faded(bencher: Bencher<'_, '_>) {
    frames(bencher, &Scene::busy(COUNT), default());
}

/// 115 MB of output: nothing of it is in a cache when it is written.
#[divan::bench(args = ["matrices", "rotations"], sample_count = 20)]
fn cold_memory(bencher: Bencher<'_, '_>, form: &str) {
    let form = match form {
        "matrices" => Form::Matrices,
        _ => Form::Rotations,
    };
    let settings = output(form, Layout::Blocks, WriteMode::Streamed);
    frames(bencher, &Scene::one_clip(10 * COUNT), settings);
}

#[divan::bench(args = [10_000, 100_000, 1_000_000], sample_count = 10)]
fn mixed_levels(bencher: Bencher<'_, '_>, count: usize) {
    let settings = output(Form::Matrices, Layout::Blocks, WriteMode::Streamed);
    frames(bencher, &Scene::one_clip(count).mixed(), settings);
}
