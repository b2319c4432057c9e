//! A table of how human composed motions are, beside the clips.

use crate::measure::quality::Quality;
use sabaki_app::percentile::percentile;
use serde_json::{Map, Value, json};

use super::output;

/// A row of the table: a percentile of measured values.
struct Row {
    key: &'static str,
    name: &'static str,
    values: fn(&Quality) -> &[f32],
    share: f64,
    /// Factor from the value's own unit to the table's.
    scale: f64,
}

impl Row {
    /// The value in the table's unit; `None` if nothing was measured.
    fn value(&self, quality: &Quality) -> Option<f64> {
        let values = (self.values)(quality);
        let all = || values.iter().copied().map(f64::from).collect();
        (!values.is_empty()).then(|| self.scale * percentile(all(), self.share))
    }

    fn cell(&self, quality: &Quality) -> String {
        let value = self.value(quality);
        value.map_or("-".to_owned(), |value| format!("{value:.2}"))
    }
}

const ROWS: [Row; 10] = [
    Row {
        key: "angular_velocity_p999",
        name: "joint velocity, rad/s, 99.9%",
        values: |quality| &quality.velocities,
        share: 0.999,
        scale: 1.0,
    },
    Row {
        key: "angular_acceleration_p999",
        name: "joint acceleration, rad/s², 99.9%",
        values: |quality| &quality.accelerations,
        share: 0.999,
        scale: 1.0,
    },
    Row {
        key: "centre_acceleration_p999",
        name: "centre of mass, m/s², 99.9%",
        values: |quality| &quality.pushes,
        share: 0.999,
        scale: 1.0,
    },
    Row {
        key: "centre_acceleration_most",
        name: "centre of mass, m/s², most",
        values: |quality| &quality.pushes,
        share: 1.0,
        scale: 1.0,
    },
    Row {
        key: "toe_speed_p999",
        name: "faster toe, m/s, 99.9%",
        values: |quality| &quality.toes,
        share: 0.999,
        scale: 1.0,
    },
    Row {
        key: "toe_speed_most",
        name: "faster toe, m/s, most",
        values: |quality| &quality.toes,
        share: 1.0,
        scale: 1.0,
    },
    Row {
        key: "slide_median_mm_s",
        name: "slower foot, mm/s, median",
        values: |quality| &quality.slides,
        share: 0.5,
        scale: 1e3,
    },
    Row {
        key: "slide_p90_mm_s",
        name: "slower foot, mm/s, 90%",
        values: |quality| &quality.slides,
        share: 0.9,
        scale: 1e3,
    },
    Row {
        key: "lowest_toe_cm",
        name: "lower toe, cm, lowest",
        values: |quality| &quality.heights,
        share: 0.0,
        scale: 1e2,
    },
    Row {
        key: "limb_overlap_most_cm",
        name: "limbs in each other, cm, most",
        values: |quality| &quality.overlaps,
        share: 1.0,
        scale: 1e2,
    },
];

/// The measurements of the clips beside those of motions composed of them, which `what` names.
pub(super) fn text(clips: &Quality, composed: &Quality, what: &str) -> String {
    let mut table = output::table(&["", "clips", what, "ratio"], 1);
    for row in ROWS {
        let ratio = match (row.value(clips), row.value(composed)) {
            (Some(clip), Some(value)) if clip > 0.0 => format!("{:.2}", value / clip),
            _ => "-".to_owned(),
        };
        table.add_row([
            row.name.to_owned(),
            row.cell(clips),
            row.cell(composed),
            ratio,
        ]);
    }
    let samples = composed.velocities.len();
    format!(
        "Motion quality of {what} beside that of the clips ({samples} velocities at the clips' frame rate):\n{table}\n"
    )
}

/// The measurements of several columns, the clips' first, each with its name.
pub(super) fn columns_text(columns: &[(&'static str, Quality)]) -> String {
    let names = columns.iter().map(|(name, _)| *name);
    let head: Vec<&str> = ["played"].into_iter().chain(names).collect();
    let mut table = output::table(&head, 1);
    for row in ROWS {
        let cells = columns.iter().map(|(_, quality)| row.cell(quality));
        table.add_row([row.name.to_owned()].into_iter().chain(cells));
    }
    let name = "centre of mass, % above the clips' most";
    let cell = |(_, quality): &_| format!("{:.2}", 100.0 * above(&columns[0].1, quality));
    let cells = columns.iter().map(cell);
    table.add_row([name.to_owned()].into_iter().chain(cells));
    format!("{table}\n")
}

/// Share of the accelerations of the centre of mass above the clips' largest.
fn above(clips: &Quality, quality: &Quality) -> f64 {
    let most = clips.pushes.iter().copied().fold(0.0, f32::max);
    let above = quality.pushes.iter().filter(|&&push| push > most).count();
    above as f64 / quality.pushes.len().max(1) as f64
}

/// [`columns_text`] as JSON.
pub(super) fn columns_document(columns: &[(&'static str, Quality)]) -> Value {
    let each = columns.iter().map(|(name, quality)| {
        let mut rows = rows(quality);
        let above = json!(above(&columns[0].1, quality));
        rows.insert("centre_above_clips".to_owned(), above);
        ((*name).to_owned(), Value::Object(rows))
    });
    Value::Object(each.collect())
}

/// The measurements as JSON.
pub(super) fn document(clips: &Quality, composed: &Quality) -> Value {
    json!({ "clips": rows(clips), "composed": rows(composed) })
}

fn rows(quality: &Quality) -> Map<String, Value> {
    let value = |row: &Row| json!(row.value(quality));
    let rows = ROWS.iter().map(|row| (row.key.to_owned(), value(row)));
    rows.collect()
}
