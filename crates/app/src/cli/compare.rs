//! `sabaki compare`: the paper's Table 1, measured here.
//!
//! Source: Masaoka & Oshita, section 6, Table 1; their culling leaves 70 of about 100 candidates. Differs: the exact test classifies
//! every candidate as hit or clean, so wrong removals are counted too.

use std::path::PathBuf;
use std::time::Instant;

use rustc_hash::{FxHashMap, FxHashSet};
use sabaki::maps::{BakedGraph, PathId};
use sabaki::query::cull::{CullCandidate, CullInput};
use sabaki::query::{Answer, CullPath, Enumerate, Query, QueryContext, QuerySettings, Source};
use sabaki_app::percentile::percentile;
use sabaki_fixtures::throw::Throw;
use serde::Serialize;
use serde_json::{Value, json};

use super::bake::{self, GraphArgs};
use super::culling::{self, Culling, DeviceArgs};
use super::numbers::whole;
use super::plot::{Chart, write_figure};
use super::queries::{CountedOne, Method, QueryRunner, Run, Times, random_throws};
use super::{Done, Failure, cancel, output};

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    graph: GraphArgs,
    /// Number of random attacks.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = whole::<u64>(1..=1_000_000))]
    attacks: u64,
    /// Seed of the random attacks.
    #[arg(long, value_name = "S", default_value_t = 1, value_parser = whole::<u64>(0..=u64::MAX))]
    seed: u64,
    /// Also measures the time to cull 5 to 10,000 candidates, and draws it (.png).
    #[arg(long, value_name = "FILE", value_parser = output::png_file())]
    plot: Option<PathBuf>,
    #[command(flatten)]
    device: DeviceArgs,
}

/// One line of the table.
struct Row {
    method: Method,
    runs: Vec<Run>,
    tally: MapTally,
    hit_though_avoidable: usize,
}

/// The measurements.
struct Table {
    rows: Vec<Row>,
}

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    cancel::listen();
    let baked = args.graph.load()?;
    let throws = random_throws(&baked, args.seed, 0..args.attacks)?;
    let mut culling = Culling::new(culling::open(&args.device)?, baked.atlas());
    let table = measure(&baked, &throws, &mut culling)?;
    let mut lines = Vec::new();
    if let Some(path) = &args.plot {
        lines = crossover(&baked, &throws, &mut culling)?;
        let chart = Chart {
            title: "Time to cull, by the number of candidates",
            x: "candidates",
            y: "ms",
            log: true,
            lines: lines
                .iter()
                .map(|(path, points)| (path.name(), points.clone()))
                .collect(),
        };
        write_figure(path, [900, 640], |area| chart.draw(area))?;
    }
    if as_json {
        let mut document = table.to_json();
        document["device"] = json!(culling.device_name());
        document["graph"] = bake::statistics(&baked);
        if args.plot.is_some() {
            document["crossover"] = crossover_json(&lines);
        }
        return Ok(Done::ok(Done::json(&document)));
    }
    let crossover = match args.plot {
        Some(_) => crossover_text(&lines),
        None => String::new(),
    };
    Ok(Done::ok(format!(
        "{}{}\n\n{}{crossover}",
        bake::headline(&baked),
        culling.describe(culling.paths()),
        table.text(throws.len())
    )))
}

