//! One measurement.

use sabaki::crowd::{Form, Layout};
use serde_json::{Value, json};

use super::Args;
use super::cases::{CUTS, Case, Lod, Mixed, TimedWork};

/// The time of one case.
pub(super) struct Row {
    pub(super) case: Case,
    pub(super) clips: usize,
    /// Joints of a character; the mean, where levels differ.
    pub(super) joints: f64,
    pub(super) ms: f64,
    /// Error of held poses, if the case holds characters.
    pub(super) held: Option<HeldError>,
}

/// Distances on the screen between the joints of held characters and where they are without hold, at 1080 lines and 60 degrees.
pub(super) struct HeldError {
    /// Distance of the joint that is furthest off, in pixels.
    pub(super) greatest_pixels: f64,
    /// Mean over characters of each one's joint that is furthest off.
    pub(super) mean_pixels: f64,
}

impl Row {
    pub(super) fn isa(&self) -> String {
        format!("{:?}", self.case.isa).to_lowercase()
    }

    pub(super) fn layout(&self) -> &'static str {
        match self.case.layout {
            Layout::Blocks => "blocks",
            Layout::Rows => "rows",
            Layout::Instances => "instances",
        }
    }

    /// Nanoseconds for a joint of a character.
    pub(super) fn per_joint(&self, args: &Args) -> f64 {
        self.ms * 1e6 / (self.joints * f64::from(args.count))
    }

    /// How many times as fast as posing all joints in blocks, on the same instruction set and number of threads; of cut
    /// clips, as one of them; beside busy threads, as on one thread.
    pub(super) fn against_plain(&self, rows: &[Self]) -> f64 {
        let plain = Case {
            what: TimedWork::Pose,
            lod: Lod::Off,
            layout: Layout::Blocks,
            cut: self.case.cut.map(|_| CUTS[0]),
            mixed: Mixed::Nothing,
            hold: 0,
            threads: match self.case.busy {
                0 => self.case.threads,
                _ => 1,
            },
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
            "mixed": self.case.mixed.name(),
            "lod": self.case.lod.name(),
            "isa": self.isa(),
            "threads": self.case.threads,
            "busy_threads": self.case.busy,
            "hold_frames": self.case.hold,
            "hold_error_pixels": self.held.as_ref().map(|held| json!({
                "greatest": held.greatest_pixels,
                "mean": held.mean_pixels,
            })),
            "count": args.count,
            "joints": self.joints,
            "ms": self.ms,
            "ns_per_joint": self.per_joint(args),
            "against_plain": self.against_plain(rows),
        })
    }
}
