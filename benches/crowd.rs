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
use glam::Vec3;
use plain::PlainMemory;
use sabaki::crowd::{
    CrowdSettings, Frame, Layout, LevelId, MemberId, Output, PoseSlice, WriteMode,
};
use sabaki::math::{F32x16, Isa};
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

fn output(layout: Layout, write: WriteMode) -> CrowdSettings {
    CrowdSettings {
        output: Output { layout, write },
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

/// Character by character, in memory that is read again soon.
#[divan::bench]
fn rows(bencher: Bencher<'_, '_>) {
    let settings = output(Layout::Instances, WriteMode::Cached);
    frames(bencher, &Scene::one_clip(COUNT), settings);
}

/// The same, past the caches.
#[divan::bench]
fn streamed_rows(bencher: Bencher<'_, '_>) {
    let settings = output(Layout::Instances, WriteMode::Streamed);
    frames(bencher, &Scene::one_clip(COUNT), settings);
}

/// As for [`streamed_rows`], in blocks.
#[divan::bench]
fn streamed_blocks(bencher: Bencher<'_, '_>) {
    let settings = output(Layout::Blocks, WriteMode::Streamed);
    frames(bencher, &Scene::one_clip(COUNT), settings);
}

/// Numbers of clips of two seconds each.
#[divan::bench(args = [1, 8, 200])]
fn clips(bencher: Bencher<'_, '_>, clips: usize) {
    frames(bencher, &Scene::of_many_clips(clips, COUNT), default());
}

/// Everybody plays two clips, of so many.
#[divan::bench(args = [1, 200])]
fn cross_fade(bencher: Bencher<'_, '_>, clips: usize) {
    let scene = Scene::of_many_clips(clips, COUNT).fading();
    frames(bencher, &scene, default());
}

/// Whole frames of a column: levels by a camera at this speed in metres per second, time and poses. Items are all joints of
/// all characters.
#[divan::bench(args = [0.0, 1.5, 5.0])]
fn whole_frame(bencher: Bencher<'_, '_>, speed: f32) {
    let scene = Scene::one_clip(COUNT);
    let joints = scene.joints();
    let scene = scene.in_a_column();
    let (switching, mut crowd) = (scene.switching(), scene.crowd(default()));
    let mut out = vec![F32x16::ZERO; crowd.max_output_len(COUNT)];
    let mut walked = 0.0;
    bencher.counter(ItemsCount::new(joints)).bench_local(|| {
        walked += speed / 60.0;
        let frame = Frame {
            seconds: 1.0 / 60.0,
            switching: Some(&switching),
            eye: Vec3::new(0.0, 0.0, -(walked % 500.0)),
            ..Frame::default()
        };
        crowd.frame(&frame, &mut out).unwrap();
    });
}

/// One number of one joint of each of 1,000 characters.
#[divan::bench(args = [Layout::Blocks, Layout::Instances])]
fn read_a_joint(bencher: Bencher<'_, '_>, layout: Layout) {
    let (slices, out) = posed(layout);
    let items = ItemsCount::new(slices.len());
    bencher.counter(items).bench_local(|| {
        let numbers = slices.iter().map(|slice| slice.number(&out, 7, 3));
        numbers.sum::<f32>()
    });
}

/// All joints of 1,000 characters as slices.
#[divan::bench]
fn read_a_row(bencher: Bencher<'_, '_>) {
    let (slices, out) = posed(Layout::Instances);
    let items = ItemsCount::new(slices.len());
    bencher.counter(items).bench_local(|| {
        let rows = slices.iter().filter_map(|slice| slice.row(&out));
        rows.map(|row| row[3]).sum::<f32>()
    });
}

/// All joints of 1,000 characters into the order of the skeleton; items are joints.
#[divan::bench(args = [Layout::Blocks, Layout::Instances])]
fn copy_joints(bencher: Bencher<'_, '_>, layout: Layout) {
    let (slices, out) = posed(layout);
    let scene = Scene::one_clip(1);
    let crowd = scene.crowd(default());
    let order = crowd.animations().skeleton_order(LevelId(0));
    let mut to = vec![0.0; order.len() * Output::NUMBERS];
    let items = ItemsCount::new(slices.len() * order.len());
    bencher.counter(items).bench_local(|| {
        for slice in &slices {
            slice.copy_joints(&out, order, divan::black_box(&mut to));
        }
    });
}

fn posed(layout: Layout) -> (Vec<PoseSlice>, Vec<F32x16>) {
    let settings = output(layout, WriteMode::Cached);
    let mut crowd = Scene::one_clip(1000).crowd(settings);
    let mut out = vec![F32x16::ZERO; crowd.output_len()];
    crowd.pose(&mut out).unwrap();
    let ids = (0..1000).map(MemberId);
    let slices = ids.map(|id| crowd.pose_slice(id).unwrap()).collect();
    (slices, out)
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
#[divan::bench(sample_count = 20)]
fn cold_memory(bencher: Bencher<'_, '_>) {
    let settings = output(Layout::Blocks, WriteMode::Streamed);
    frames(bencher, &Scene::one_clip(10 * COUNT), settings);
}

#[divan::bench(args = [10_000, 100_000, 1_000_000], sample_count = 10)]
fn mixed_levels(bencher: Bencher<'_, '_>, count: usize) {
    let settings = output(Layout::Blocks, WriteMode::Streamed);
    frames(bencher, &Scene::one_clip(count).mixed(), settings);
}
