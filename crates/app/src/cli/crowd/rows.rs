//! The measurements as text.

use std::fmt::Write;

use super::Args;
use super::row::Row;
use super::scene::{ABREAST, APART, Scene};
use crate::cli::output;

pub(super) fn describe(args: &Args, scene: &Scene, rows: &[Row]) -> String {
    let head = [
        "what",
        "camera",
        "levels",
        "clips",
        "layout",
        "mixed in",
        "held frames",
        "held: pixels off",
        "registers",
        "threads",
        "busy beside",
        "joints",
        "ms",
        "ns a joint",
        "against all joints",
    ];
    let mut table = output::table(&head, 9);
    for row in rows {
        table.add_row(vec![
            row.case.what.name().to_owned(),
            row.case.what.camera().to_owned(),
            row.case.lod.name(),
            row.clips.to_string(),
            row.layout().to_owned(),
            row.case.mixed.name().to_owned(),
            row.case.hold.to_string(),
            row.held.as_ref().map_or_else(String::new, |held| {
                format!("{:.2}, most {:.1}", held.mean_pixels, held.greatest_pixels)
            }),
            row.isa(),
            row.case.threads.to_string(),
            row.case.busy.to_string(),
            format!("{:.2}", row.joints),
            format!("{:.3}", row.ms),
            format!("{:.2}", row.per_joint(args)),
            format!("{:.2} x", row.against_plain(rows)),
        ]);
    }
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{} characters, {} clips, {} levels, {:.1} MB of keys; medians of {} frames",
        args.count,
        scene.animations.clips(),
        scene.animations.levels(),
        scene.animations.bytes() as f64 * 1e-6,
        args.frames
    );
    let _ = writeln!(
        text,
        "distance: a column {ABREAST} abreast, {APART} m apart, seen from its head; at most {} pixels of error on the screen",
        args.error
    );
    let _ = writeln!(text, "{table}");
    text
}