/// All methods, attack by attack, so that system noise affects every method equally.
fn measure(baked: &BakedGraph, throws: &[Throw], culling: &mut Culling) -> Result<Table, Failure> {
    let grids = [Enumerate::Whole, Enumerate::default()];
    let paths = culling.paths();
    let methods = paths
        .iter()
        .flat_map(|&cull| grids.map(|enumerate| Method { cull, enumerate }));
    let mut rows: Vec<Row> = methods.map(Row::new).collect();
    let mut runners: Vec<QueryRunner<'_>> = rows.iter().map(|_| QueryRunner::new(baked)).collect();
    let bar = output::progress("comparing", throws.len() as u64);
    // The first attack twice: memory is filled when times begin to count.
    for (count, throw) in throws[..1].iter().chain(throws).enumerate() {
        cancel::check()?;
        let mut runs = Vec::new();
        for (row, runner) in rows.iter().zip(&mut runners) {
            runner.records_rounds = true;
            let settings = row.method.settings();
            runs.push(runner.ask(&settings, throw, culling.on(row.method.cull))?);
        }
        if count == 0 {
            continue;
        }
        // The first two are exact, without and with the grid.
        let answered = |index: usize| (&runners[index].answer, runners[index].rounds.as_slice());
        let truth = GroundTruth::new([answered(0), answered(1)]);
        for ((row, runner), run) in rows.iter_mut().zip(&runners).zip(&runs) {
            truth.compare(&runner.rounds, &mut row.tally);
            row.hit_though_avoidable += usize::from(!run.avoided && runs[0].avoided);
            row.runs.push(run.clone());
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(Table { rows })
}

impl Row {
    fn new(method: Method) -> Self {
        Self {
            method,
            runs: Vec::new(),
            tally: MapTally::default(),
            hit_though_avoidable: 0,
        }
    }

    /// The candidates that the maps keep; for the exact test, those that are not hit.
    fn tally(&self) -> MapTally {
        match self.method.cull {
            CullPath::Exact => MapTally {
                hits_kept: 0,
                clean_removed: 0,
                undecided: 0,
                ..self.tally
            },
            _ => self.tally,
        }
    }

    fn avoided(&self) -> usize {
        self.runs.iter().filter(|run| run.avoided).count()
    }

    fn per_attack(&self, count: usize) -> f64 {
        count as f64 / self.runs.len().max(1) as f64
    }

    fn to_json(&self) -> Value {
        let tally = self.tally();
        json!({
            "cull": self.method.cull.name(),
            "grid": self.method.grid_name(),
            "attacks": self.runs.len(),
            "candidates": self.per_attack(tally.candidates()),
            "kept": self.per_attack(tally.kept()),
            "weak": tally.weak(),
            "wrong": tally.wrong(),
            "undecided": tally.undecided_share(),
            "tally": tally,
            "avoided": self.avoided(),
            "hit_though_avoidable": self.hit_though_avoidable,
            "query_ms": Times::new(&self.runs, Run::query_ms).to_json(),
            "cull_ms": Times::new(&self.runs, |run| run.cull_ms).to_json(),
        })
    }

    fn cells(&self) -> [String; 9] {
        let tally = self.tally();
        let percent = |share: f64| format!("{:.1}%", 100.0 * share);
        [
            self.method.cull.name().to_owned(),
            self.method.grid_name().to_owned(),
            format!("{:.1}", self.per_attack(tally.candidates())),
            format!("{:.1}", self.per_attack(tally.kept())),
            percent(tally.weak()),
            percent(tally.wrong()),
            percent(tally.undecided_share()),
            Times::new(&self.runs, Run::query_ms).text(2),
            Times::new(&self.runs, |run| run.cull_ms).text(3),
        ]
    }
}

/// The figures of the paper's Table 1.
const PAPER: &str = "\
The paper, on its machine: without the grid 496 ms exact, 225 ms stencil, about 100 candidates
culled to 70; with it 18 and 14 ms, about 5 candidates culled to 3. It used the grid in about 90%
of the attacks.
";

impl Table {
    /// Number of attacks for which the grid has paths, and number of attacks that one of these paths answers.
    fn grid(&self) -> [usize; 2] {
        // The row of the exact test with the grid.
        let runs = &self.rows[1].runs;
        let used = runs.iter().filter(|run| run.used_grid()).count();
        let answered = runs.iter().filter(|run| run.source == Source::Grid).count();
        [used, answered]
    }

    fn to_json(&self) -> Value {
        let [used, answered] = self.grid();
        json!({
            "rows": self.rows.iter().map(Row::to_json).collect::<Vec<_>>(),
            "grid_used": used,
            "grid_answered": answered,
        })
    }

    fn text(&self, attacks: usize) -> String {
        let head = [
            "culled by",
            "grid",
            "candidates",
            "kept",
            "weak",
            "wrong",
            "open",
            "query ms",
            "culling ms",
        ];
        let mut table = output::table(&head, 2);
        for row in &self.rows {
            table.add_row(row.cells());
        }
        let [used, answered] = self.grid();
        let percent = |count: usize| 100.0 * count as f64 / attacks.max(1) as f64;
        let avoided: Vec<usize> = self.rows.iter().map(Row::avoided).collect();
        let least = avoided.iter().copied().min().unwrap_or(0);
        let missed: usize = self.rows.iter().map(|row| row.hit_though_avoidable).sum();
        format!(
            "{attacks} attacks, each answered by all methods; each avoids {:.1}% or more,\n\
             and {missed} hits could have been avoided.\n\
             {table}\n\
             candidates: with maps, per query (those that enter or layer an evasion have none).\n\
             kept: by the maps; by the exact test for exact. weak: share of the hits that the maps keep.\n\
             wrong: share of the clean candidates that they remove. open: share that they neither remove\n\
             nor prove clean. Times: median / 99th percentile.\n\n\
             The grid has paths for {:.0}% of the attacks and answers {:.0}%.\n\n{PAPER}",
            percent(least),
            percent(used),
            percent(answered),
        )
    }
}

/// Numbers of candidates that are culled.
const SIZES: [usize; 11] = [5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000];
/// Largest number of repetitions, and the seconds after which none is added. The median counts.
const REPEATS: usize = 5;
const PATIENCE: f64 = 0.3;

/// Times of one path: numbers of candidates, and milliseconds.
type Line = (CullPath, Vec<(f64, f64)>);

/// Times all culling paths that this machine supports on the candidates of the query that has most, again and again where there are
/// not as many. `benches/cull.rs` measures more.
fn crossover(
    baked: &BakedGraph,
    throws: &[Throw],
    culling: &mut Culling,
) -> Result<Vec<Line>, Failure> {
    let settings = QuerySettings::default();
    let query = Query::new(baked, &settings);
    let mut context = QueryContext::default();
    let mut count = |throw: &Throw| {
        let session = query.start(throw.request(), &mut context);
        session.cull_input().candidates.len()
    };
    let busiest = throws.iter().map(&mut count).enumerate();
    let busiest = busiest.max_by_key(|&(_, count)| count);
    let Some((busiest, 1..)) = busiest else {
        return Ok(Vec::new());
    };
    let session = query.start(throws[busiest].request(), &mut context);
    let input = session.cull_input();
    let mut paths = culling.paths();
    paths.retain(|&path| path != CullPath::Exact);
    let mut lines: Vec<Line> = paths.iter().map(|&path| (path, Vec::new())).collect();
    for size in SIZES {
        let all = input.candidates.iter().copied().cycle();
        let candidates: Vec<CullCandidate> = all.take(size).collect();
        let input = CullInput {
            candidates: &candidates,
            ..input
        };
        for (path, points) in &mut lines {
            points.push((size as f64, time(*path, &input, culling)?));
        }
    }
    Ok(lines)
}

/// Median milliseconds to count the overlaps of candidates. The first run is a warm-up.
fn time(path: CullPath, input: &CullInput<'_>, culling: &mut Culling) -> Result<f64, Failure> {
    let (begun, mut times, mut overlaps) = (Instant::now(), Vec::new(), Vec::new());
    for repeat in 0..=REPEATS {
        cancel::check()?;
        let started = Instant::now();
        culling.on(path).count(input, &mut overlaps)?;
        if repeat > 0 {
            times.push(started.elapsed().as_secs_f64() * 1e3);
        }
        if !times.is_empty() && begun.elapsed().as_secs_f64() > PATIENCE {
            break;
        }
    }
    Ok(percentile(times, 0.5))
}

fn crossover_json(lines: &[Line]) -> Value {
    let point = |&(size, ms): &(f64, f64)| json!({ "candidates": size as usize, "ms": ms });
    let line = |(path, points): &Line| {
        let points: Vec<Value> = points.iter().map(point).collect();
        json!({ "cull": path.name(), "points": points })
    };
    lines.iter().map(line).collect()
}

fn crossover_text(lines: &[Line]) -> String {
    let names = lines.iter().map(|(path, _)| path.name());
    let head: Vec<&str> = std::iter::once("candidates").chain(names).collect();
    let mut table = output::table(&head, 0);
    for (index, size) in SIZES.iter().enumerate() {
        let times = lines
            .iter()
            .map(|(_, points)| format!("{:.4}", points[index].1));
        table.add_row(std::iter::once(size.to_string()).chain(times));
    }
    let mut text = format!(
        "\nMilliseconds to cull, by the number of candidates, from the upload to the counts:\n{table}\n"
    );
    let cpu = lines.iter().find(|(path, _)| *path == CullPath::Cpu);
    let devices = lines.iter().filter(|(path, _)| path.needs_device());
    for (path, points) in devices {
        let pairs = cpu.iter().flat_map(|(_, cpu)| cpu.iter().zip(points));
        let mut slower = pairs.filter(|(cpu, device)| device.1 >= cpu.1);
        let name = path.name();
        text += &match slower.next_back().map(|(cpu, _)| cpu.0 as usize) {
            None => format!(
                "{name} is faster than cpu from {} candidates on.\n",
                SIZES[0]
            ),
            Some(last) if last == SIZES[SIZES.len() - 1] => {
                format!("{name} is not faster than cpu for up to {last} candidates.\n")
            }
            Some(last) => format!("{name} is faster than cpu from above {last} candidates on.\n"),
        };
    }
    text
}

/// The exact results of one query: which candidates are hit.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct GroundTruth {
    /// Whether each path is hit.
    hits: FxHashMap<PathId, bool>,
}

impl GroundTruth {
    /// From answers to one query by [`Evaluation::Exhaustive`](sabaki::query::Evaluation::Exhaustive), each with its rounds: one answer from
    /// all paths, and one from the grid.
    #[must_use]
    pub(crate) fn new<'r>(
        answers: impl IntoIterator<Item = (&'r Answer, &'r [Vec<CountedOne>])>,
    ) -> Self {
        let mut hits = FxHashMap::default();
        for (answer, rounds) in answers {
            if answer.source == Source::NothingClean {
                // The first round ended because all its candidates are hit.
                let first = rounds.first().into_iter().flatten();
                hits.extend(first.map(|one| (one.path, true)));
            }
            let tested = answer.paths().filter_map(|(path, report)| {
                let clearance = report.clearance?;
                // What had to be bent was hit.
                Some((path, report.warp.is_some() || !clearance.is_clean()))
            });
            hits.extend(tested);
        }
        Self { hits }
    }

    /// Compares the rounds of another answer to the same query, and adds the results to `tally`. A candidate of both rounds is added
    /// once.
    pub(crate) fn compare(&self, rounds: &[Vec<CountedOne>], tally: &mut MapTally) {
        let mut seen = FxHashSet::default();
        let counted = rounds.iter().flatten();
        for one in counted.filter(|one| seen.insert(one.path)) {
            if let Some(&is_hit) = self.hits.get(&one.path) {
                tally.add(one, is_hit);
            }
        }
    }
}

