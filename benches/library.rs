//! The search for transitions in libraries of growing length: `cargo bench --bench library -- 10 60 600` (minutes).
//!
//! No library of hours is at hand: these are made of the clips in `SABAKI_MOCAP/fight` and their mirror images, by cutting, by
//! changes of speed, and by turning each joint about a random axis, in each pass over the clips by other angles of 12° in the mean
//! square. The turns stand for other people and other moods: without them a library would repeat the same minutes, and the
//! transitions would grow with the square of its length.
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "common/library.rs"]
mod library;

use std::path::PathBuf;
use std::time::Instant;

use library::Library;
use sabaki::graph::{ClipSource, GraphSettings};
use sabaki::internal::{BandJobs, DistanceMap, GraphBuilder, PrunedSearch, Windows};
use sabaki_import::{ReadOptions, read_clips};

/// Standard deviation of the joints' turns, in degrees.
const TURN: f32 = 12.0;

/// Length up to which all pairs are measured too, in minutes.
const ALL_PAIRS: f64 = 20.0;

fn main() {
    let Some(root) = std::env::var_os("SABAKI_MOCAP") else {
        eprintln!("skipped: SABAKI_MOCAP names no folder with motion capture");
        return;
    };
    let minutes: Vec<f64> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let minutes = match minutes.is_empty() {
        true => vec![1.0, 3.0, 10.0],
        false => minutes,
    };
    let folder = PathBuf::from(root).join("fight");
    let mut set = read_clips(&[folder], None, &ReadOptions::default()).unwrap();
    set.add_mirrored().unwrap();
    let library = Library {
        skeleton: &set.skeleton,
        clips: &set.clips,
        turn: TURN.to_radians(),
    };
    println!(
        "| minutes | clips | pairs | distances | pairs per distance | 1 thread, s | 2 threads, s | growth | all pairs, s | memory, MB |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    let mut before = None;
    for minutes in minutes {
        let clips = library.of(60.0 * minutes);
        let source = ClipSource {
            skeleton: &set.skeleton,
            clips: &clips,
            events: &[],
        };
        let (mut seconds, mut distances, mut pairs) = (Vec::new(), 0, 0);
        for threads in [1, 2] {
            let settings = GraphSettings {
                threads,
                ..GraphSettings::default()
            };
            let builder = GraphBuilder::new(source, &settings).unwrap();
            pairs = builder.bands().map(|band| band.pairs()).sum::<u64>();
            let windows = windows(&builder);
            let started = Instant::now();
            distances = search(&builder, (&windows, threads));
            seconds.push(started.elapsed().as_secs_f64());
        }
        let growth = before.map_or(String::new(), |(m, s): (f64, f64)| {
            format!("n^{:.2}", (seconds[0] / s).ln() / (minutes / m).ln())
        });
        before = Some((minutes, seconds[0]));
        let all = match minutes <= ALL_PAIRS {
            true => format!(
                "{:.2}",
                all_pairs(&GraphBuilder::new(source, &GraphSettings::default()).unwrap())
            ),
            false => String::new(),
        };
        println!(
            "| {minutes} | {} | {pairs} | {distances} | {:.0} | {:.2} | {:.2} | {growth} | {all} | {:.0} |",
            clips.len(),
            pairs as f64 / distances.max(1) as f64,
            seconds[0],
            seconds[1],
            peak_memory()
        );
    }
}

fn windows(builder: &GraphBuilder<'_>) -> Vec<Windows> {
    let clouds = builder.clouds().iter();
    clouds
        .map(|cloud| Windows::new(cloud, builder.search().window))
        .collect()
}

/// Searches all bands, and returns the number of distances that were computed.
fn search(builder: &GraphBuilder<'_>, (windows, threads): (&[Windows], usize)) -> u64 {
    let search = PrunedSearch::new(builder.search(), windows.iter().collect(), threads);
    let jobs: Vec<_> = BandJobs::new(builder.bands()).collect();
    let found = search.minima_of_jobs(&jobs, threads).unwrap();
    found.iter().map(|band| band.computed).sum()
}

/// Seconds that the distances of all pairs take on one thread.
fn all_pairs(builder: &GraphBuilder<'_>) -> f64 {
    let windows = windows(builder);
    let started = Instant::now();
    for (index, a) in windows.iter().enumerate() {
        for b in &windows[index..] {
            DistanceMap::new(a, b).for_each_row(|_, row| {
                std::hint::black_box(row);
            });
        }
    }
    started.elapsed().as_secs_f64()
}

/// Largest memory of this process so far, in megabytes; 0 where the system does not tell.
fn peak_memory() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<f64>().ok());
    kilobytes.map_or(0.0, |kilobytes| kilobytes / 1024.0)
}
