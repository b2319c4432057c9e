//! Sampling of compressed clips against plain ones, and what compression saves: `cargo bench --bench clips`.
//!
//! Moments are random, of all clips in `SABAKI_MOCAP/fight` and their mirror images, which is what a crowd reads; and of one
//! clip, which the caches hold. Both forms are measured in turn in one run, with each instruction set of the machine.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::hint::black_box;
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sabaki::anim::{Clip, CompressionSettings, Pose};
use sabaki::math::Isa;
use sabaki_fixtures::captures::captures;

/// Number of moments of a round.
const MOMENTS: usize = 20_000;

/// Number of rounds, of which the fastest counts.
const ROUNDS: usize = 15;

fn main() {
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
    println!("| instruction set | moments | plain, ns | compressed, ns | ratio |");
    println!("| --- | --- | ---: | ---: | ---: |");
    for isa in Isa::available() {
        for (what, count) in [("of all clips", plain.len()), ("of one clip", 1)] {
            let [a, b] = measure(isa, [&plain[..count], &packed[..count]]);
            println!("| {isa:?} | {what} | {a:.0} | {b:.0} | {:.2} |", b / a);
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

/// Nanoseconds a sample of each form.
fn measure(isa: Isa, forms: [&[Clip]; 2]) -> [f64; 2] {
    let mut random = Pcg64Mcg::seed_from_u64(5);
    let moments: Vec<(usize, f32)> = (0..MOMENTS)
        .map(|_| {
            let clip = random.random_range(0..forms[0].len());
            let last = (forms[0][clip].frames() - 1) as f32;
            (clip, random.random_range(0.0..1.0) * last)
        })
        .collect();
    let mut pose = Pose::default();
    let mut best = [Duration::MAX; 2];
    for _ in 0..ROUNDS {
        for (clips, best) in forms.iter().zip(&mut best) {
            let started = Instant::now();
            for &(clip, frame) in &moments {
                clips[clip].sample_on(isa, frame, &mut pose);
                black_box(&pose);
            }
            *best = started.elapsed().min(*best);
        }
    }
    best.map(|time| time.as_nanos() as f64 / MOMENTS as f64)
}
