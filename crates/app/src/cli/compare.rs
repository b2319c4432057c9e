//! `sabaki compare`: the paper's Table 1, measured here.
//!
//! Source: Masaoka & Oshita, section 6, Table 1.

use super::map_quality::{GroundTruth, MapTally};
use sabaki::maps::BakedGraph;
use sabaki::query::{CullPath, Enumerate, Source};
use sabaki_app::percentile::percentile;
use sabaki_fixtures::throw::{Throw, ThrowSettings, throw};
use serde_json::{Value, json};

use super::culling::{self, Culling, DeviceArgs, PathTimes};
use super::numbers::whole;
use super::passes::{Attacks, LookupArg, Method};
use super::plot::Plot;
use super::source::{self, GraphArgs};
use super::stats::{QueryRunner, Run, Times};
use super::{Done, Failure, cancel, crossover, map_settings, output, pass_times};

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
    /// Cells of the grid that are looked up.
    #[arg(long, value_enum, default_value = "union")]
    lookup: LookupArg,
    /// Compares settings of the maps instead: bakes each and checks it against the exact test.
    #[arg(long, conflicts_with_all = ["plot", "lookup"])]
    settings: bool,
    /// Measure the time of culling over the number of candidates as well, and draw it: a PNG or SVG, or - for letters
    /// on stdout.
    #[arg(long, value_name = "FILE")]
    plot: Option<Plot>,
    /// Measure the device's time of each pass of culling as well.
    #[arg(long, conflicts_with = "settings")]
    gpu_passes: bool,
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
    /// V of the grid's choice minus V of the whole search's choice, for each attack that the grid answers.
    regret: Vec<f64>,
}

pub(crate) fn run(args: &Args, device: &DeviceArgs, as_json: bool) -> Result<Done, Failure> {
    Plot::check(args.plot.as_ref(), as_json)?;
    cancel::listen();
    if args.settings {
        device.check_unused("compare --settings")?;
        let baked = args.graph.load()?;
        return map_settings::run(&baked.graph, &throws(args, &baked.graph)?, as_json);
    }
    let mut device = culling::open(device)?;
    let baked = args.graph.load()?;
    let throws = throws(args, &baked.graph)?;
    if args.gpu_passes
        && let Ok(device) = &mut device
    {
        device.time_passes();
    }
    let mut culling = Culling::new(device, baked.graph.atlas());
    let attacks = Attacks {
        baked: &baked.graph,
        throws: &throws,
    };
    let table = measure(attacks, args.lookup.into(), &mut culling)?;
    // Before the plot, whose culls are larger.
    let passes: Vec<PathTimes> = culling.pass_times().into_iter().cloned().collect();
    let mut drawn = String::new();
    let crossover = match &args.plot {
        None => None,
        Some(plot) => {
            let lines = crossover::measure(&baked.graph, &throws, &mut culling)?;
            drawn = plot.draw(&crossover::CrossoverFigure { lines: &lines })?;
            Some(lines)
        }
    };
    Ok(Done::ok(if as_json {
        let mut document = table.to_json();
        document["device"] = json!(culling.device_name());
        document["graph"] = source::statistics(&baked);
        if let Some(lines) = &crossover {
            document["crossover"] = crossover::to_json(lines);
        }
        if args.gpu_passes {
            document["gpu_passes"] = pass_times::to_json(&passes);
        }
        Done::json(&document)
    } else {
        let crossover = crossover.map_or(String::new(), |lines| crossover::text(&lines));
        let passes = match args.gpu_passes {
            true => pass_times::text(&passes),
            false => String::new(),
        };
        format!(
            "{}{}\n\n{}{passes}{crossover}",
            source::describe(&baked),
            culling.describe(culling.paths()),
            table.text(throws.len())
        ) + &drawn
    }))
}

fn throws(args: &Args, baked: &BakedGraph) -> Result<Vec<Throw>, Failure> {
    let settings = ThrowSettings::default();
    let random = |index| {
        cancel::check()?;
        throw(baked, &settings, args.seed, index).map_err(|error| Failure::Attack {
            index: index as usize,
            error,
        })
    };
    (0..args.attacks).map(random).collect()
}

