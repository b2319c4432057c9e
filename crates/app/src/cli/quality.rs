//! A table of how human composed motions are, beside the clips.

use crate::measure::quality::Quality;
use sabaki_app::percentile::percentile;
use serde_json::{Value, json};

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
        let of = |quality: &Quality| row.value(quality);
        let cell = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.2}"));
        let ratio = match (of(clips), of(composed)) {
            (Some(clip), Some(value)) if clip > 0.0 => format!("{:.2}", value / clip),
            _ => "-".to_owned(),
        };
        table.add_row([
            row.name.to_owned(),
            cell(of(clips)),
            cell(of(composed)),
            ratio,
        ]);
    }
    let samples = composed.velocities.len();
    format!(
        "Motion quality of {what} beside that of the clips ({samples} velocities at the clips' frame rate):\n{table}\n"
    )
}

/// The measurements as JSON.
pub(super) fn document(clips: &Quality, composed: &Quality) -> Value {
    let of = |quality: &Quality| {
        let value = |row: &Row| json!(row.value(quality));
        let rows = ROWS.iter().map(|row| (row.key.to_owned(), value(row)));
        rows.collect::<serde_json::Map<_, _>>()
    };
    json!({ "clips": of(clips), "composed": of(composed) })
}
