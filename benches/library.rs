//! The search for transitions in libraries of growing length, and with `bake` whole bakes of them, stage by stage:
//! `cargo bench --bench library -- 10 60 600`, `cargo bench --bench library -- bake 10 60` (minutes). `cargo bench --bench library -- files=DIR 60` writes the clips and the events to files, for the
//! command's bakes.
//!
//! No library of hours is at hand: these are made of the clips in `SABAKI_MOCAP/fight` and their mirror images, by cutting, by
//! changes of speed, and by turning each joint about a random axis, in each pass over the clips by other angles of 12° in the mean
//! square. The turns stand for other people and other moods: without them a library would repeat the same minutes, and the
//! transitions would grow with the square of its length.
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "common/library.rs"]
mod library;
#[path = "common/stages.rs"]
mod stages;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use library::{Library, MadeClips};
use sabaki::anim::{Clip, ClipDesc};
use sabaki::archive;
use sabaki::character::{CharacterSettings, Characters};
use sabaki::graph::search::{BandMinima, DistanceMap, PrunedSearch, Windows};
use sabaki::graph::{ClipSource, GraphSettings};
use sabaki::graph::{GraphBuilder, Unwatched};
use sabaki::maps::{BakeSettings, BakedGraph, Baker};
use sabaki::query::cull::cpu;
use sabaki::query::{Answer, Query, QueryContext, QuerySettings};
use sabaki_fixtures::captures::captures;
use sabaki_fixtures::throw::{ThrowSettings, throw};
use sabaki_import::{ClipSet, EventsFile, bvh};
use stages::StageClock;

/// Standard deviation of the joints' turns, in degrees.
const TURN: f32 = 12.0;

/// Length up to which all pairs are measured too, in minutes.
const ALL_PAIRS: f64 = 20.0;

/// Maximum number of evasions of a library.
const EVASIONS: usize = 500;

/// Memory that a bake may take, in bytes: enough for 10 hours.
const MEMORY: u64 = 20 << 30;

/// Number of queries that are measured.
const QUERIES: u64 = 400;

fn main() {
    let minutes: Vec<f64> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let minutes = match minutes.is_empty() {
        true => vec![1.0, 3.0, 10.0],
        false => minutes,
    };
    let mut set = captures("fight");
    set.add_mirrored().unwrap();
    let asked = |word: &str| std::env::args().any(|arg| arg == word);
    let after =
        |name: &str| std::env::args().find_map(|arg| arg.strip_prefix(name).map(PathBuf::from));
    if let Some(folder) = after("files=") {
        minutes
            .iter()
            .for_each(|&minutes| files(&set, minutes, &folder));
        return;
    }
    match asked("bake") {
        true => {
            let bakes = bakes(&set, &minutes);
            println!();
            print_growth(&bakes);
        }
        false => searches(&set, &minutes),
    }
}

/// The library that the clips of a set make.
fn library(set: &ClipSet) -> Library<'_> {
    Library {
        skeleton: &set.skeleton,
        clips: &set.clips,
        events: &set.events,
        turn: TURN.to_radians(),
        evasions: EVASIONS,
    }
}

/// Writes a library as BVH files in `FOLDER/MINUTES/clips`, and its events as `FOLDER/MINUTES/events.json`.
fn files(set: &ClipSet, minutes: f64, folder: &Path) {
    const METRES_PER_UNIT: f64 = 0.01;
    let made = library(set).of(60.0 * minutes);
    let folder = folder.join(minutes.to_string());
    std::fs::create_dir_all(folder.join("clips")).unwrap();
    let named = |(index, clip): (usize, &Clip)| {
        let desc = ClipDesc {
            name: format!("{index:05}.bvh"),
            ..clip.desc()
        };
        Clip::new(&set.skeleton, desc).unwrap()
    };
    let named: Vec<Clip> = made.clips.iter().enumerate().map(named).collect();
    for clip in &named {
        let file = std::fs::File::create(folder.join("clips").join(clip.name())).unwrap();
        let mut file = std::io::BufWriter::new(file);
        bvh::write(&mut file, &set.skeleton, clip, METRES_PER_UNIT).unwrap();
    }
    let events = EventsFile::of(&made.events, &named, &set.skeleton).unwrap();
    let text = serde_json::to_string(&events).unwrap();
    std::fs::write(folder.join("events.json"), text).unwrap();
    println!("{}: {} clips", folder.display(), named.len());
}

/// What the bake of one library took: minutes of the library, seconds from clips in memory to the written file, megabytes of the
/// process at most and of the file, and seconds to load the file.
type Bake = [f64; 5];

/// Prints the exponents with which each quantity grows from bake to bake.
fn print_growth(bakes: &[Bake]) {
    for (index, name) in (1..).zip(["seconds", "memory", "file", "load"]) {
        let exponents = bakes.windows(2).map(|pair| {
            let ratio = |index: usize| (pair[1][index] / pair[0][index]).ln();
            format!("n^{:.2}", ratio(index) / ratio(0))
        });
        println!(
            "growth of {name}: {}",
            exponents.collect::<Vec<_>>().join(", ")
        );
    }
}

