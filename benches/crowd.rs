//! Posing crowds, in nanoseconds per joint and character: `cargo bench --bench crowd`. `sabaki crowd` measures instruction sets, levels of
//! detail and threads.
//!
//! The clip is `SABAKI_MOCAP`'s walk where it is set (`walk/Male2_B3_Walk.bvh` of that folder), else an embedded motion.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;
#[path = "common/plain.rs"]
mod plain;
#[path = "common/crowd.rs"]
mod scene;

use std::hint::black_box;
use std::process::ExitCode;

use common::report::Report;
use glam::Vec3;
use plain::PlainMemory;
use sabaki::crowd::{
    CrowdSettings, Frame, Layout, LevelId, MemberId, Output, PoseSlice, WriteMode,
};
use sabaki::math::F32x16;
use scene::Scene;

const COUNT: usize = 10_000;
const UNIT: &str = "ns per joint";

fn main() -> ExitCode {
    Report::main("crowd", measure)
}

fn measure(report: &mut Report) {
    beside_the_plain_way(report);
    report.table_in(UNIT, "10,000 characters", &["now"]);
    let default = CrowdSettings::default;
    for (name, layout, write) in [
        ("rows, cached", Layout::Instances, WriteMode::Cached),
        ("rows, streamed", Layout::Instances, WriteMode::Streamed),
        ("blocks, streamed", Layout::Blocks, WriteMode::Streamed),
    ] {
        frames(
            report,
            name,
            || Scene::one_clip(COUNT),
            output(layout, write),
        );
    }
    for clips in [1, 8, 200] {
        let scene = || Scene::of_many_clips(clips, COUNT);
        frames(report, &format!("clips: {clips:3}"), scene, default());
    }
    for clips in [1, 200] {
        let scene = || Scene::of_many_clips(clips, COUNT).fading();
        frames(
            report,
            &format!("two of {clips:3} clips each"),
            scene,
            default(),
        );
    }
    for speed in [0.0, 1.5, 5.0] {
        whole_frame(report, speed);
    }
    report.table_in(UNIT, "many characters, blocks, streamed", &["now"]);
    let streamed = output(Layout::Blocks, WriteMode::Streamed);
    // 115 MB of output: nothing of it is in a cache when it is written.
    let cold = || Scene::one_clip(10 * COUNT);
    frames(report, "one clip, 100,000", cold, streamed);
    for count in [10_000, 100_000, 1_000_000] {
        let name = format!("mixed levels, {count:7}");
        frames(report, &name, || Scene::one_clip(count).mixed(), streamed);
    }
    readers(report);
}

/// Nanoseconds per item of a call: how many of them a second has.
fn per(items: usize) -> f64 {
    1e9 / items as f64
}

fn output(layout: Layout, write: WriteMode) -> CrowdSettings {
    CrowdSettings {
        output: Output { layout, write },
        ..CrowdSettings::default()
    }
}

/// The plain way, as the program was built: with `RUSTFLAGS='-C target-cpu=x86-64-v3'` for the registers that it should have.
fn beside_the_plain_way(report: &mut Report) {
    report.table_in(UNIT, "on one thread", &["plain", "crowd"]);
    let scene = Scene::one_clip(COUNT);
    let (clip, characters) = scene.plain();
    let mut memory = PlainMemory {
        out: vec![glam::Affine3A::IDENTITY; scene.joints()],
        ..PlainMemory::default()
    };
    let mut crowd = scene.crowd(CrowdSettings::default());
    let mut out = scene.memory(&mut crowd);
    let mut now = 0.0;
    report.row_in("10,000 characters", per(scene.joints()), |column| {
        if column > 0 {
            crowd.advance(1.0 / 60.0);
            crowd.pose(&mut out).unwrap();
        } else {
            now += 1.0 / 60.0;
            clip.pose(&characters, now, &mut memory);
        }
    });
}

/// Frame after frame of a whole crowd, into the same memory.
fn frames(report: &mut Report, name: &str, scene: impl FnOnce() -> Scene, settings: CrowdSettings) {
    if !report.wants(name) {
        return;
    }
    let scene = scene();
    let mut crowd = scene.crowd(settings);
    let mut out = scene.memory(&mut crowd);
    report.row_in(name, per(scene.joints()), |_| {
        crowd.advance(1.0 / 60.0);
        crowd.pose(&mut out).unwrap();
    });
}

/// Whole frames of a column: levels by a camera at this speed in metres per second, time and poses. All joints of all characters count.
fn whole_frame(report: &mut Report, speed: f32) {
    let scene = Scene::one_clip(COUNT);
    let joints = scene.joints();
    let scene = scene.in_a_column();
    let (switching, mut crowd) = (scene.switching(), scene.crowd(CrowdSettings::default()));
    let mut out = vec![F32x16::ZERO; crowd.max_output_len(COUNT)];
    let mut walked = 0.0;
    report.row_in(
        format!("whole frame, camera at {speed} m/s"),
        per(joints),
        |_| {
            walked += speed / 60.0;
            let frame = Frame {
                seconds: 1.0 / 60.0,
                switching: Some(&switching),
                eye: Vec3::new(0.0, 0.0, -(walked % 500.0)),
            };
            crowd.frame(&frame, &mut out).unwrap();
        },
    );
}

/// Reading the poses of 1,000 characters.
fn readers(report: &mut Report) {
    let layouts = [Layout::Blocks, Layout::Instances].map(posed);
    let columns = ["blocks", "instances"];
    report.table_in(
        "ns per character",
        "one number of a joint is read",
        &columns,
    );
    report.row_in("1,000 characters", per(1000), |column| {
        let (slices, out) = &layouts[column];
        let numbers = slices.iter().map(|slice| slice.number(out, 7, 3));
        numbers.sum::<f32>()
    });
    report.table_in("ns per character", "all joints as a slice", &columns[1..]);
    report.row_in("1,000 characters", per(1000), |_| {
        let (slices, out) = &layouts[1];
        let rows = slices.iter().filter_map(|slice| slice.row(out));
        rows.map(|row| row[3]).sum::<f32>()
    });
    report.table_in(UNIT, "copied into the order of the skeleton", &columns);
    let crowd = Scene::one_clip(1).crowd(CrowdSettings::default());
    let order = crowd.animations().skeleton_order(LevelId(0));
    let mut to = vec![0.0; order.len() * Output::NUMBERS];
    report.row_in("1,000 characters", per(1000 * order.len()), |column| {
        let (slices, out) = &layouts[column];
        for slice in slices {
            slice.copy_joints(out, order, black_box(&mut to));
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