/// Numbers of candidates by the results of maps and exact test.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct MapTally {
    /// Candidates that are hit.
    pub(crate) hits: usize,
    /// Hit candidates that the maps keep.
    pub(crate) hits_kept: usize,
    /// Candidates that are clean.
    pub(crate) clean: usize,
    /// Clean candidates that the maps remove.
    pub(crate) clean_removed: usize,
    /// Candidates that the maps neither remove nor prove clean.
    pub(crate) undecided: usize,
    /// Hit candidates that the maps prove clean: a fault, unless the maps are not certain.
    pub(crate) hits_proven_clean: usize,
}

impl MapTally {
    /// Adds a candidate.
    fn add(&mut self, one: &CountedOne, is_hit: bool) {
        let is_removed = one.overlap.body > 0;
        let is_proven = one.overlap.outer == 0 && !one.is_open;
        if is_hit {
            self.hits += 1;
            self.hits_kept += usize::from(!is_removed);
            self.hits_proven_clean += usize::from(is_proven);
        } else {
            self.clean += 1;
            self.clean_removed += usize::from(is_removed);
        }
        self.undecided += usize::from(!is_removed && !is_proven);
    }

    /// Number of candidates that were added.
    #[must_use]
    pub(crate) fn candidates(&self) -> usize {
        self.hits + self.clean
    }

