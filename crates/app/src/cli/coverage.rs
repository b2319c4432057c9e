//! `sabaki coverage`: which attacks does a graph have an answer to, and how much warning does a dodge need?

use std::fmt::Write;

use crate::measure::by_time::{AvoidedCount, CONTACTS, Cause, TimeRow};
use crate::measure::coverage::{Cell, Coverage, Gap, HEIGHTS, LEADS};
use sabaki::maps::BakedGraph;
use sabaki::math::in_parallel;
use sabaki::query::{Answer, Query, QueryContext, QuerySettings};
use sabaki_fixtures::balls::{BallThrower, Part};
use sabaki_fixtures::throw::{Aim, aimed};
use serde_json::{Map, Value, json};

use super::bake::{self, GraphArgs};
use super::numbers::{number, whole};
use super::{Done, Failure, cancel, output};

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    graph: GraphArgs,
    /// Number of attacks, at least one of each kind. Default: 2800; with --by-time: 400 for each time.
    #[arg(long, value_name = "N", value_parser = whole::<u64>(1..=1_000_000))]
    attacks: Option<u64>,
    /// Measures by the time from the query to the contact instead, with balls that would hit the continued motion.
    #[arg(long, conflicts_with_all = ["directions", "speed"])]
    by_time: bool,
    /// Seed of the random moments.
    #[arg(long, value_name = "S", default_value_t = 1, value_parser = whole::<u64>(0..=u64::MAX))]
    seed: u64,
    /// Number of directions.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = whole::<u64>(2..=36))]
    directions: u64,
    /// Speed of the balls, in metres per second.
    #[arg(long, value_name = "M/S", default_value_t = 10.0, value_parser = number(0.1..=1000.0))]
    speed: f32,
    /// Number of threads; 0: all of the machine. The result does not depend on it.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole::<u64>(0..=1024))]
    threads: u64,
}

/// Number of gaps that are described.
const NAMED: usize = 3;

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    cancel::listen();
    let baked = args.graph.load()?;
    let (mut document, text) = if args.by_time {
        let rows = throw_by_time(args, &baked)?;
        (time_document(&rows), time_text(&rows))
    } else {
        let coverage = throw_all(args, &baked)?;
        (document(&coverage), text(&coverage))
    };
    Ok(Done::ok(if as_json {
        document["graph"] = bake::statistics(&baked);
        Done::json(&document)
    } else {
        format!("{}\n{text}", bake::headline(&baked))
    }))
}

/// Throws at every cell, each time at the same moments.
fn throw_all(args: &Args, baked: &BakedGraph) -> Result<Coverage, Failure> {
    let mut coverage = Coverage::new(args.directions as usize);
    let cells = coverage.cells.len();
    /// One of each of 35 kinds from 8 directions, ten times.
    const ATTACKS: u64 = 2800;
    let each = (args.attacks.unwrap_or(ATTACKS) / cells as u64).max(1);
    let bar = output::progress("throwing", each * cells as u64);
    let settings = QuerySettings::default();
    let query = Query::new(baked, &settings);
    let of_cell = |number: usize| {
        let (mut context, mut answer) = (QueryContext::default(), Answer::default());
        let one = |index: u64| {
            cancel::check()?;
            let (cell, _) = coverage.cells[number];
            let aim = Aim {
                from: coverage.from(cell.direction),
                height: HEIGHTS[cell.height].1,
                lead: LEADS[cell.lead],
                speed: args.speed,
                radius: 0.1,
                distance: 2.0,
            };
            let moment = index * cells as u64 + number as u64;
            let throw = aimed(baked, &aim, args.seed, moment);
            let throw = throw.map_err(Failure::attack(index))?;
            query.answer(throw.request(), &mut context, &mut answer);
            bar.inc(1);
            Ok(answer.avoided)
        };
        (0..each).map(one).collect::<Result<Vec<bool>, Failure>>()
    };
    let results = in_parallel(args.threads as usize, cells, of_cell);
    bar.finish_and_clear();
    for ((_, count), avoided) in coverage.cells.iter_mut().zip(results) {
        avoided?.into_iter().for_each(|one| count.add(one));
    }
    Ok(coverage)
}