/// Prints and returns what whole bakes take.
fn bakes(set: &ClipSet, minutes: &[f64]) -> Vec<Bake> {
    StageClock::install();
    let path = std::env::temp_dir().join(format!("library-{}.sabaki", std::process::id()));
    let one = minutes.iter().map(|&minutes| {
        let made = library(set).of(60.0 * minutes);
        println!("\n{minutes} minutes, {} clips:", made.clips.len());
        let bake = whole_bake(set, &made, &path);
        println!("peak memory: {:.0} MB", bake[2]);
        bake
    });
    let bakes = one.collect();
    let _ = std::fs::remove_file(path);
    bakes
}

fn whole_bake(set: &ClipSet, made: &MadeClips, path: &Path) -> Bake {
    let source = ClipSource {
        skeleton: &set.skeleton,
        clips: &made.clips,
        events: &made.events,
    };
    let settings = GraphSettings {
        memory: MEMORY,
        ..GraphSettings::default()
    };
    let started = Instant::now();
    let stage = |name: &str| println!("{name}: at {:.2} s", started.elapsed().as_secs_f64());
    let builder = GraphBuilder::new(source, &settings).unwrap();
    stage("clips resampled");
    let found = builder.find_transitions().unwrap();
    stage("transitions found");
    let (graph, report) = builder.build(found).unwrap();
    stage("graph built");
    println!(
        "{} pairs, {} nodes, {} edges, {} of them transitions",
        report.window_pairs,
        graph.nodes().len(),
        graph.edges().len(),
        graph.transitions()
    );
    let baker = Baker::new(graph, BakeSettings::default()).unwrap();
    let baked = baker.finish_on_cpu().unwrap();
    stage("baked");
    archive::write(path, &baked).unwrap();
    stage("written");
    let seconds = started.elapsed().as_secs_f64();
    let bytes = std::fs::metadata(path).unwrap().len();
    println!(
        "file {bytes} bytes, {} evasions, {} paths",
        baked.evasions().len(),
        baked.paths().report().kept
    );
    drop(baked);
    print_stages();
    let started = Instant::now();
    let baked = archive::read(path).unwrap();
    let load = started.elapsed().as_secs_f64();
    println!("loaded in {load:.2} s");
    print_stages();
    queries(&baked);
    let started = Instant::now();
    let _ = Characters::new(Arc::new(baked), CharacterSettings::default()).unwrap();
    println!("steering table in {:.2} s", started.elapsed().as_secs_f64());
    let minutes = made.clips.iter().map(Clip::duration).sum::<f64>() / 60.0;
    [minutes, seconds, peak_memory(), bytes as f64 / 1e6, load]
}

fn print_stages() {
    for (name, seconds) in StageClock::take() {
        println!("  {name}: {seconds:.2} s");
    }
}

fn queries(baked: &BakedGraph) {
    let throws = (0..QUERIES).map(|index| throw(baked, &ThrowSettings::default(), 5, index));
    let throws: Vec<_> = throws.map(Result::unwrap).collect();
    let settings = QuerySettings::default();
    let query = Query::new(baked, &settings);
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    let mut culler = cpu::Culler::default();
    let mut avoided = 0;
    let mut ask = || {
        avoided = 0;
        let one = throws.iter().map(|throw| {
            let started = Instant::now();
            let mut session = query.start(throw.request(), &mut context);
            session.run_on_cpu(&mut culler, &mut answer);
            avoided += usize::from(answer.avoided);
            1e3 * started.elapsed().as_secs_f64()
        });
        let mut times: Vec<f64> = one.collect();
        times.sort_by(f64::total_cmp);
        times
    };
    ask();
    let times = ask();
    println!(
        "query: {:.3} ms in the median, {:.3} ms in 99%; {avoided} of {QUERIES} attacks avoided",
        times[times.len() / 2],
        times[times.len() * 99 / 100]
    );
}

/// Prints what the search for transitions takes.
fn searches(set: &ClipSet, minutes: &[f64]) {
    println!(
        "| minutes | clips | pairs | distances | pairs per distance | 1 thread, s | 2 threads, s | growth | all pairs, s | memory, MB |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    let mut before = None;
    for &minutes in minutes {
        let MadeClips { clips, .. } = library(set).of(60.0 * minutes);
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
            distances = search(&builder, &windows, threads);
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
fn search(builder: &GraphBuilder<'_>, windows: &[Windows], threads: usize) -> u64 {
    let search = PrunedSearch::new(builder.search(), windows.iter().collect(), threads);
    let mut computed = 0;
    let take = |_, found: BandMinima| {
        computed += found.computed;
        Ok(())
    };
    let bands = builder.bands();
    search.search(bands, threads, &Unwatched, take).unwrap();
    computed
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
