//! `sabaki coverage --by-time`: how late may an attack be seen?

use crate::measure::by_time::{AvoidedCount, CONTACTS, TimeRow};
use crate::measure::why_hit::Cause;
use sabaki::maps::BakedGraph;
use sabaki::math::in_parallel;
use sabaki::query::{Answer, Query, QueryContext, QuerySettings};
use sabaki_fixtures::balls::{BallSettings, BallThrower, Part};
use serde_json::{Map, Value, json};

use super::{Failure, cancel, output};
use sabaki_fixtures::throw::RandomDraw;

/// Balls of each contact: how many, where they begin, and by how many threads they are answered.
#[derive(Clone, Copy)]
pub(super) struct Balls {
    pub(super) attacks: u64,
    pub(super) seed: u64,
    pub(super) threads: usize,
}

/// Throws the balls of every contact.
pub(super) fn throw_all(balls: Balls, baked: &BakedGraph) -> Result<Vec<TimeRow>, Failure> {
    /// Balls that one thread takes at a time.
    const BATCH: u64 = 50;
    let bar = output::progress("throwing", balls.attacks * CONTACTS.len() as u64);
    let thrower = BallThrower::new(baked, BallSettings::default());
    let settings = QuerySettings::default();
    let query = Query::new(baked, &settings);
    let batches = balls.attacks.div_ceil(BATCH);
    let of_batch = |number: usize| -> Result<TimeRow, Failure> {
        let contact = CONTACTS[number / batches as usize];
        let first = number as u64 % batches * BATCH;
        let mut row = TimeRow {
            contact,
            ..TimeRow::default()
        };
        let (mut context, mut answer) = (QueryContext::default(), Answer::default());
        for index in first..(first + BATCH).min(balls.attacks) {
            cancel::check()?;
            let thrown = thrower.throw(
                contact,
                RandomDraw {
                    seed: balls.seed,
                    index,
                },
            );
            let thrown = thrown.map_err(|error| Failure::Attack {
                index: index as usize,
                error,
            })?;
            bar.inc(1);
            let Some(thrown) = thrown else { continue };
            let throw = &thrown.throw;
            query.answer(throw.request(), &mut context, &mut answer);
            row.add(baked, &thrown, &answer);
        }
        Ok(row)
    };
    let found = in_parallel(balls.threads, batches as usize * CONTACTS.len(), of_batch);
    bar.finish_and_clear();
    let mut rows = CONTACTS.map(|contact| TimeRow {
        contact,
        ..TimeRow::default()
    });
    for (number, batch) in found.into_iter().enumerate() {
        rows[number / batches as usize] += batch?;
    }
    Ok(rows.to_vec())
}

pub(super) fn document(rows: &[TimeRow]) -> Value {
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
            "hits": Cause::ALL.into_iter().zip(row.causes.counts)
                .map(|(cause, count)| (cause.name().replace(' ', "_"), json!(count)))
                .collect::<Map<_, _>>(),
            "short_by_m": row.causes.short_by().map(round),
        })
    };
    json!({ "by_time": rows.iter().map(row).collect::<Vec<_>>() })
}

pub(super) fn text(rows: &[TimeRow]) -> String {
    let names = Part::ALL.map(Part::name);
    let head = ["contact after", "attacks", "avoided", "95% interval"];
    let head: Vec<&str> = head
        .into_iter()
        .chain(names)
        .chain(["walking", "walks on"])
        .chain(Cause::ALL.map(Cause::name))
        .chain(["short by"])
        .collect();
    let mut table = output::table(&head, 0);
    let percent = |share: AvoidedCount| match share.attacks {
        0 => "-".to_owned(),
        _ => format!("{:.0}%", 100.0 * share.value()),
    };
    for row in rows {
        let [low, high] = row.all.interval().map(|end| 100.0 * end);
        let first = [
            format!("{:.2} s", row.contact),
            row.all.attacks.to_string(),
            percent(row.all),
            format!("{low:.0}-{high:.0}%"),
        ];
        let parts = row.parts.map(percent);
        let counts = row.causes.counts.map(|count| count.to_string());
        let short = row.causes.short_by();
        let short = short.map_or("-".to_owned(), |metres| format!("{:.1} cm", 100.0 * metres));
        let shares = parts
            .into_iter()
            .chain([row.walking, row.walking_on].map(percent));
        table.add_row(first.into_iter().chain(shares).chain(counts).chain([short]));
    }
    format!(
        "Balls of radius 0.1 m at 8 m/s that would hit the continued motion. They are visible for the last 2.5 m of their flight, from the query on:\n{table}\n\
         The last columns count the hits by reason. no plausible entry: no evasion can be entered plausibly. no time: no evasion gets\n\
         far enough in time. feet, too short: the best candidate leaves a leg, or another part of the body, in the way. short by: mean\n\
         depth of these hits.\n"
    )
}
