//! Bakes of libraries of growing length, stage by stage, in minutes of motion: `cargo bench --bench library -- 10 60 600`.
//!
//! No library of hours is at hand: these are made of the clips in `SABAKI_MOCAP/fight` and their mirror images, by cutting, by
//! changes of speed, and by turning each joint about a random axis, in each pass over the clips by other angles of 12° in the mean
//! square. The turns stand for other people and other moods: without them a library would repeat the same minutes, and the
//! transitions would grow with the square of its length.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use glam::{Quat, Vec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;
use sabaki::anim::{Clip, ClipDesc, Event, EventKind};
use sabaki::archive;
use sabaki::character::{CharacterSettings, Characters};
use sabaki::graph::{self, ClipSource, GraphSettings};
use sabaki::maps::{BakeSettings, BakedGraph, Baker};
use sabaki::query::cull::cpu;
use sabaki::query::{Answer, Query, QueryContext, QuerySettings};
use sabaki_fixtures::captures::captures;
use sabaki_fixtures::memory::status;
use sabaki_fixtures::spans::Spans;
use sabaki_fixtures::throw::throws;
use sabaki_import::ClipSet;

/// Standard deviation of the joints' turns, in degrees.
const TURN: f32 = 12.0;

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
    let bakes = bakes(&set, &minutes);
    println!();
    print_growth(&bakes);
}

/// A library that is made of the clips of a set by cutting, by changes of their speed and by turning joints.
#[derive(Default)]
struct MadeClips {
    clips: Vec<Clip>,
    events: Vec<Event>,
}

/// A part of a clip, played at another rate.
struct Cut {
    first: usize,
    frames: usize,
    rate: f64,
}

/// Clips of `seconds` at 30 Hz. A longer library begins with the clips of a shorter one. Joints are turned by angles that are drawn
/// once for each pass over the clips, as another person holds another posture. The first pass is not turned.
fn made_library(set: &ClipSet, seconds: f64) -> MadeClips {
    let mut random = Pcg32::seed_from_u64(1);
    let (mut made, mut total) = (MadeClips::default(), 0.0);
    for pass in 0.. {
        let turns: Vec<Quat> = (0..set.skeleton.len())
            .map(|joint| match (pass, joint) {
                (0, _) | (_, 0) => Quat::IDENTITY,
                _ => Quat::from_scaled_axis(TURN.to_radians() * normal(&mut random)),
            })
            .collect();
        for (index, clip) in set.clips.iter().enumerate() {
            if total >= seconds {
                return made;
            }
            let share = random.random_range(0.6..1.0f32);
            let frames = ((clip.frames() as f32 * share) as usize).max(1);
            let cut = Cut {
                first: random.random_range(0..=clip.frames() - frames),
                frames,
                rate: f64::from(random.random_range(0.8..1.25f32)),
            };
            let desc = ClipDesc {
                name: format!("{pass} {}", clip.name()),
                ..changed(clip, &cut, &turns)
            };
            let clip = Clip::new(&set.skeleton, desc).unwrap();
            let clip = clip.resampled(30.0).unwrap();
            total += clip.duration();
            add_events(set, index, &cut, &mut made);
            made.clips.push(clip);
        }
    }
    made
}

/// Adds the events of a clip that lie within a cut of it, for the next clip of `made`.
fn add_events(set: &ClipSet, clip: usize, cut: &Cut, made: &mut MadeClips) {
    let frame_rate = set.clips[clip].frame_rate();
    let moved = |seconds: f64| (seconds - cut.first as f64 / frame_rate) / cut.rate;
    let end = (cut.frames - 1) as f64 / frame_rate / cut.rate;
    let evasion = |event: &&Event| event.kind == EventKind::Evasion;
    for event in set.events.iter().filter(|event| event.clip == clip) {
        let own = Event {
            clip: made.clips.len(),
            start: moved(event.start),
            end: moved(event.end),
            ..event.clone()
        };
        let is_full = evasion(&&own) && made.events.iter().filter(evasion).count() >= EVASIONS;
        if own.start >= 0.0 && own.end <= end && !is_full {
            made.events.push(own);
        }
    }
}

fn changed(clip: &Clip, cut: &Cut, turns: &[Quat]) -> ClipDesc {
    let (joints, desc) = (turns.len(), clip.desc());
    let frames = cut.first..cut.first + cut.frames;
    let entries = frames.start * joints..frames.end * joints;
    let turned = desc.rotations[entries.clone()].iter().enumerate();
    ClipDesc {
        name: String::new(),
        frame_rate: desc.frame_rate * cut.rate,
        roots: desc.roots[frames].to_vec(),
        rotations: turned
            .map(|(index, rotation)| (*rotation * turns[index % joints]).normalize())
            .collect(),
        translations: desc.translations.get(entries).unwrap_or(&[]).to_vec(),
    }
}

/// Three numbers of about a normal distribution: sums of twelve uniform ones.
fn normal(random: &mut Pcg32) -> Vec3 {
    let mut one = || (0..12).map(|_| random.random_range(-0.5..0.5f32)).sum();
    Vec3::new(one(), one(), one())
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
    let spans = Spans::default();
    tracing::subscriber::set_global_default(spans.clone()).unwrap();
    let path = std::env::temp_dir().join(format!("library-{}.sabaki", std::process::id()));
    let one = minutes.iter().map(|&minutes| {
        let made = made_library(set, 60.0 * minutes);
        println!("\n{minutes} minutes, {} clips:", made.clips.len());
        let bake = whole_bake(set, &made, &path, &spans);
        println!("peak memory: {:.0} MB", bake[2]);
        bake
    });
    let bakes = one.collect();
    let _ = std::fs::remove_file(path);
    bakes
}

fn whole_bake(set: &ClipSet, made: &MadeClips, path: &Path, spans: &Spans) -> Bake {
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
    let (graph, report) = graph::build(source, &settings).unwrap();
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
    print_stages(spans);
    let started = Instant::now();
    let baked = archive::read(path).unwrap();
    let load = started.elapsed().as_secs_f64();
    println!("loaded in {load:.2} s");
    print_stages(spans);
    queries(&baked);
    let started = Instant::now();
    let _ = Characters::new(Arc::new(baked), CharacterSettings::default()).unwrap();
    println!("steering table in {:.2} s", started.elapsed().as_secs_f64());
    let minutes = made.clips.iter().map(Clip::duration).sum::<f64>() / 60.0;
    [
        minutes,
        seconds,
        1e-6 * status("VmHWM:"),
        bytes as f64 / 1e6,
        load,
    ]
}

fn print_stages(spans: &Spans) {
    for (name, seconds) in spans.take() {
        println!("  {name}: {seconds:.2} s");
    }
}

fn queries(baked: &BakedGraph) {
    let throws: Vec<_> = throws(baked, 5, QUERIES).collect();
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
