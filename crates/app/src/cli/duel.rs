//! `sabaki duel`: two fighters of one graph, in turn.

use std::time::Instant;

use sabaki::duel::{Duel, DuelError, DuelSettings, Exchange, Fighter, Score};
use sabaki::graph::EdgeId;
use sabaki::maps::{AttackGrid, AttackGridSettings, BakedGraph};
use sabaki::query::{Answer, Query, QueryContext, QuerySettings};
use serde_json::{Value, json};

use super::bake::{self, GraphArgs};
use super::numbers::{number, whole};
use super::{Done, Failure, cancel, output};

/// A duel; `render duel` draws the same.
#[derive(clap::Args)]
pub(crate) struct FightArgs {
    #[command(flatten)]
    pub(crate) graph: GraphArgs,
    /// Number of exchanges. The attacker changes after each.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = whole::<u32>(1..=10_000))]
    rounds: u32,
    /// Random seed. The same seed gives the same duel.
    #[arg(long, value_name = "S", default_value_t = 1, value_parser = whole::<u64>(0..=u64::MAX))]
    seed: u64,
    /// Initial distance between the characters, in metres.
    #[arg(long, value_name = "METRES", default_value_t = DuelSettings::default().opening, value_parser = number(0.3..=6.0))]
    apart: f32,
}

/// A finished duel, with the times of its queries.
pub(crate) struct DuelRun {
    pub(crate) exchanges: Vec<Exchange>,
    /// Duration of each exchange's query, in milliseconds.
    query_ms: Vec<f64>,
    score: Score,
    pub(crate) fighters: [Fighter; 2],
    seconds: f32,
    /// Reason why the duel ended before its last round.
    ended: Option<DuelError>,
}

/// The attack grid, and the seconds that it took to build.
type BuiltGrid = (AttackGrid, f64);

pub(crate) fn run(args: &FightArgs, as_json: bool) -> Result<Done, Failure> {
    cancel::listen();
    let baked = args.graph.load()?;
    let (built, fought) = fight(&baked, args)?;
    let text = if as_json {
        let mut document = document(&baked, &fought);
        document["attack_grid"] = json!({ "build_seconds": built.1, "size": built.0.report() });
        document["graph"] = bake::statistics(&baked);
        Done::json(&document)
    } else {
        let headline = bake::headline(&baked);
        format!("{headline}{}", describe(&baked, &built, &fought))
    };
    // A duel that could not be fought out is no duel.
    Ok(Done::answer(text, fought.ended.is_none()))
}

/// Builds the attack grid and runs the duel.
pub(crate) fn fight(baked: &BakedGraph, args: &FightArgs) -> Result<(BuiltGrid, DuelRun), Failure> {
    let usage = |error: DuelError| Failure::Usage(error.to_string());
    let settings = DuelSettings {
        seed: args.seed,
        opening: args.apart,
        ..DuelSettings::default()
    };
    let started = Instant::now();
    let grid = AttackGrid::new(baked, &AttackGridSettings::default());
    let seconds = started.elapsed().as_secs_f64();
    let mut duel = Duel::new(baked, &grid, &settings).map_err(usage)?;
    let bar = output::progress("fighting", u64::from(args.rounds));
    let settings = QuerySettings::default();
    let query = Query::new(baked, &settings);
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    let (mut query_ms, mut ended) = (Vec::new(), None);
    while query_ms.len() < args.rounds as usize {
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
    let fought = DuelRun {
        exchanges: duel.exchanges().to_vec(),
        query_ms,
        score: duel.score(),
        seconds: duel.now(),
        fighters: duel.into_fighters(),
        ended,
    };
    Ok(((grid, seconds), fought))
}

/// The clip that an edge starts in.
pub(crate) fn clip_of(baked: &BakedGraph, edge: EdgeId) -> &str {
    let graph = baked.graph();
    graph.clip(graph.node(graph.edge(edge).from).clip).name()
}

/// The score and all exchanges as JSON.
pub(crate) fn document(baked: &BakedGraph, fought: &DuelRun) -> Value {
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
    })
}

fn describe(baked: &BakedGraph, (grid, seconds): &BuiltGrid, fought: &DuelRun) -> String {
    let grid = grid.report();
    let head = [
        "attacker",
        "attack",
        "answer",
        "by",
        "at",
        "lead",
        "clearance",
        "undodged",
        "ms",
    ];
    let mut table = output::table(&head, 4);
    for (exchange, query_ms) in fought.exchanges.iter().zip(&fought.query_ms) {
        let by = exchange
            .evasion
            .map_or("continued motion", |edge| clip_of(baked, edge));
        table.add_row([
            exchange.attacker.name().to_owned(),
            clip_of(baked, exchange.strike).to_owned(),
            if exchange.avoided { "avoided" } else { "HIT" }.to_owned(),
            by.to_owned(),
            format!("{:.2} s", exchange.announced),
            format!("{:.2} s", exchange.lead),
            format!("{:.1} cm", 100.0 * exchange.clearance.metres),
            format!("{:.1} cm", 100.0 * exchange.without),
            format!("{query_ms:.2}"),
        ]);
    }
    let mut text = format!(
        "attack grid built in {seconds:.2} s: {} paths, {} cells; {:.1} MB\n\n{table}\n\
         lead: time from the announcement to the blow. undodged: clearance if the motion went on.\n\n{}\n",
        grid.paths.kept,
        grid.cells,
        (grid.bytes + grid.path_bytes) as f64 * 1e-6,
        score_line(fought),
    );
    if let Some(error) = fought.ended {
        text += &format!("the duel ended early: {error}\n");
    }
    text
}

/// The score in one line.
pub(crate) fn score_line(fought: &DuelRun) -> String {
    let Score {
        hits,
        dodges,
        called_off,
    } = fought.score;
    format!(
        "hits: white {}, blue {}; avoided: white {}, blue {}; {:.1} s, {called_off} attacks aborted",
        hits[0], hits[1], dodges[0], dodges[1], fought.seconds
    )
}
