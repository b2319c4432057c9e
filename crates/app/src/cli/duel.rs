//! `sabaki duel`: two fighters of one graph, in turn.

use std::fmt::Write;
use std::time::Instant;

use sabaki::duel::Fighter;
use sabaki::duel::{Duel, DuelError, DuelSettings, Exchange, Score};
use sabaki::graph::EdgeId;
use sabaki::internal::AttackGridReport;
use sabaki::maps::{AttackGrid, AttackGridSettings, BakedGraph};
use sabaki::query::{Answer, Query, QueryContext, QuerySettings};
use serde_json::{Value, json};

use super::culling::DeviceArgs;
use super::numbers::whole;
use super::source::{self, GraphArgs};
use super::{Done, Failure, cancel, output};

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    graph: GraphArgs,
    /// Number of exchanges. The attacker changes after each.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = whole::<u32>(1..=10_000))]
    rounds: u32,
    /// Random seed. The same seed gives the same duel.
    #[arg(long, value_name = "S", default_value_t = 1, value_parser = whole::<u64>(0..=u64::MAX))]
    seed: u64,
    /// Initial distance between the characters, in metres.
    #[arg(long, value_name = "METRES", default_value_t = DuelSettings::default().opening)]
    apart: f32,
    /// Number of threads that build the attack grid; 0 for all of the machine. The duel does not depend on it.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole::<u64>(0..=1024))]
    threads: u64,
    #[command(flatten)]
    film: super::render::DuelArgs,
}

/// A finished duel, with its duration and the times of its queries.
pub(crate) struct DuelRun {
    pub(crate) exchanges: Vec<Exchange>,
    /// Duration of each exchange's query, in milliseconds.
    pub(crate) query_ms: Vec<f64>,
    pub(crate) score: Score,
    pub(crate) fighters: [Fighter; 2],
    pub(crate) seconds: f32,
    /// Reason why the duel ended before its last round.
    pub(crate) ended: Option<DuelError>,
}

/// The attack grid, and the time that it took to build.
struct BuiltGrid {
    grid: AttackGrid,
    seconds: f64,
}

pub(crate) fn run(args: &Args, device: &DeviceArgs, as_json: bool) -> Result<Done, Failure> {
    args.film.check(args.rounds)?;
    if !args.film.draws() {
        device.check_unused("duel without --out")?;
    }
    let settings = args.settings()?;
    cancel::listen();
    let baked = args.graph.load()?;
    let built = build_grid(&baked.graph, args.threads as usize);
    let fought = built.fight(&baked.graph, args.rounds, &settings)?;
    let told = args.film.draw(&baked.graph, &fought, device)?;
    // A duel that could not be fought out is no duel.
    let no = fought.ended.is_some();
    let text = if as_json {
        let mut document = document(&baked.graph, &built, &fought);
        document["graph"] = source::statistics(&baked);
        if let Some((film, _)) = told {
            document["film"] = film;
        }
        Done::json(&document)
    } else {
        let mut text = source::describe(&baked);
        text.push_str(&describe(&baked.graph, &built, &fought));
        if let Some((_, film)) = told {
            text.push_str(&film);
        }
        text
    };
    Ok(Done::answer(text, !no))
}

fn build_grid(baked: &BakedGraph, threads: usize) -> BuiltGrid {
    let started = Instant::now();
    let mut settings = AttackGridSettings::default();
    settings.paths.threads = threads;
    BuiltGrid {
        grid: AttackGrid::new(baked, &settings),
        seconds: started.elapsed().as_secs_f64(),
    }
}

impl Args {
    /// The settings, checked before any work is done; errors name the option.
    fn settings(&self) -> Result<DuelSettings, Failure> {
        let settings = DuelSettings {
            seed: self.seed,
            opening: self.apart,
            ..DuelSettings::default()
        };
        match settings.check() {
            Ok(()) => Ok(settings),
            Err(DuelError::Setting {
                name: "opening",
                value,
                least,
                most,
            }) => Err(Failure::Usage(format!(
                "--apart {value}: must be {least} to {most} metres"
            ))),
            Err(other) => Err(Failure::Usage(other.to_string())),
        }
    }
}

