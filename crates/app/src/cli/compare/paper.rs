//! `compare --paper`: the paper's Table 1, with its maps and its settings.
//!
//! Source: Masaoka & Oshita, section 6, Table 1. Their motion lasts 2:40 and has 8 evasions.

use sabaki::maps::{BakedGraph, MapGrid};
use sabaki::query::{CullPath, EntryUse, Enumerate, QuerySettings, RateSettings, WarpSettings};
use serde_json::json;

use super::{Row, compared, exhaustive, measure};
use crate::cli::culling::{self, Culling, DeviceArgs};
use crate::cli::queries::{Method, random_throws};
use crate::cli::{Done, Failure, bake, output};

/// Number of the paper's attacks.
const PAPER: usize = 6;

/// Settings of the paper: no entries, no layers, no warps, only candidates in time.
fn settings(method: Method) -> QuerySettings {
    QuerySettings {
        entries: EntryUse::none(),
        warp: WarpSettings::off(),
        rates: RateSettings {
            nearest: 0.0,
            ..RateSettings::default()
        },
        ..method.settings()
    }
}

/// Milliseconds of the paper; `None` for a path that it does not have.
fn paper_ms(method: Method) -> Option<u32> {
    match (method.cull, method.enumerate.uses_grid()) {
        (CullPath::None, false) => Some(496),
        (CullPath::Stencil, false) => Some(225),
        (CullPath::None, true) => Some(18),
        (CullPath::Stencil, true) => Some(14),
        _ => None,
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
    let paths = compared(&culling);
    let grids = [Enumerate::Whole, Enumerate::NearestCell];
    let methods = grids.into_iter().flat_map(|enumerate| {
        let method = move |&cull| Method::new(cull, exhaustive(cull), enumerate);
        paths.iter().map(method)
    });
    let rows = measure(baked, &throws, methods.collect(), settings, &mut culling)?;
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
            "cull": row.method.cull.name(),
            "grid": row.method.grid_name(),
            "candidates": row.per_attack(row.tally.candidates()),
            "kept": row.per_attack(row.tally.kept()),
            "weak": row.tally.weak(),
            "wrong": row.tally.wrong(),
            "avoided": row.avoided(),
            "ms_of_6": row.mean_ms(PAPER),
            "ms_of_all": row.mean_ms(row.runs.len()),
            "paper_ms": paper_ms(row.method),
        })
    };
    Done::json(
        &json!({ "attacks": rows[0].runs.len(), "rows": rows.iter().map(row).collect::<Vec<_>>() }),
    )
}

fn to_text(baked: &BakedGraph, culling: &Culling, rows: &[Row]) -> String {
    let mean = |row: &Row, count: usize| format!("{:.1}", row.per_attack(count));
    let percent = |share: f64| format!("{:.0}%", 100.0 * share);
    let ms = |row: &Row, attacks: usize| format!("{:.2}", row.mean_ms(attacks));
    let table = output::table_of(
        2,
        rows,
        &[
            ("grid", &|row| row.method.grid_name().to_owned()),
            ("culled by", &|row| row.method.cull.name().to_owned()),
            ("candidates", &|row| mean(row, row.tally.candidates())),
            ("kept", &|row| match row.method.cull {
                CullPath::None => String::new(),
                _ => mean(row, row.tally.kept()),
            }),
            ("weak", &|row| percent(row.tally.weak())),
            ("wrong", &|row| percent(row.tally.wrong())),
            ("avoided", &|row| row.avoided().to_string()),
            ("ms of 6", &|row| ms(row, PAPER)),
            ("ms of all", &|row| ms(row, row.runs.len())),
            ("paper ms", &|row| {
                paper_ms(row.method).map_or(String::new(), |ms| ms.to_string())
            }),
        ],
    );
    format!(
        "{}{}\n\nAs in the paper: slabs of 0.30 m without time, no entries, layers or warps, the nearest cell,\n\
         every kept candidate tested over the whole attack. The mean of 6 attacks, and of all {}:\n{table}\n\
         The paper: 2:40 of motion, 8 evasions, 6 attacks; without the grid about 100 candidates, 70 kept;\n\
         with it about 5, 3 kept; the grid is used in about 90% of the attacks.\n",
        bake::headline(baked),
        culling.describe(compared(culling)),
        rows[0].runs.len(),
    )
}
