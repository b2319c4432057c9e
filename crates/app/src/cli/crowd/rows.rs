//! What was measured, as text and as JSON.

use std::fmt::Write;

use sabaki::crowd::{Form, Layout};
use serde_json::{Value, json};

use super::Args;
use super::cases::{CUTS, Case, Lod, What};
use super::scene::{ABREAST, APART, Scene};
use crate::cli::output;

pub(super) struct Row {
    pub(super) case: Case,
    pub(super) clips: usize,
    /// Joints of a character; the mean, where levels differ.
    pub(super) joints: f64,
    pub(super) ms: f64,
}

impl Row {
    fn isa(&self) -> String {
        format!("{:?}", self.case.isa).to_lowercase()
    }

    fn layout(&self) -> &'static str {
        match self.case.layout {
            Layout::Blocks => "blocks",
            Layout::Rows => "rows",
        }
    }

    /// Nanoseconds for a joint of a character.
    fn per_joint(&self, args: &Args) -> f64 {
        self.ms * 1e6 / (self.joints * f64::from(args.count))
    }

    /// How many times as fast as posing all joints in blocks, on the same instruction set and number of threads; of cut
    /// clips, as one of them.
    fn against_plain(&self, rows: &[Self]) -> f64 {
        let plain = Case {
            what: What::Pose,
            lod: Lod::Off,
            layout: Layout::Blocks,
            cut: self.case.cut.map(|_| CUTS[0]),
            ..self.case
        };
        let plain = rows.iter().find(|row| row.case == plain);
        plain.map_or(1.0, |plain| plain.ms / self.ms)
    }

    pub(super) fn to_json(&self, args: &Args, rows: &[Self]) -> Value {
        json!({
            "what": self.case.what.name(),
            "camera": self.case.what.camera(),
            "clips": self.clips,
            "layout": self.layout(),
            "form": match args.form() {
                Form::Matrices => "matrices",
                Form::Rotations => "rotations",
            },
            "lod": self.case.lod.name(),
            "isa": self.isa(),
            "threads": self.case.threads,
            "count": args.count,
            "joints": self.joints,
            "ms": self.ms,
            "ns_per_joint": self.per_joint(args),
            "against_plain": self.against_plain(rows),
        })
    }
}

pub(super) fn describe(args: &Args, scene: &Scene, rows: &[Row]) -> String {
    let head = [
        "what",
        "camera",
        "levels",
        "clips",
        "layout",
        "registers",
        "threads",
        "joints",
        "ms",
        "ns a joint",
        "against all joints",
    ];
    let mut table = output::table(&head, 6);
    for row in rows {
        table.add_row(vec![
            row.case.what.name().to_owned(),
            row.case.what.camera().to_owned(),
            row.case.lod.name(),
            row.clips.to_string(),
            row.layout().to_owned(),
            row.isa(),
            row.case.threads.to_string(),
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
