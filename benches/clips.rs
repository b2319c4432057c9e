//! Sampling of compressed clips against plain ones, and what compression saves: `cargo bench --bench clips`.
//!
//! Moments are random, of all clips in `SABAKI_MOCAP/fight` and their mirror images, which is what a crowd reads; and of one
//! clip, which the caches hold.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use std::hint::black_box;
use std::process::ExitCode;
use std::time::Instant;

use common::report::Report;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sabaki::anim::{Clip, CompressionSettings, Pose};
use sabaki::math::Isa;
use sabaki_fixtures::captures::captures;

/// Number of moments of a call.
const MOMENTS: usize = 20_000;

fn main() -> ExitCode {
    Report::main("clips", measure)
}

fn measure(report: &mut Report) {
    let mut set = captures("fight");
    set.add_mirrored().unwrap();
    let plain: Vec<Clip> = set
        .clips
        .iter()
        .map(|clip| clip.resampled(30.0).unwrap())
        .collect();
    let settings = CompressionSettings::default();
    let started = Instant::now();
    let packed: Vec<Clip> = plain
        .iter()
        .map(|clip| clip.compressed(&set.skeleton, &settings))
        .collect();
    let seconds = started.elapsed().as_secs_f64();
    report_sizes(&packed, seconds);
    report.table_in("ns per sample", "random moments", &["plain", "compressed"]);
    for isa in Isa::available() {
        for (what, count) in [("all clips", plain.len()), ("one clip", 1)] {
            let mut random = Pcg64Mcg::seed_from_u64(5);
            let moment = |_| {
                let clip = random.random_range(0..count);
                let last = (plain[clip].frames() - 1) as f32;
                (clip, random.random_range(0.0..1.0) * last)
            };
            let moments: Vec<(usize, f32)> = (0..MOMENTS).map(moment).collect();
            let mut pose = Pose::default();
            let name = format!("of {what}, {isa:?}");
            report.row_in(name, 1e9 / MOMENTS as f64, |column| {
                let clips = [&plain, &packed][column];
                for &(clip, frame) in &moments {
                    clips[clip].sample_on(isa, frame, &mut pose);
                    black_box(&pose);
                }
            });
        }
    }
}

fn report_sizes(packed: &[Clip], seconds: f64) {
    let (mut bytes, mut plain_bytes, mut frames) = (0, 0, 0);
    let mut errors = [0f32; 2];
    for clip in packed {
        let [own, plain] = clip.stored_bytes();
        (bytes, plain_bytes, frames) = (bytes + own, plain_bytes + plain, frames + clip.frames());
        let Some(own) = clip.compression_errors() else {
            eprintln!("{}: not compressed", clip.name());
            continue;
        };
        errors = [0, 1].map(|kind| errors[kind].max(own[kind]));
    }
    println!(
        "{frames} frames of {} joints in {} clips: {:.1} bytes a frame, plain {:.1}: {:.2} times smaller",
        packed[0].joints(),
        packed.len(),
        bytes as f64 / frames as f64,
        plain_bytes as f64 / frames as f64,
        plain_bytes as f64 / bytes as f64
    );
    let [joints, ends] = errors.map(|metres| 1e3 * metres);
    println!("largest error: {joints:.4} mm at the joints, {ends:.4} mm at the ends");
    println!("compressed in {seconds:.2} s on one thread");
}
