//! `sabaki compare --settings`: what settings of the maps are worth.

use std::convert::Infallible;
use std::time::Instant;

use super::map_quality::{GroundTruth, MapTally, Round};
use sabaki::internal::Section;
use sabaki::maps::{BakedGraph, MapGrid};
use sabaki::query::cull::cpu;
use sabaki::query::{Query, QueryContext};
use sabaki_fixtures::throw::Throw;
use serde_json::{Value, json};

use super::culling::Culling;
use super::maps::planes;
use super::passes::Method;
use super::stats::QueryRunner;
use super::{Done, Failure, cancel, output};

/// One setting, measured.
struct Row {
    name: &'static str,
    maps: MapGrid,
    tally: MapTally,
    bytes: usize,
    bake_ms: f64,
    microseconds: f64,
}

/// The paper's maps first; then one thing is changed at a time.
fn settings() -> Vec<(&'static str, MapGrid)> {
    vec![
        ("paper", MapGrid::PAPER),
        ("planes", planes(1, 0.30)),
        ("sliced", planes(8, 0.30)),
        ("sliced", planes(8, 0.05)),
        ("sliced", planes(32, 0.10)),
        ("default", MapGrid::default()),
        ("64 slices", planes(64, 0.05)),
        (
            "fine texels",
            MapGrid {
                texel: 0.01,
                ..planes(32, 0.05)
            },
        ),
        (
            "fine bodies",
            MapGrid {
                texel: 0.01,
                attack_pitch: 2,
                ..planes(32, 0.05)
            },
        ),
        (
            "finer bodies",
            MapGrid {
                texel: 0.0075,
                attack_pitch: 2,
                ..planes(32, 0.05)
            },
        ),
        (
            "both",
            MapGrid {
                texel: 0.0075,
                attack_pitch: 2,
                ..planes(64, 0.05)
            },
        ),
        (
            "finest",
            MapGrid {
                texel: 0.005,
                attack_pitch: 2,
                ..planes(64, 0.05)
            },
        ),
    ]
}

pub(crate) fn run(baked: &BakedGraph, throws: &[Throw], as_json: bool) -> Result<Done, Failure> {
    let settings = settings();
    let bar = output::progress("maps", settings.len() as u64);
    let (mut rows, mut truths) = (Vec::new(), None);
    for (name, maps) in settings {
        cancel::check()?;
        let started = Instant::now();
        let graph = baked.with_maps(maps)?;
        let bake_ms = started.elapsed().as_secs_f64() * 1e3;
        // Who is hit is no matter of maps.
        let truths = match &mut truths {
            Some(truths) => truths,
            none => none.insert(truths_of(&graph, throws)?),
        };
        let (tally, microseconds) = tally(&graph, throws, truths)?;
        rows.push(Row {
            name,
            maps,
            tally,
            bytes: graph.atlas().bytes(),
            bake_ms,
            microseconds,
        });
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(Done::ok(if as_json {
        let rows: Vec<Value> = rows.iter().map(Row::to_json).collect();
        Done::json(&json!({ "attacks": throws.len(), "settings": rows }))
    } else {
        text(&rows, throws.len())
    }))
}

/// For each attack, which candidates of the whole search are hit.
fn truths_of(baked: &BakedGraph, throws: &[Throw]) -> Result<Vec<GroundTruth>, Failure> {
    let mut culling = Culling::without_device(String::new());
    let mut runner = QueryRunner::new(baked);
    runner.watches = true;
    let truth = |throw: &Throw| {
        cancel::check()?;
        let method = Method::EXACT;
        runner.ask(&method.settings(), throw, culling.on(method.cull))?;
        Ok(GroundTruth::new([(
            &runner.answer,
            runner.rounds.as_slice(),
        )]))
    };
    throws.iter().map(truth).collect()
}

/// What the maps say of all candidates, and how long they take for one, microseconds.
fn tally(
    baked: &BakedGraph,
    throws: &[Throw],
    truths: &[GroundTruth],
) -> Result<(MapTally, f64), Failure> {
    let settings = Method::EXACT.settings();
    let query = Query::new(baked, &settings);
    let (mut context, mut culler) = (QueryContext::default(), cpu::Culler::default());
    let (mut tally, mut seconds) = (MapTally::default(), 0.0);
    for (throw, truth) in throws.iter().zip(truths) {
        cancel::check()?;
        let mut session = query.start(throw.request(), &mut context);
        let Ok(()) = session.count(|input, counts| {
            let started = Instant::now();
            culler.count(input, counts);
            seconds += started.elapsed().as_secs_f64();
            Ok::<_, Infallible>(())
        });
        truth.compare(&[Round::new(&session)], &mut tally);
    }
    Ok((tally, seconds * 1e6 / tally.candidates().max(1) as f64))
}

impl Row {
    fn to_json(&self) -> Value {
        json!({
            "name": self.name,
            "maps": self.maps,
            "candidates": self.tally.candidates(),
            "weak": self.tally.weak(),
            "wrong": self.tally.wrong(),
            "undecided": self.tally.undecided_share(),
            "tally": self.tally,
            "map_bytes": self.bytes,
            "bake_ms": self.bake_ms,
            "cull_us_per_candidate": self.microseconds,
        })
    }
}

fn text(rows: &[Row], attacks: usize) -> String {
    let head = [
        "maps",
        "section",
        "slices",
        "slab m",
        "texel cm",
        "attack's cm",
        "weak",
        "wrong",
        "undecided",
        "maps MB",
        "drawn in ms",
        "cpu us a candidate",
    ];
    let mut table = output::table(&head, 2);
    for row in rows {
        let percent = |share: f64| format!("{:.1}%", 100.0 * share);
        let section = match row.maps.section {
            Section::Outline => "outline",
            Section::Plane => "plane",
        };
        table.add_row(vec![
            row.name.to_owned(),
            section.to_owned(),
            row.maps.slices.to_string(),
            format!("{:.2}", row.maps.slab_height),
            format!("{:.2}", 100.0 * row.maps.texel),
            format!("{:.2}", 100.0 * row.maps.for_attacks().texel),
            percent(row.tally.weak()),
            percent(row.tally.wrong()),
            percent(row.tally.undecided_share()),
            format!("{:.2}", row.bytes as f64 * 1e-6),
            format!("{:.0}", row.bake_ms),
            format!("{:.2}", row.microseconds),
        ]);
    }
    let tally = rows.first().map_or(MapTally::default(), |row| row.tally);
    let covered = MapGrid::default().seconds();
    format!(
        "{attacks} attacks, {} candidates of the whole search, {} of them hit:\n{table}\n\
         All slices together cover {covered:.2} s. weak: share of the candidates that hit and are kept. wrong: share of the clean\n\
         candidates that are removed. undecided: share that is neither removed nor proven clean.\n",
        tally.candidates(),
        tally.hits,
    )
}