/// All methods, attack by attack, so that what disturbs the machine disturbs all of them.
fn measure(attacks: Attacks<'_>, grid: Enumerate, culling: &mut Culling) -> Result<Table, Failure> {
    let Attacks { baked, throws } = attacks;
    let grids = [Enumerate::Whole, grid];
    let paths = culling.paths();
    let methods = paths
        .iter()
        .flat_map(|&cull| grids.map(|enumerate| Method { cull, enumerate }));
    let mut rows: Vec<Row> = methods.map(Row::new).collect();
    let mut askers: Vec<QueryRunner<'_>> = rows.iter().map(|_| QueryRunner::new(baked)).collect();
    let mut regret = Vec::new();
    let bar = output::progress("comparing", throws.len() as u64);
    // The first attack twice: memory is filled when times begin to count.
    for (count, throw) in throws[..1].iter().chain(throws).enumerate() {
        cancel::check()?;
        let mut runs = Vec::new();
        for (row, runner) in rows.iter().zip(&mut askers) {
            runner.watches = true;
            let settings = row.method.settings();
            runs.push(runner.ask(&settings, throw, culling.on(row.method.cull))?);
        }
        if count == 0 {
            continue;
        }
        // The first two are exact, without and with the grid.
        let of = |index: usize| (&askers[index].answer, askers[index].rounds.as_slice());
        let truth = GroundTruth::new([of(0), of(1)]);
        for ((row, runner), run) in rows.iter_mut().zip(&askers).zip(&runs) {
            truth.compare(&runner.rounds, &mut row.tally);
            row.hit_though_avoidable += usize::from(!run.avoided && runs[0].avoided);
            row.runs.push(run.clone());
        }
        if let (Source::Grid, Some(by_grid), Some(best)) =
            (runs[1].source, runs[1].score, runs[0].score)
        {
            regret.push(f64::from(by_grid) - f64::from(best));
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(Table { rows, regret })
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
            "query_ms": Times::of(&self.runs, Run::query_ms).to_json(),
            "cull_ms": Times::of(&self.runs, |run| run.cull_ms).to_json(),
        })
    }

    fn cells(&self) -> Vec<String> {
        let tally = self.tally();
        let percent = |share: f64| format!("{:.1}%", 100.0 * share);
        vec![
            self.method.cull.name().to_owned(),
            self.method.grid_name().to_owned(),
            format!("{:.1}", self.per_attack(tally.candidates())),
            format!("{:.1}", self.per_attack(tally.kept())),
            percent(tally.weak()),
            percent(tally.wrong()),
            percent(tally.undecided_share()),
            percent(self.per_attack(self.avoided())),
            self.hit_though_avoidable.to_string(),
            Times::of(&self.runs, Run::query_ms).text(2),
            Times::of(&self.runs, |run| run.cull_ms).text(3),
        ]
    }
}

/// The figures of the paper's Table 1.
const PAPER: &str = "\
The paper, on its machine: no grid 496 ms exact, 225 ms stencil; grid 18 ms exact, 14 ms stencil. About 100 candidates
without the grid, culled to 70; about 5 with it, culled to 3. The grid used in about 90% of the attacks.
";

impl Table {
    /// The row of the exact test with the grid.
    fn filed(&self) -> &Row {
        &self.rows[1]
    }

    /// Number of attacks for which the grid has paths, and number of attacks that one of these paths answers.
    fn grid(&self) -> [usize; 2] {
        let runs = &self.filed().runs;
        let used = runs.iter().filter(|run| run.used_grid()).count();
        let answered = runs.iter().filter(|run| run.source == Source::Grid).count();
        [used, answered]
    }

    fn regret(&self) -> [f64; 2] {
        [0.5, 0.9].map(|share| percentile(self.regret.clone(), share))
    }

    /// Median number of candidates with maps if the grid answers, and median number of those that the maps keep.
    fn of_grid(&self) -> [f64; 2] {
        let is_cpu = |row: &&Row| {
            row.method.cull == CullPath::Cpu && row.method.enumerate != Enumerate::Whole
        };
        let runs = self
            .rows
            .iter()
            .find(is_cpu)
            .map_or(&[][..], |row| &row.runs);
        let median = |of: fn(&Run) -> usize| {
            let answered = runs.iter().filter(|run| run.source == Source::Grid);
            percentile(answered.map(|run| of(run) as f64).collect(), 0.5)
        };
        [
            median(Run::mapped),
            median(|run| run.mapped().saturating_sub(run.counts.culled)),
        ]
    }

    fn to_json(&self) -> Value {
        let ([used, answered], [median, p90]) = (self.grid(), self.regret());
        let [candidates, kept] = self.of_grid();
        json!({
            "rows": self.rows.iter().map(Row::to_json).collect::<Vec<_>>(),
            "grid_used": used,
            "grid_answered": answered,
            "grid_regret": { "median": median, "p90": p90 },
            "where_the_grid_answers": { "candidates": candidates, "kept": kept },
            "paper": {
                "rows": [
                    { "cull": "exact", "grid": "off", "query_ms": 496, "candidates": 100 },
                    { "cull": "stencil", "grid": "off", "query_ms": 225, "candidates": 100, "kept": 70 },
                    { "cull": "exact", "grid": "on", "query_ms": 18, "candidates": 5 },
                    { "cull": "stencil", "grid": "on", "query_ms": 14, "candidates": 5, "kept": 3 },
                ],
                "grid_used_share": 0.9,
            },
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
            "undecided",
            "avoided",
            "hit though avoidable",
            "query ms, median / p99",
            "culling ms, median / p99",
        ];
        let mut table = output::table(&head, 2);
        for row in &self.rows {
            table.add_row(row.cells());
        }
        let ([used, answered], [median, p90]) = (self.grid(), self.regret());
        let percent = |count: usize| 100.0 * count as f64 / attacks.max(1) as f64;
        let [candidates, kept] = self.of_grid();
        format!(
            "{attacks} attacks, each answered by all methods:\n{table}\n\
             candidates: mean number of candidates with maps per query; those that enter or layer an evasion have none. kept: number that the\n\
             maps (exact: the exact test) keep.\n\
             weak: share of the candidates that hit and are kept. wrong: share of the clean candidates that are removed. undecided:\n\
             share that is neither removed nor proven clean. hit though avoidable: attacks that hit, but that the exact search over\n\
             the whole graph avoids.\n\n\
             The grid has paths for {:.0}% of the attacks and answers {:.0}%. For these it has {candidates:.0} candidates with maps in the median,\n\
             culled to {kept:.0}. The score V of its choice is worse than that of the whole search by {median:.3} in the median, {p90:.3} at the\n\
             90th percentile (both exact).\n\n{PAPER}",
            percent(used),
            percent(answered),
        )
    }
}
