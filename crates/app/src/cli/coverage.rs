//! `sabaki coverage`: which attacks does a graph have an answer to?

use std::fmt::Write;

use crate::measure::coverage::{Cell, CellThrow, Coverage, Gap, HEIGHTS, LEADS};
use sabaki::maps::BakedGraph;
use sabaki::math::in_parallel;
use sabaki::query::{Answer, Query, QueryContext, QuerySettings};
use serde_json::{Value, json};

use super::coverage_by_time::{self, Balls};
use super::heat_map::{HeatMap, direction_name};
use super::numbers::whole;
use super::plot::Plot;
use super::source::{self, Baked, GraphArgs};
use super::{Done, Failure, cancel, output};
use sabaki_fixtures::throw::RandomDraw;

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    graph: GraphArgs,
    /// Number of attacks, at least one of each kind. Default: 2800; with --by-time: 400 for each time.
    #[arg(long, value_name = "N", value_parser = whole::<u64>(1..=1_000_000))]
    attacks: Option<u64>,
    /// Measures by the time from the query to the contact, with balls that would hit the continued motion.
    #[arg(long, conflicts_with_all = ["directions", "speed", "plot"])]
    by_time: bool,
    /// Seed of the random moments.
    #[arg(long, value_name = "S", default_value_t = 1, value_parser = whole::<u64>(0..=u64::MAX))]
    seed: u64,
    /// Number of directions.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = whole::<u64>(2..=36))]
    directions: u64,
    /// Speed of the balls, in metres per second.
    #[arg(long, value_name = "M/S", default_value_t = 10.0)]
    speed: f32,
    /// Number of threads; 0 for all of the machine. The result does not depend on it.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole::<u64>(0..=1024))]
    threads: u64,
    /// Plots the table as a heat map: to a PNG or SVG file, or with - as letters to stdout.
    #[arg(long, alias = "png", value_name = "FILE")]
    plot: Option<Plot>,
}

/// Number of gaps that are described.
const NAMED: usize = 3;

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    if !(args.speed >= 0.1 && args.speed <= 1000.0) {
        let what = format!("--speed must be 0.1 to 1000 m/s; it is {}", args.speed);
        return Err(Failure::Usage(what));
    }
    Plot::check(args.plot.as_ref(), as_json)?;
    cancel::listen();
    let baked = args.graph.load()?;
    if args.by_time {
        return by_time(args, &baked, as_json);
    }
    let coverage = throw_all(args, &baked.graph)?;
    let drawn = match &args.plot {
        None => String::new(),
        Some(plot) => plot.draw(&HeatMap {
            coverage: &coverage,
        })?,
    };
    Ok(Done::ok(if as_json {
        let mut document = document(&coverage);
        document["graph"] = source::statistics(&baked);
        Done::json(&document)
    } else {
        format!("{}\n{}{drawn}", source::describe(&baked), text(&coverage))
    }))
}

fn by_time(args: &Args, baked: &Baked, as_json: bool) -> Result<Done, Failure> {
    /// Number of balls for each time.
    const ATTACKS: u64 = 400;
    let balls = Balls {
        attacks: args.attacks.unwrap_or(ATTACKS),
        seed: args.seed,
        threads: args.threads as usize,
    };
    let rows = coverage_by_time::throw_all(balls, &baked.graph)?;
    Ok(Done::ok(if as_json {
        let mut document = coverage_by_time::document(&rows);
        document["graph"] = source::statistics(baked);
        Done::json(&document)
    } else {
        let table = coverage_by_time::text(&rows);
        format!("{}\n{table}", source::describe(baked))
    }))
}

/// Throws at every cell, each time at the same moments.
fn throw_all(args: &Args, baked: &BakedGraph) -> Result<Coverage, Failure> {
    let mut coverage = Coverage::new(args.directions as usize);
    let cells: Vec<Cell> = coverage.cells().collect();
    /// One of each of 35 kinds from 8 directions, ten times.
    const ATTACKS: u64 = 2800;
    let each = (args.attacks.unwrap_or(ATTACKS) / cells.len() as u64).max(1);
    let bar = output::progress("throwing", each * cells.len() as u64);
    let settings = QuerySettings::default();
    let query = Query::new(baked, &settings);
    let of_cell = |number: usize| {
        let (mut context, mut answer) = (QueryContext::default(), Answer::default());
        let one = |index: u64| {
            cancel::check()?;
            let cell = cells[number];
            let thrown = coverage.throw(
                baked,
                cell,
                CellThrow {
                    draw: RandomDraw {
                        seed: args.seed,
                        index,
                    },
                    speed: args.speed,
                },
            );
            let throw = thrown.map_err(|error| Failure::Attack {
                index: index as usize,
                error,
            })?;
            query.answer(throw.request(), &mut context, &mut answer);
            bar.inc(1);
            Ok(answer.avoided)
        };
        (0..each).map(one).collect::<Result<Vec<bool>, Failure>>()
    };
    let results = in_parallel(args.threads as usize, cells.len(), of_cell);
    bar.finish_and_clear();
    for (&cell, avoided) in cells.iter().zip(results) {
        avoided?.iter().for_each(|&one| coverage.add(cell, one));
    }
    Ok(coverage)
}

fn percent(share: f64) -> String {
    format!("{:.0}%", 100.0 * share)
}

