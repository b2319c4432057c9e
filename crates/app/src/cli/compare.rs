//! `sabaki compare`: every culling path with every evaluation, on the same attacks.
//!
//! Source: Masaoka & Oshita, section 6, Table 1. Differs: an exhaustive exact test classifies every candidate as hit or clean, so wrong
//! removals are counted too, and each path is compared with the same evaluation without culling.

mod paper;

use std::path::PathBuf;
use std::time::Instant;

use rustc_hash::{FxHashMap, FxHashSet};
use sabaki::maps::{BakedGraph, PathId};
use sabaki::query::cull::{CullCandidate, CullInput};
use sabaki::query::{
    CullPath, Enumerate, Evaluation, Query, QueryContext, QuerySettings, Session, Source,
};
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
    /// Number of random attacks. Default: 200, or 600 with --paper.
    #[arg(long, value_name = "N", value_parser = whole::<u64>(1..=1_000_000))]
    attacks: Option<u64>,
    /// Seed of the random attacks.
    #[arg(long, value_name = "S", default_value_t = 1, value_parser = whole::<u64>(0..=u64::MAX))]
    seed: u64,
    /// Also measures the time to cull 5 to 10,000 candidates, and draws it (.png).
    #[arg(long, value_name = "FILE", value_parser = output::file_to_write(&["png"]))]
    plot: Option<PathBuf>,
    /// Repeats the paper's Table 1 instead: its maps and its settings.
    #[arg(long, conflicts_with = "plot")]
    paper: bool,
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

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    cancel::listen();
    let baked = args.graph.load()?;
    if args.paper {
        return paper::run(
            &baked,
            args.attacks.unwrap_or(600),
            args.seed,
            &args.device,
            as_json,
        );
    }
    let throws = random_throws(&baked, args.seed, 0..args.attacks.unwrap_or(200))?;
    let mut culling = Culling::new(culling::open(&args.device)?, baked.atlas());
    let methods = methods(&compared(&culling));
    let rows = measure(&baked, &throws, methods, Method::settings, &mut culling)?;
    let batches = batches(&baked, &throws, &mut culling)?;
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
        let mut document = to_json(&rows);
        document["device"] = json!(culling.device_name());
        document["graph"] = bake::statistics(&baked);
        document["batches"] = lines_json(&batches, "queries");
        if args.plot.is_some() {
            document["crossover"] = lines_json(&lines, "candidates");
        }
        return Ok(Done::ok(Done::json(&document)));
    }
    let crossover = match args.plot {
        Some(_) => crossover_text(&lines),
        None => String::new(),
    };
    Ok(Done::ok(format!(
        "{}{}\n\n{}\nMilliseconds to cull many queries in one submission, from the upload to the counts:\n{}\n{crossover}",
        bake::headline(&baked),
        culling.describe(compared(&culling)),
        text(&rows, throws.len()),
        lines_table(&batches, "queries"),
    )))
}

/// Each evaluation with each culling path and each source of candidates. The first is the reference.
fn methods(paths: &[CullPath]) -> Vec<Method> {
    let mut methods = Vec::new();
    for is_lazy in [false, true] {
        for &cull in paths {
            let evaluation = if is_lazy {
                Evaluation::Lazy
            } else {
                exhaustive(cull)
            };
            let grids = [Enumerate::Whole, Enumerate::default()];
            methods.extend(grids.map(|enumerate| Method::new(cull, evaluation, enumerate)));
        }
    }
    methods
}

/// The paths that run here, with [`CullPath::None`] as the baseline.
fn compared(culling: &Culling) -> Vec<CullPath> {
    let mut paths = culling.paths();
    paths.retain(|&path| path != CullPath::Exact);
    paths
}

/// Tests over the whole attack every candidate that a path keeps.
fn exhaustive(cull: CullPath) -> Evaluation {
    match cull {
        CullPath::None => Evaluation::Exhaustive,
        _ => Evaluation::Kept,
    }
}

