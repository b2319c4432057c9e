//! The first frame of a crowd, and values that are read back from its poses.

use std::hint::black_box;
use std::time::Instant;

use sabaki::crowd::{Layout, LevelId, MemberId, PoseSlice};
use sabaki_app::percentile::percentile;
use serde_json::{Value, json};

use super::cases::{Case, Motion, TimedWork};
use super::scene::{PosedCrowd, Scene};
use super::{Args, usage};
use crate::cli::{Failure, cancel};

/// Medians of new crowds.
pub(super) struct Beginning {
    /// Time of the first frame, in milliseconds.
    first_frame: f64,
    /// Time to read one value of a joint, in nanoseconds: from blocks, from rows.
    read_value: [f64; 2],
}

/// Number of crowds that are created.
const CROWDS: usize = 9;

impl Scene {
    /// Measures crowds of which no character was ever posed, on one thread.
    pub(super) fn measure_beginning(&self, args: &Args) -> Result<Beginning, Failure> {
        let first = Case {
            what: TimedWork::Frame(Motion::Still),
            ..Case::plain()
        };
        let first_frame = median(|| {
            let mut posed = PosedCrowd::new(self.crowd(args, first)?.0);
            let started = Instant::now();
            self.step(&mut posed, first, 0)?;
            Ok(started.elapsed().as_secs_f64() * 1e3)
        })?;
        let read = |layout| median(|| self.read_value(args, layout));
        Ok(Beginning {
            first_frame,
            read_value: [read(Layout::Blocks)?, read(Layout::Rows)?],
        })
    }

    /// Nanoseconds to read a coordinate of a joint's position, averaged over all joints of all characters.
    fn read_value(&self, args: &Args, layout: Layout) -> Result<f64, Failure> {
        let case = Case {
            layout,
            ..Case::plain()
        };
        let mut posed = PosedCrowd::new(self.crowd(args, case)?.0);
        self.step(&mut posed, case, 0)?;
        let PosedCrowd { crowd, out } = &posed;
        let ids = (0..args.count).map(|index| crowd.pose_slice(MemberId(index)));
        let slices: Vec<PoseSlice> = ids.collect::<Result<_, _>>().map_err(usage)?;
        let (joints, coordinates) = (
            self.animations.joints(LevelId(0)),
            args.form().position_numbers(),
        );
        let started = Instant::now();
        let mut sum = 0.0;
        for slice in &slices {
            for joint in 0..joints {
                sum += coordinates
                    .map(|number| slice.number(out, joint, number))
                    .iter()
                    .sum::<f32>();
            }
        }
        black_box(sum);
        let values = slices.len() * joints * coordinates.len();
        Ok(started.elapsed().as_secs_f64() * 1e9 / values as f64)
    }
}

impl Beginning {
    pub(super) fn to_json(&self) -> Value {
        let [blocks, rows] = self.read_value;
        json!({
            "first_frame_ms": self.first_frame,
            "read_value_ns": { "blocks": blocks, "rows": rows },
        })
    }

    pub(super) fn describe(&self) -> String {
        let [blocks, rows] = self.read_value;
        format!(
            "first frame of a new crowd, levels by distance, on one thread: {:.3} ms; a coordinate of a joint read back: {blocks:.2} ns from \
             blocks, {rows:.2} from rows",
            self.first_frame
        )
    }
}

/// The median of measurements of new crowds.
fn median(measure: impl Fn() -> Result<f64, Failure>) -> Result<f64, Failure> {
    let mut values = Vec::with_capacity(CROWDS);
    for _ in 0..CROWDS {
        cancel::check()?;
        values.push(measure()?);
    }
    Ok(percentile(values, 0.5))
}
