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
use sabaki::crowd::{CrowdSettings, Form, Layout, Memory, Output};
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

#[divan::bench(args = available())]
fn a_plain(bencher: Bencher<'_, '_>, isa: Isa) {
    let scene = Scene::one_clip(COUNT);
    let (clip, characters) = scene.plain();
    let mut out = vec![glam::Affine3A::IDENTITY; scene.joints()];
    let mut now = 0.0;
    bencher
        .counter(ItemsCount::new(scene.joints()))
        .bench_local(|| {
            now += 1.0 / 60.0;
            isa.run(|| clip.pose(&characters, now, &mut out));
        });
}

#[divan::bench(args = available())]
fn b_matrices(bencher: Bencher<'_, '_>, isa: Isa) {
    let settings = CrowdSettings {
        isa,
        ..CrowdSettings::default()
    };
    frames(bencher, &Scene::one_clip(COUNT), settings);
}

#[divan::bench(args = available())]
fn c_rotations(bencher: Bencher<'_, '_>, isa: Isa) {
    let output = Output {
        form: Form::Rotations,
        ..Output::default()
    };
    let settings = CrowdSettings {
        isa,
        output,
        ..CrowdSettings::default()
    };
    frames(bencher, &Scene::one_clip(COUNT), settings);
}