/// All methods, attack by attack, so that system noise affects every method equally. The first method is the reference.
fn measure(
    baked: &BakedGraph,
    throws: &[Throw],
    methods: Vec<Method>,
    settings: impl Fn(Method) -> QuerySettings,
    culling: &mut Culling,
) -> Result<Vec<Row>, Failure> {
    let mut rows: Vec<Row> = methods.into_iter().map(Row::new).collect();
    let mut runners: Vec<QueryRunner<'_>> = rows.iter().map(|_| QueryRunner::new(baked)).collect();
    let bar = output::progress("comparing", throws.len() as u64);
    // The first attack twice: memory is filled when times begin to count.
    for (count, throw) in throws[..1].iter().chain(throws).enumerate() {
        cancel::check()?;
        let mut runs = Vec::new();
        for (row, runner) in rows.iter().zip(&mut runners) {
            runner.records_rounds = true;
            runs.push(runner.ask(row.method, &settings(row.method), throw, culling)?);
        }
        if count == 0 {
            continue;
        }
        let answered = rows.iter().zip(&runners);
        let references =
            answered.filter(|(row, _)| row.method.evaluation == Evaluation::Exhaustive);
        let hits = hits(references.map(|(_, runner)| runner));
        for ((row, runner), run) in rows.iter_mut().zip(&runners).zip(&runs) {
            row.tally.compare(&hits, &runner.rounds);
            row.hit_though_avoidable += usize::from(!run.avoided && runs[0].avoided);
            row.runs.push(run.clone());
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(rows)
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

    fn is_lazy(&self) -> bool {
        self.method.evaluation == Evaluation::Lazy
    }

    fn evaluation_name(&self) -> &'static str {
        if self.is_lazy() { "lazy" } else { "exhaustive" }
    }

    fn per_attack(&self, count: usize) -> f64 {
        count as f64 / self.runs.len().max(1) as f64
    }

    fn avoided(&self) -> usize {
        self.runs.iter().filter(|run| run.avoided).count()
    }

    fn times(&self) -> Times {
        Times::new(&self.runs, Run::query_ms)
    }

    /// Mean milliseconds of the first attacks.
    fn mean_ms(&self, attacks: usize) -> f64 {
        let runs = &self.runs[..attacks.min(self.runs.len())];
        runs.iter().map(Run::query_ms).sum::<f64>() / runs.len().max(1) as f64
    }

    fn to_json(&self, gain: f64) -> Value {
        let tally = self.tally;
        json!({
            "evaluation": self.evaluation_name(),
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
            "query_ms": self.times(),
            "mean_ms": self.mean_ms(self.runs.len()),
            "cull_ms": Times::new(&self.runs, |run| run.cull_ms),
            "gain": gain,
        })
    }
}

/// Number of attacks for which the grid has paths, and number of attacks that one of these paths answers.
fn grid(rows: &[Row]) -> [usize; 2] {
    // The row of the reference with the grid.
    let runs = &rows[1].runs;
    let used = runs.iter().filter(|run| run.used_grid()).count();
    let answered = runs.iter().filter(|run| run.source == Source::Grid).count();
    [used, answered]
}

/// How many times as long the same evaluation of the same candidates takes without culling, by medians.
fn gain(rows: &[Row], row: &Row) -> f64 {
    let is_baseline = |other: &&Row| {
        other.method.cull == CullPath::None
            && other.is_lazy() == row.is_lazy()
            && other.method.enumerate == row.method.enumerate
    };
    let baseline = rows.iter().find(is_baseline);
    baseline.map_or(1.0, |baseline| baseline.times().median / row.times().median)
}

fn to_json(rows: &[Row]) -> Value {
    let [used, answered] = grid(rows);
    let all = rows.iter().map(|row| row.to_json(gain(rows, row)));
    json!({
        "rows": all.collect::<Vec<_>>(),
        "grid_used": used,
        "grid_answered": answered,
    })
}

/// What the maps decide, without the grid and with it. The counts are the CPU's: all paths count the same.
fn maps_table(rows: &[Row]) -> comfy_table::Table {
    let percent = |share: f64| format!("{:.1}%", 100.0 * share);
    let mean = |row: &Row, count: usize| format!("{:.1}", row.per_attack(count));
    let of_cpu = |row: &&Row| row.is_lazy() && row.method.cull == CullPath::Cpu;
    output::table_of(
        1,
        rows.iter().filter(of_cpu),
        &[
            ("grid", &|row| row.method.grid_name().to_owned()),
            ("candidates", &|row| mean(row, row.tally.candidates())),
            ("kept", &|row| mean(row, row.tally.kept())),
            ("weak", &|row| percent(row.tally.weak())),
            ("wrong", &|row| percent(row.tally.wrong())),
            ("undecided", &|row| percent(row.tally.undecided_share())),
        ],
    )
}

fn times_table(rows: &[Row]) -> comfy_table::Table {
    let cull_ms = |row: &Row| Times::new(&row.runs, |run| run.cull_ms);
    output::table_of(
        3,
        rows,
        &[
            ("evaluation", &|row| row.evaluation_name().to_owned()),
            ("culled by", &|row| row.method.cull.name().to_owned()),
            ("grid", &|row| row.method.grid_name().to_owned()),
            ("avoided", &|row| row.avoided().to_string()),
            ("query ms", &|row| row.times().text(2)),
            ("mean", &|row| format!("{:.2}", row.mean_ms(row.runs.len()))),
            ("culling ms", &|row| cull_ms(row).text(3)),
            ("gain", &|row| format!("{:.2}", gain(rows, row))),
        ],
    )
}

fn text(rows: &[Row], attacks: usize) -> String {
    let [used, answered] = grid(rows);
    let percent = |count: usize| 100.0 * count as f64 / attacks.max(1) as f64;
    let missed: usize = rows.iter().map(|row| row.hit_though_avoidable).sum();
    format!(
        "{attacks} attacks, each answered by all methods. {missed} hits could have been avoided.\n\n\
         What the maps decide, per attack, as the CPU counts (every path counts the same):\n{}\n\
         candidates: those with maps (an evasion that is entered or layered has none). kept: by the\n\
         maps. weak: share of the hits that are kept. wrong: share of the clean candidates that are\n\
         removed. undecided: share that is neither removed nor proven clean by the outer maps.\n\n\
         Times, median / 99th percentile and mean:\n{}\n\
         exhaustive: every kept candidate is tested over the whole attack, as in the paper. lazy: only\n\
         those that the choice depends on, as the library does. none: every candidate is kept; the\n\
         evasion maps are still counted, for the score. gain: the median of none by this one's, for the\n\
         same evaluation and grid.\n\n\
         The grid has paths for {:.0}% of the attacks and answers {:.0}%.\n\
         `compare --paper` repeats the paper's own table.\n",
        maps_table(rows),
        times_table(rows),
        percent(used),
        percent(answered),
    )
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
    let paths = culling.counting().into_iter();
    let mut lines: Vec<Line> = paths.map(|path| (path, Vec::new())).collect();
    for size in SIZES {
        let all = input.candidates.iter().copied().cycle();
        let candidates: Vec<CullCandidate> = all.take(size).collect();
        let input = CullInput {
            candidates: &candidates,
            ..input
        };
        for (path, points) in &mut lines {
            let mut overlaps = Vec::new();
            let ms = time(&mut || culling.count(*path, &input, &mut overlaps))?;
            points.push((size as f64, ms));
        }
    }
    Ok(lines)
}

/// Numbers of queries whose candidates are culled in one submission.
const BATCHES: [usize; 4] = [1, 10, 50, 200];

/// Times all culling paths that this machine supports on many queries in one submission: those of the attacks, again and again where there
/// are not as many.
fn batches(
    baked: &BakedGraph,
    throws: &[Throw],
    culling: &mut Culling,
) -> Result<Vec<Line>, Failure> {
    let settings = QuerySettings::default();
    let query = Query::new(baked, &settings);
    let most = throws.len().min(BATCHES[BATCHES.len() - 1]);
    let mut contexts: Vec<QueryContext> = vec![QueryContext::default(); most];
    let started = throws.iter().zip(&mut contexts);
    let started = started.map(|(throw, context)| query.start(throw.request(), context));
    let sessions: Vec<Session<'_>> = started.collect();
    let inputs = sessions.iter().map(Session::cull_input);
    let inputs: Vec<CullInput<'_>> = inputs.filter(|it| !it.candidates.is_empty()).collect();
    if inputs.is_empty() {
        return Ok(Vec::new());
    }
    let paths = culling.counting();
    let line = |path: CullPath| {
        let point = |size: usize| {
            let batch: Vec<CullInput<'_>> = inputs.iter().copied().cycle().take(size).collect();
            Ok((size as f64, culling.with_batch(path, &batch, time)?))
        };
        let points: Result<Vec<_>, Failure> = BATCHES.into_iter().map(point).collect();
        Ok((path, points?))
    };
    paths.into_iter().map(line).collect()
}

/// Median milliseconds of a run. The first is a warm-up.
fn time(run: &mut dyn FnMut() -> Result<(), Failure>) -> Result<f64, Failure> {
    let (begun, mut times) = (Instant::now(), Vec::new());
    for repeat in 0..=REPEATS {
        cancel::check()?;
        let started = Instant::now();
        run()?;
        if repeat > 0 {
            times.push(started.elapsed().as_secs_f64() * 1e3);
        }
        if !times.is_empty() && begun.elapsed().as_secs_f64() > PATIENCE {
            break;
        }
    }
    Ok(percentile(times, 0.5))
}

/// The points of each path; `what` names the number.
fn lines_json(lines: &[Line], what: &str) -> Value {
    let point = |&(size, ms): &(f64, f64)| json!({ what: size as usize, "ms": ms });
    let line = |(path, points): &Line| {
        let points: Vec<Value> = points.iter().map(point).collect();
        json!({ "cull": path.name(), "points": points })
    };
    lines.iter().map(line).collect()
}

/// A row for each number, a column for each path.
fn lines_table(lines: &[Line], what: &str) -> comfy_table::Table {
    let names = lines.iter().map(|(path, _)| path.name());
    let head: Vec<&str> = std::iter::once(what).chain(names).collect();
    let mut table = output::table(&head, 0);
    let sizes = lines.first().map_or(&[][..], |(_, points)| points);
    for (index, (size, _)) in sizes.iter().enumerate() {
        let times = lines
            .iter()
            .map(|(_, points)| format!("{:.4}", points[index].1));
        table.add_row(std::iter::once(size.to_string()).chain(times));
    }
    table
}

fn crossover_text(lines: &[Line]) -> String {
    let table = lines_table(lines, "candidates");
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

/// Whether each path is hit, from answers to one query by [`Evaluation::Exhaustive`], each with its rounds: one answer from all paths, and
/// one from the grid.
fn hits<'r>(answers: impl IntoIterator<Item = &'r QueryRunner<'r>>) -> FxHashMap<PathId, bool> {
    let mut hits = FxHashMap::default();
    for QueryRunner { answer, rounds, .. } in answers {
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
    hits
}

/// Numbers of candidates by the results of maps and exact test.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct MapTally {
    pub(crate) hits: usize,
    /// Hit candidates that the maps keep.
    pub(crate) hits_kept: usize,
    pub(crate) clean: usize,
    /// Clean candidates that the maps remove.
    pub(crate) clean_removed: usize,
    /// Candidates that the maps neither remove nor prove clean.
    pub(crate) undecided: usize,
    /// Hit candidates that the maps prove clean: a fault, unless the maps are not certain.
    pub(crate) hits_proven_clean: usize,
}

impl MapTally {
    /// Adds the rounds of an answer. A candidate of both rounds is added once.
    fn compare(&mut self, hits: &FxHashMap<PathId, bool>, rounds: &[Vec<CountedOne>]) {
        let mut seen = FxHashSet::default();
        let counted = rounds.iter().flatten();
        for one in counted.filter(|one| seen.insert(one.path)) {
            if let Some(&is_hit) = hits.get(&one.path) {
                self.add(one, is_hit);
            }
        }
    }

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
    pub(crate) fn candidates(&self) -> usize {
        self.hits + self.clean
    }

    /// Number of candidates that the maps keep.
    pub(crate) fn kept(&self) -> usize {
        self.hits_kept + self.clean - self.clean_removed
    }

    /// Share of the hit candidates that the maps keep; 0 if there are none.
    pub(crate) fn weak(&self) -> f64 {
        share(self.hits_kept, self.hits)
    }

    /// Share of the clean candidates that the maps remove; 0 if there are none.
    pub(crate) fn wrong(&self) -> f64 {
        share(self.clean_removed, self.clean)
    }

    /// Share of all candidates that only the exact test decides; 0 if there are none.
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