fn document(coverage: &Coverage) -> Value {
    let name = |direction: usize| direction_name(coverage, direction);
    let cell = |cell: Cell| {
        let [thrown, avoided] = coverage.counts(|other| other == cell);
        let [low, high] = coverage.interval(|other| other == cell);
        json!({
            "direction": name(cell.direction),
            "degrees": coverage.from(cell.direction).to_degrees(),
            "height": HEIGHTS[cell.height].0,
            "lead": LEADS[cell.lead],
            "attacks": thrown,
            "avoided": avoided,
            "share": coverage.share(|other| other == cell),
            "low": low,
            "high": high,
        })
    };
    let gap = |gap: &Gap| {
        json!({
            "direction": name(gap.cell.direction),
            "height": HEIGHTS[gap.cell.height].0,
            "share": gap.any_lead,
            "lead": LEADS[gap.cell.lead],
            "share_at_lead": gap.share,
            "share_of_others_at_lead": gap.others,
            "beyond_chance": gap.is_certain,
        })
    };
    let [thrown, avoided] = coverage.counts(|_| true);
    let gaps = coverage.gaps();
    let [low, high] = coverage.interval(|_| true);
    let next = gaps.first().filter(|gap| gap.is_certain);
    json!({
        "attacks": thrown,
        "avoided": avoided,
        "share": coverage.share(|_| true),
        "low": low,
        "high": high,
        "cells": coverage.cells().map(cell).collect::<Vec<_>>(),
        "gaps": gaps.iter().map(gap).collect::<Vec<_>>(),
        "capture_next": next.map(|gap| advice(coverage, gap)),
    })
}

/// Which evasion would fill a gap.
fn advice(coverage: &Coverage, gap: &Gap) -> String {
    let Cell {
        direction,
        height,
        lead,
    } = gap.cell;
    let what = match HEIGHTS[height].0 {
        "ankle" | "knee" => "a jump or a step away",
        "hip" => "a side step or a leap back",
        "chest" => "a deep duck or a side step",
        _ => "a duck, a slip or a sway",
    };
    format!(
        "{what} for {}-high attacks from the {}, that can start {:.2} s after they are announced",
        HEIGHTS[height].0,
        direction_name(coverage, direction),
        LEADS[lead],
    )
}

fn text(coverage: &Coverage) -> String {
    let leads: Vec<String> = LEADS.iter().map(|lead| format!("{lead:.2} s")).collect();
    let head = ["height", "from"].into_iter();
    let head: Vec<&str> = head
        .chain(leads.iter().map(String::as_str))
        .chain(["all"])
        .collect();
    let mut table = output::table(&head, 2);
    for height in (0..HEIGHTS.len()).rev() {
        for direction in 0..coverage.directions() {
            let is = |cell: Cell| cell.height == height && cell.direction == direction;
            let at = |lead: usize| percent(coverage.share(|c| is(c) && c.lead == lead));
            let names = [
                HEIGHTS[height].0.to_owned(),
                direction_name(coverage, direction),
            ];
            let row = names.into_iter().chain((0..LEADS.len()).map(at));
            table.add_row(row.chain([percent(coverage.share(is))]));
        }
    }
    let at = |lead: usize| percent(coverage.share(|c| c.lead == lead));
    let names = ["all".to_owned(), String::new()].into_iter();
    let row = names.chain((0..LEADS.len()).map(at));
    table.add_row(row.chain([percent(coverage.share(|_| true))]));
    let [thrown, avoided] = coverage.counts(|_| true);
    let [low, high] = coverage.interval(|_| true).map(percent);
    let mut text = format!(
        "{avoided} of {thrown} attacks are avoided (95% interval: {low} to {high}). Shares by height, direction and lead (time from the query to the throw):\n{table}\n\n"
    );
    text.push_str(&words(coverage));
    text
}

/// Describes the gaps.
fn words(coverage: &Coverage) -> String {
    let least = |count: usize, share: &dyn Fn(usize) -> f64| {
        let shares = (0..count).map(|index| (index, share(index)));
        shares
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap_or((0, 0.0))
    };
    let (direction, of_direction) = least(coverage.directions(), &|index| {
        coverage.share(|cell| cell.direction == index)
    });
    let (height, of_height) = least(HEIGHTS.len(), &|index| {
        coverage.share(|cell| cell.height == index)
    });
    let (lead, of_lead) = least(LEADS.len(), &|index| {
        coverage.share(|cell| cell.lead == index)
    });
    let mut text = format!(
        "Lowest shares: from the {} ({}), {}-high ({}), lead {:.2} s ({}).\nThe widest gaps:\n",
        direction_name(coverage, direction),
        percent(of_direction),
        HEIGHTS[height].0,
        percent(of_height),
        LEADS[lead],
        percent(of_lead),
    );
    let gaps = coverage.gaps();
    for gap in gaps.iter().take(NAMED) {
        let _ = writeln!(
            text,
            "  {}-high from the {}: {} avoided; with a lead of {:.2} s {}, against {} of all attacks with that lead",
            HEIGHTS[gap.cell.height].0,
            direction_name(coverage, gap.cell.direction),
            percent(gap.any_lead),
            LEADS[gap.cell.lead],
            percent(gap.share),
            percent(gap.others),
        );
    }
    match gaps.first() {
        Some(gap) if gap.is_certain => {
            let _ = writeln!(text, "Capture next: {}.", advice(coverage, gap));
        }
        _ => text.push_str(
            "No gap is statistically significant. More --attacks show what to capture next.\n",
        ),
    }
    text
}