impl BuiltGrid {
    /// Runs a duel of two characters for a number of rounds.
    fn fight(
        &self,
        baked: &BakedGraph,
        rounds: u32,
        settings: &DuelSettings,
    ) -> Result<DuelRun, Failure> {
        let usage = |error: DuelError| Failure::Usage(error.to_string());
        let mut duel = Duel::new(baked, &self.grid, settings).map_err(usage)?;
        let bar = output::progress("fighting", u64::from(rounds));
        let settings = QuerySettings::default();
        let query = Query::new(baked, &settings);
        let (mut context, mut answer) = (QueryContext::default(), Answer::default());
        let (mut query_ms, mut ended) = (Vec::new(), None);
        while query_ms.len() < rounds as usize {
            cancel::check()?;
            let challenge = match duel.challenge() {
                Ok(challenge) => challenge,
                Err(error) => {
                    ended = Some(error);
                    break;
                }
            };
            let started = Instant::now();
            query.answer(challenge.request(), &mut context, &mut answer);
            let milliseconds = started.elapsed().as_secs_f64() * 1e3;
            if duel.settle(&challenge, &answer).is_some() {
                query_ms.push(milliseconds);
                bar.inc(1);
            }
        }
        bar.finish_and_clear();
        Ok(DuelRun {
            exchanges: duel.exchanges().to_vec(),
            query_ms,
            score: duel.score(),
            seconds: duel.now(),
            fighters: duel.into_fighters(),
            ended,
        })
    }
}

/// The clip that an edge starts in.
pub(crate) fn clip_of(baked: &BakedGraph, edge: EdgeId) -> &str {
    let graph = baked.graph();
    graph.clip(graph.node(graph.edge(edge).from).clip).name()
}

fn document(baked: &BakedGraph, built: &BuiltGrid, fought: &DuelRun) -> Value {
    let numbers = |edges: &[EdgeId]| edges.iter().map(|edge| edge.0).collect::<Vec<_>>();
    let exchanges = fought.exchanges.iter().zip(&fought.query_ms);
    let exchanges: Vec<Value> = exchanges
        .map(|(exchange, query_ms)| {
            json!({
                "attacker": exchange.attacker,
                "attack": clip_of(baked, exchange.strike),
                "edge": exchange.strike.0,
                "path": numbers(&exchange.path),
                "announced": exchange.announced,
                "lead": exchange.lead,
                "candidates": exchange.counts.candidates,
                "culled": exchange.counts.culled,
                "source": exchange.source,
                "avoided": exchange.avoided,
                "by": exchange.evasion.map(|edge| clip_of(baked, edge)),
                "answer": exchange.answer.iter().map(|step| json!({ "edge": step.edge.0, "rate": step.rate })).collect::<Vec<_>>(),
                "clearance": exchange.clearance.metres,
                "nearest_at": exchange.announced + exchange.clearance.time,
                "clearance_without": exchange.without,
                "query_ms": query_ms,
            })
        })
        .collect();
    json!({
        "rounds": exchanges.len(),
        "seconds": fought.seconds,
        "score": {
            "hits": { "white": fought.score.hits[0], "blue": fought.score.hits[1] },
            "dodges": { "white": fought.score.dodges[0], "blue": fought.score.dodges[1] },
            "called_off": fought.score.called_off,
        },
        "ended": fought.ended.map(|error| error.to_string()),
        "exchanges": exchanges,
        "attack_grid": {
            "build_seconds": built.seconds,
            "size": built.grid.report(),
        },
    })
}

fn describe(baked: &BakedGraph, built: &BuiltGrid, fought: &DuelRun) -> String {
    let AttackGridReport {
        nodes,
        cells,
        options,
        bytes,
        paths,
        path_bytes,
    } = built.grid.report();
    let mut text = format!(
        "attack grid of {nodes} nodes built in {:.2} s: {} paths, {cells} cells, {options} entries; {:.1} MB, and {:.1} MB of paths\n\n",
        built.seconds,
        paths.kept,
        bytes as f64 * 1e-6,
        path_bytes as f64 * 1e-6,
    );
    let head = [
        "attacker",
        "attack",
        "answer",
        "by",
        "at s",
        "lead s",
        "path",
        "candidates",
        "clearance cm",
        "without dodge cm",
        "query ms",
    ];
    let mut table = output::table(&head, 4);
    for (exchange, query_ms) in fought.exchanges.iter().zip(&fought.query_ms) {
        let by = exchange
            .evasion
            .map_or("continued motion", |edge| clip_of(baked, edge));
        table.add_row(vec![
            exchange.attacker.name().to_owned(),
            clip_of(baked, exchange.strike).to_owned(),
            if exchange.avoided { "avoided" } else { "HIT" }.to_owned(),
            by.to_owned(),
            format!("{:.2}", exchange.announced),
            format!("{:.2}", exchange.lead),
            exchange.path.len().to_string(),
            exchange.counts.candidates.to_string(),
            format!("{:.1}", 100.0 * exchange.clearance.metres),
            format!("{:.1}", 100.0 * exchange.without),
            format!("{query_ms:.2}"),
        ]);
    }
    let _ = writeln!(text, "{table}");
    let Score {
        hits,
        dodges,
        called_off,
    } = fought.score;
    let _ = writeln!(
        text,
        "\nhits: white {}, blue {}; avoided: white {}, blue {}; {:.1} s, {called_off} attacks aborted",
        hits[0], hits[1], dodges[0], dodges[1], fought.seconds
    );
    if let Some(error) = fought.ended {
        let _ = writeln!(text, "the duel ended early: {error}");
    }
    text
}
