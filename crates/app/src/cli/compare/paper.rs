//! `compare --paper`: the paper's Table 1, with its maps and its settings.
//!
//! Source: Masaoka & Oshita, section 6, Table 1. Their motion lasts 2:40 and has 8 evasions.

use sabaki::maps::{BakedGraph, MapGrid};
use sabaki::query::{
    CullPath, EntryUse, Enumerate, Evaluation, QuerySettings, RateSettings, WarpSettings,
};
use serde_json::json;

use super::{GroundTruth, MapTally, path_name};
use crate::cli::culling::{self, Culling, DeviceArgs};
use crate::cli::queries::{Method, QueryRunner, Run, random_throws};
use crate::cli::{Done, Failure, bake, cancel, output};

/// Number of the paper's attacks.
const PAPER: usize = 6;

/// A row of the table.
struct Row {
    method: Method,
    /// Milliseconds of the paper; `None` for a path that it does not have.
    paper_ms: Option<u32>,
    runs: Vec<Run>,
    tally: MapTally,
}

impl Row {
    fn new(cull: CullPath, enumerate: Enumerate) -> Self {
        let evaluation = match cull {
            CullPath::Exact => Evaluation::Exhaustive,
            _ => Evaluation::Kept,
        };
        Self {
            method: Method::new(cull, evaluation, enumerate),
            paper_ms: match (cull, enumerate.uses_grid()) {
                (CullPath::Exact, false) => Some(496),
                (CullPath::Stencil, false) => Some(225),
                (CullPath::Exact, true) => Some(18),
                (CullPath::Stencil, true) => Some(14),
                _ => None,
            },
            runs: Vec::new(),
            tally: MapTally::default(),
        }
    }

    /// Settings of the paper: no entries, no layers, no warps, only candidates in time, the nearest cell.
    fn settings(&self) -> QuerySettings {
        QuerySettings {
            entries: EntryUse::none(),
            warp: WarpSettings::off(),
            rates: RateSettings {
                nearest: 0.0,
                ..RateSettings::default()
            },
            ..self.method.settings()
        }
    }

    /// Mean over the first attacks.
    fn mean(&self, attacks: usize, value: impl Fn(&Run) -> f64) -> f64 {
        let runs = &self.runs[..attacks.min(self.runs.len())];
        runs.iter().map(value).sum::<f64>() / runs.len().max(1) as f64
    }

    fn per_attack(&self, count: usize) -> f64 {
        count as f64 / self.runs.len().max(1) as f64
    }
}

/// Answers the attacks with the paper's maps and settings.
pub(super) fn run(
    baked: &BakedGraph,
    attacks: u64,
    seed: u64,
    device: &DeviceArgs,
    as_json: bool,
) -> Result<Done, Failure> {
    let drawn = baked.with_maps(MapGrid::PAPER);
    let baked = &drawn.map_err(Failure::Bake)?;
    let mut culling = Culling::new(culling::open(device)?, baked.atlas());
    let throws = random_throws(baked, seed, 0..attacks)?;
    let paths = culling.paths();
    let with = |enumerate: Enumerate| paths.iter().map(move |&cull| Row::new(cull, enumerate));
    let mut rows: Vec<Row> = with(Enumerate::Whole)
        .chain(with(Enumerate::NearestCell))
        .collect();
    let mut runners: Vec<QueryRunner<'_>> = rows.iter().map(|_| QueryRunner::new(baked)).collect();
    let bar = output::progress("comparing", throws.len() as u64);
    // The first attack twice: memory is filled when times begin to count.
    for (count, throw) in throws[..1].iter().chain(&throws).enumerate() {
        cancel::check()?;
        for (row, runner) in rows.iter_mut().zip(&mut runners) {
            runner.records_rounds = true;
            let settings = row.settings();
            let run = runner.ask(row.method, &settings, throw, &mut culling)?;
            if count > 0 {
                row.runs.push(run);
            }
        }
        if count > 0 {
            let references = rows.iter().zip(&runners);
            let references = references.filter(|(row, _)| row.method.cull == CullPath::Exact);
            let truth = GroundTruth::new(
                references.map(|(_, runner)| (&runner.answer, runner.rounds.as_slice())),
            );
            for (row, runner) in rows.iter_mut().zip(&runners) {
                truth.compare(&runner.rounds, &mut row.tally);
            }
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    let text = if as_json {
        to_json(&rows)
    } else {
        to_text(baked, &culling, &rows)
    };
    Ok(Done::ok(text))
}

fn to_json(rows: &[Row]) -> String {
    let row = |row: &Row| {
        json!({
            "cull": path_name(row.method.cull),
            "grid": row.method.grid_name(),
            "candidates": row.per_attack(row.tally.candidates()),
            "kept": row.per_attack(row.tally.kept()),
            "weak": row.tally.weak(),
            "wrong": row.tally.wrong(),
            "avoided": row.runs.iter().filter(|run| run.avoided).count(),
            "ms_of_6": row.mean(PAPER, Run::query_ms),
            "ms_of_all": row.mean(row.runs.len(), Run::query_ms),
            "paper_ms": row.paper_ms,
        })
    };
    Done::json(
        &json!({ "attacks": rows[0].runs.len(), "rows": rows.iter().map(row).collect::<Vec<_>>() }),
    )
}

fn to_text(baked: &BakedGraph, culling: &Culling, rows: &[Row]) -> String {
    let head = [
        "grid",
        "culled by",
        "candidates",
        "kept",
        "weak",
        "wrong",
        "avoided",
        "ms of 6",
        "ms of all",
        "paper ms",
    ];
    let mut table = output::table(&head, 2);
    for row in rows {
        let avoided = row.runs.iter().filter(|run| run.avoided).count();
        table.add_row([
            row.method.grid_name().to_owned(),
            path_name(row.method.cull).to_owned(),
            format!("{:.1}", row.per_attack(row.tally.candidates())),
            match row.method.cull {
                CullPath::Exact => String::new(),
                _ => format!("{:.1}", row.per_attack(row.tally.kept())),
            },
            format!("{:.0}%", 100.0 * row.tally.weak()),
            format!("{:.0}%", 100.0 * row.tally.wrong()),
            avoided.to_string(),
            format!("{:.2}", row.mean(PAPER, Run::query_ms)),
            format!("{:.2}", row.mean(row.runs.len(), Run::query_ms)),
            row.paper_ms.map_or(String::new(), |ms| ms.to_string()),
        ]);
    }
    format!(
        "{}{}\n\nAs in the paper: slabs of 0.30 m without time, no entries, layers or warps, the nearest cell,\n\
         every kept candidate tested over the whole attack. The mean of 6 attacks, and of all {}:\n{table}\n\
         The paper: 2:40 of motion, 8 evasions, 6 attacks; without the grid about 100 candidates, 70 kept;\n\
         with it about 5, 3 kept; the grid is used in about 90% of the attacks.\n",
        bake::headline(baked),
        culling.describe(culling.paths()),
        rows[0].runs.len(),
    )
}
