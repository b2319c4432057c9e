//! `sabaki duel`: two characters of one graph strike and dodge in turn.

use std::path::PathBuf;
use std::sync::Arc;

use sabaki::maps::BakedGraph;
use sabaki_app::play::{APART, Fight, PATIENCE, clip_of, score};
use sabaki_draw::scene::Exchange;
use serde_json::{Value, json};

use super::bake::{self, GraphArgs};
use super::numbers::{number, whole};
use super::output::usage;
use super::{Done, Failure, cancel, output};

/// A duel; `render duel` draws the same.
#[derive(clap::Args)]
pub(crate) struct FightArgs {
    #[command(flatten)]
    pub(crate) graph: GraphArgs,
    /// Number of strikes. The attacker changes after each.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = whole::<u32>(1..=10_000))]
    rounds: u32,
    /// Random seed. The same seed gives the same duel.
    #[arg(long, value_name = "S", default_value_t = 1, value_parser = whole::<u64>(0..=u64::MAX))]
    seed: u64,
    /// Initial distance between the characters, in metres.
    #[arg(long, value_name = "METRES", default_value_t = APART, value_parser = number(0.3..=6.0))]
    apart: f32,
    /// Writes what both played to this folder, as BVH at 60 Hz.
    #[arg(long, value_name = "DIR")]
    export: Option<PathBuf>,
}

/// A duel, and whether it was fought out.
pub(crate) struct Fought {
    pub(crate) fight: Fight,
    is_whole: bool,
}

pub(crate) fn run(args: &FightArgs, as_json: bool) -> Result<Done, Failure> {
    cancel::listen();
    let baked = Arc::new(args.graph.load()?);
    let fought = fight(&baked, args)?;
    let text = if as_json {
        let mut document = document(&baked, &fought);
        document["graph"] = bake::statistics(&baked);
        Done::json(&document)
    } else {
        format!("{}{}", bake::headline(&baked), describe(&baked, &fought))
    };
    // A duel that could not be fought out is no duel.
    Ok(Done::answer(text, fought.is_whole))
}

/// Runs the duel, and exports it.
pub(crate) fn fight(baked: &Arc<BakedGraph>, args: &FightArgs) -> Result<Fought, Failure> {
    if let Some(folder) = &args.export {
        let option = format!("--export {}", folder.display());
        output::check_can_be_folder(&option, folder)?;
    }
    let mut fight = Fight::new(baked, args.apart, args.seed).map_err(usage)?;
    let bar = output::progress("fighting", u64::from(args.rounds));
    let mut is_whole = true;
    while is_whole && fight.exchanges.len() < args.rounds as usize {
        cancel::check()?;
        is_whole = fight.exchange().map_err(usage)?;
        bar.inc(u64::from(is_whole));
    }
    bar.finish_and_clear();
    if let Some(folder) = &args.export {
        fight.export(folder).map_err(Failure::file(folder))?;
    }
    Ok(Fought { fight, is_whole })
}

/// Why the duel ended before its last round.
fn ended(fought: &Fought) -> Option<String> {
    let why = || format!("no fighter comes within reach of the other in {PATIENCE} s");
    (!fought.is_whole).then(why)
}

/// The score and all exchanges as JSON.
pub(crate) fn document(baked: &BakedGraph, fought: &Fought) -> Value {
    let exchange = |exchange: &Exchange| {
        json!({
            "attacker": exchange.attacker_name(),
            "attack": clip_of(baked, exchange.attack),
            "edge": exchange.attack.0,
            "announced": exchange.announced,
            "lead": exchange.contact - exchange.announced,
            "avoided": exchange.is_avoided(),
            "by": exchange.by.map(|edge| clip_of(baked, edge)),
            "clearance": exchange.clearance,
            "nearest_at": exchange.nearest_at,
        })
    };
    let fight = &fought.fight;
    let [hits, dodges] =
        score(&fight.exchanges).map(|[white, blue]| json!({ "white": white, "blue": blue }));
    json!({
        "rounds": fight.exchanges.len(),
        "seconds": fight.now(),
        "score": { "hits": hits, "dodges": dodges, "called_off": fight.broken_off },
        "ended": ended(fought),
        "exchanges": fight.exchanges.iter().map(exchange).collect::<Vec<_>>(),
    })
}

fn describe(baked: &BakedGraph, fought: &Fought) -> String {
    let seconds = |seconds: f32| format!("{seconds:.2} s");
    let table = output::table_of(
        4,
        &fought.fight.exchanges,
        &[
            ("attacker", &|one| one.attacker_name().to_owned()),
            ("attack", &|one| clip_of(baked, one.attack).to_owned()),
            ("answer", &|one| {
                if one.is_avoided() { "avoided" } else { "HIT" }.to_owned()
            }),
            ("by", &|one| {
                let by = one.by.map_or("", |edge| clip_of(baked, edge));
                by.to_owned()
            }),
            ("at", &|one| seconds(one.announced)),
            ("lead", &|one| seconds(one.contact - one.announced)),
            ("clearance", &|one| match one.clearance {
                Some(metres) => format!("{:.1} cm", 100.0 * metres),
                None => "far".to_owned(),
            }),
        ],
    );
    let line = score_line(fought);
    let mut text = format!(
        "{table}\n\nlead: time from the beginning of the strike, which the other one sees, to its furthest reach.\n\n{line}\n"
    );
    if let Some(why) = ended(fought) {
        text += &format!("the duel ended early: {why}\n");
    }
    text
}

pub(crate) fn score_line(fought: &Fought) -> String {
    let fight = &fought.fight;
    let [hits, dodges] = score(&fight.exchanges);
    format!(
        "hits: white {}, blue {}; avoided: white {}, blue {}; {:.1} s, {} strikes broken off",
        hits[0],
        hits[1],
        dodges[0],
        dodges[1],
        fight.now(),
        fight.broken_off
    )
}