fn percent(share: f64) -> String {
    format!("{:.0}%", 100.0 * share)
}

fn document(coverage: &Coverage) -> Value {
    let name = |direction: usize| direction_name(coverage, direction);
    let cell = |&(cell, count): &(Cell, AvoidedCount)| {
        let [low, high] = count.interval();
        json!({
            "direction": name(cell.direction),
            "degrees": coverage.from(cell.direction).to_degrees(),
            "height": HEIGHTS[cell.height].0,
            "lead": LEADS[cell.lead],
            "attacks": count.attacks,
            "avoided": count.avoided,
            "share": count.value(),
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
    let (count, gaps) = (coverage.count(|_| true), coverage.gaps());
    let [low, high] = count.interval();
    let next = gaps.first().filter(|gap| gap.is_certain);
    json!({
        "attacks": count.attacks,
        "avoided": count.avoided,
        "share": count.value(),
        "low": low,
        "high": high,
        "cells": coverage.cells.iter().map(cell).collect::<Vec<_>>(),
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
        for direction in 0..coverage.directions {
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
    let count = coverage.count(|_| true);
    let AvoidedCount { attacks, avoided } = count;
    let [low, high] = count.interval().map(percent);
    let mut text = format!(
        "{avoided} of {attacks} attacks are avoided (95% interval: {low} to {high}). Shares by height, direction and lead\n\
         (time from the query to the throw):\n{table}\n\n"
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
    let (direction, of_direction) = least(coverage.directions, &|index| {
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
            "  {}-high from the {}: {} avoided; with a lead of {:.2} s {} ({} of all with that lead)",
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

/// Throws the balls of every contact.
fn throw_by_time(args: &Args, baked: &BakedGraph) -> Result<Vec<TimeRow>, Failure> {
    /// Number of balls for each time.
    const ATTACKS: u64 = 400;
    /// Balls that one thread takes at a time.
    const BATCH: u64 = 50;
    let attacks = args.attacks.unwrap_or(ATTACKS);
    let bar = output::progress("throwing", attacks * CONTACTS.len() as u64);
    let thrower = BallThrower::new(baked);
    let settings = QuerySettings::default();
    let query = Query::new(baked, &settings);
    let batches = attacks.div_ceil(BATCH);
    let empty = |contact| TimeRow {
        contact,
        ..TimeRow::default()
    };
    let of_batch = |number: usize| -> Result<TimeRow, Failure> {
        let contact = CONTACTS[number / batches as usize];
        let first = number as u64 % batches * BATCH;
        let mut row = empty(contact);
        let (mut context, mut answer) = (QueryContext::default(), Answer::default());
        for index in first..(first + BATCH).min(attacks) {
            cancel::check()?;
            let thrown = thrower.throw(contact, args.seed, index);
            let thrown = thrown.map_err(Failure::attack(index))?;
            bar.inc(1);
            let Some(thrown) = thrown else { continue };
            let throw = &thrown.throw;
            query.answer(throw.request(), &mut context, &mut answer);
            row.add(baked, &thrown, &answer);
        }
        Ok(row)
    };
    let found = in_parallel(
        args.threads as usize,
        batches as usize * CONTACTS.len(),
        of_batch,
    );
    bar.finish_and_clear();
    let mut rows = CONTACTS.map(empty);
    for (number, batch) in found.into_iter().enumerate() {
        rows[number / batches as usize] += batch?;
    }
    Ok(rows.to_vec())
}

fn time_document(rows: &[TimeRow]) -> Value {
    let round = |share: f64| (share * 1e4).round() / 1e4;
    // Nothing is known of what no ball was thrown at.
    let known = |share: AvoidedCount, value: f64| (share.attacks > 0).then(|| round(value));
    let avoided = |share: AvoidedCount| known(share, share.value());
    let interval = |share: AvoidedCount| share.interval().map(|end| known(share, end));
    let row = |row: &TimeRow| {
        let [low, high] = interval(row.all);
        let of_part = |part: Part| (part.name().to_owned(), row.parts[part as usize]);
        let parts = Part::ALL.map(of_part);
        let walking = row.walking;
        let [walking_low, walking_high] = interval(walking);
        json!({
            "contact_s": (f64::from(row.contact) * 1e3).round() / 1e3,
            "attacks": row.all.attacks,
            "avoided": avoided(row.all),
            "low": low,
            "high": high,
            "parts": parts.iter().cloned().map(|(name, share)| (name, json!(avoided(share)))).collect::<Map<_, _>>(),
            "parts_attacks": parts.iter().cloned().map(|(name, share)| (name, json!(share.attacks))).collect::<Map<_, _>>(),
            "walking": {
                "attacks": walking.attacks,
                "avoided": avoided(walking),
                "low": walking_low,
                "high": walking_high,
                "walks_on": avoided(row.walking_on),
            },
            "hits": Cause::ALL.into_iter().zip(row.causes)
                .map(|(cause, count)| (cause.name().replace(' ', "_"), json!(count)))
                .collect::<Map<_, _>>(),
            "short_by_m": row.short_by().map(round),
        })
    };
    json!({ "by_time": rows.iter().map(row).collect::<Vec<_>>() })
}

/// The shares that are avoided, and the hits by their reasons: a table each.
fn time_text(rows: &[TimeRow]) -> String {
    let head = ["contact after", "attacks", "avoided", "95% interval"].into_iter();
    let head = head.chain(Part::ALL.map(Part::name));
    let head: Vec<&str> = head.chain(["walking", "walks on"]).collect();
    let mut shares = output::table(&head, 0);
    let head = ["contact after", "hits"].into_iter();
    let head: Vec<&str> = head
        .chain(Cause::ALL.map(Cause::name))
        .chain(["short by"])
        .collect();
    let mut hits = output::table(&head, 0);
    let known = |share: AvoidedCount| match share.attacks {
        0 => "-".to_owned(),
        _ => percent(share.value()),
    };
    for row in rows {
        let [low, high] = row.all.interval().map(|end| 100.0 * end);
        let contact = format!("{:.2} s", row.contact);
        let first = [
            contact.clone(),
            row.all.attacks.to_string(),
            known(row.all),
            format!("{low:.0}-{high:.0}%"),
        ];
        let walking = [row.walking, row.walking_on].map(known);
        shares.add_row(first.into_iter().chain(row.parts.map(known)).chain(walking));
        let sum: u32 = row.causes.iter().sum();
        let counts = row.causes.map(|count| count.to_string());
        let short = row
            .short_by()
            .map_or("-".to_owned(), |metres| format!("{:.1} cm", 100.0 * metres));
        let first = [contact, sum.to_string()].into_iter();
        hits.add_row(first.chain(counts).chain([short]));
    }
    format!(
        "Balls of radius 0.1 m at 8 m/s that would hit the continued motion, seen for the last 2.5 m of their\n\
         flight, from the query on. Shares avoided, of all and by part; of a character that walks, and by its\n\
         upper body alone while it walks on:\n{shares}\n\n\
         The hits by reason. no plausible entry: no evasion can be entered plausibly. no time: no\n\
         evasion gets far enough. feet, too short: the best candidate leaves a leg, or another part of\n\
         the body, in the way. short by: mean depth of these hits.\n{hits}\n"
    )
}

/// The name of a direction, or its angle where it has no name.
fn direction_name(coverage: &Coverage, direction: usize) -> String {
    const NAMES: [&str; 8] = [
        "front",
        "front left",
        "left",
        "back left",
        "back",
        "back right",
        "right",
        "front right",
    ];
    let eighths = 8 * direction;
    if eighths.is_multiple_of(coverage.directions) {
        return NAMES[eighths / coverage.directions].to_owned();
    }
    format!("{:.0}° left", coverage.from(direction).to_degrees())
}