    /// Number of candidates that the maps keep.
    #[must_use]
    pub(crate) fn kept(&self) -> usize {
        self.hits_kept + self.clean - self.clean_removed
    }

    /// Share of the hit candidates that the maps keep; 0 if there are none.
    #[must_use]
    pub(crate) fn weak(&self) -> f64 {
        share(self.hits_kept, self.hits)
    }

    /// Share of the clean candidates that the maps remove; 0 if there are none.
    #[must_use]
    pub(crate) fn wrong(&self) -> f64 {
        share(self.clean_removed, self.clean)
    }

    /// Share of all candidates that only the exact test decides; 0 if there are none.
    #[must_use]
    pub(crate) fn undecided_share(&self) -> f64 {
        share(self.undecided, self.candidates())
    }
}

fn share(part: usize, whole: usize) -> f64 {
    if whole == 0 {
        return 0.0;
    }
    part as f64 / whole as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use sabaki::query::cull::Overlap;

    #[test]
    fn each_candidate_is_counted_by_both_results() {
        let counted = |body, outer, is_open| CountedOne {
            path: PathId(0),
            overlap: Overlap {
                body,
                outer,
                evasion: 0,
            },
            is_open,
        };
        let mut tally = MapTally::default();
        tally.add(&counted(3, 5, false), true);
        tally.add(&counted(0, 5, false), true);
        tally.add(&counted(0, 0, false), false);
        tally.add(&counted(0, 0, true), false);
        tally.add(&counted(1, 1, false), false);
        assert_eq!((tally.candidates(), tally.kept()), (5, 3));
        assert_eq!((tally.weak(), tally.wrong()), (0.5, 1.0 / 3.0));
        assert_eq!(tally.undecided, 2);
        assert_eq!(tally.hits_proven_clean, 0);
        assert_eq!(MapTally::default().weak(), 0.0);
    }
}
