//! Writes rounded frames as the bytes of a compressed clip.

use super::bits::{BitWriter, width_of};
use super::quantiser::{Quantised, Truth};
use super::{Groups, MOST_ROOT_BITS, SEGMENT};
use crate::math::code_rows::{CODES, MOST_BITS, ROW_BYTES};

/// The bytes of a clip, or `None` if a code is too wide.
pub(super) fn bytes(truth: &Truth<'_>, quantised: &Quantised) -> Option<Vec<u8>> {
    let source = Source { truth, quantised };
    let mut writer = BitWriter::default();
    for segment in source.segments() {
        let (rows, root) = segment.widths.split_at(segment.widths.len() - 3);
        let fits = rows.iter().all(|&width| width <= MOST_BITS)
            && root.iter().all(|&width| width <= MOST_ROOT_BITS);
        if !fits {
            return None;
        }
        segment.write(&mut writer);
    }
    writer.extend(&[0; ROW_BYTES]);
    Some(writer.finish())
}

struct Source<'a> {
    truth: &'a Truth<'a>,
    quantised: &'a Quantised,
}

/// Frames of a segment: all rows' values, then the root's.
struct Segment {
    groups: Groups,
    widths: Vec<u8>,
    bases: Vec<i32>,
    /// Values of each frame, in the order of `bases`.
    frames: Vec<Vec<i32>>,
}

impl Source<'_> {
    fn groups(&self) -> Groups {
        let truth = self.truth;
        let joints = truth.skeleton.len();
        Groups::new(
            truth.lanes.len(),
            if truth.moves_joints { joints } else { 0 },
        )
    }

    fn segments(&self) -> impl Iterator<Item = Segment> + '_ {
        let frames = self.quantised.roots.len();
        let firsts = (0..frames).step_by(SEGMENT);
        firsts.map(move |first| {
            let frames = (first..frames.min(first + SEGMENT)).map(|frame| self.values(frame));
            Segment::new(self.groups(), frames.collect())
        })
    }

    /// All values of a frame: rows of rotations, rows of translations, the root.
    fn values(&self, frame: usize) -> Vec<i32> {
        let lanes = self.truth.lanes.len();
        let mut values = Vec::new();
        let rotations = &self.quantised.rotations[frame * lanes..(frame + 1) * lanes];
        push_rows(rotations, &mut values);
        if self.truth.moves_joints {
            let joints = self.truth.skeleton.len();
            let places = &self.quantised.translations[frame * joints..(frame + 1) * joints];
            push_rows(places, &mut values);
        }
        values.extend(self.quantised.roots[frame]);
        values
    }
}

/// Appends values row by row to `out`, with 0 in unused lanes.
fn push_rows<const ROWS: usize>(values: &[[i32; ROWS]], out: &mut Vec<i32>) {
    for group in values.chunks(CODES) {
        for row in 0..ROWS {
            let lanes = (0..CODES).map(|lane| group.get(lane).map_or(0, |value| value[row]));
            out.extend(lanes);
        }
    }
}

impl Segment {
    fn new(groups: Groups, frames: Vec<Vec<i32>>) -> Self {
        let of_all = |choose: fn(i32, i32) -> i32| -> Vec<i32> {
            let mut values = frames[0].clone();
            for frame in &frames[1..] {
                for (value, other) in values.iter_mut().zip(frame) {
                    *value = choose(*value, *other);
                }
            }
            values
        };
        let (bases, most) = (of_all(i32::min), of_all(i32::max));
        let ranges: Vec<u32> = bases
            .iter()
            .zip(&most)
            .map(|(base, most)| most.abs_diff(*base))
            .collect();
        let (rows, root) = ranges.split_at(ranges.len() - 3);
        let rows = rows
            .chunks(CODES)
            .map(|row| row.iter().copied().max().unwrap_or(0));
        let widths = rows.chain(root.iter().copied()).map(width_of).collect();
        Self {
            groups,
            widths,
            bases,
            frames,
        }
    }

    fn write(&self, writer: &mut BitWriter) {
        writer.extend(&self.widths);
        let rotations = CODES * self.groups.rows()[0];
        for &base in &self.bases[..rotations] {
            writer.extend(&(base as i16).to_le_bytes());
        }
        for base in &self.bases[rotations..] {
            writer.extend(&base.to_le_bytes());
        }
        let rows = self.bases.len() - 3;
        for frame in &self.frames {
            for (index, (value, base)) in frame.iter().zip(&self.bases).enumerate() {
                let width = match index < rows {
                    true => self.widths[index / CODES],
                    false => self.widths[rows / CODES + index - rows],
                };
                writer.push(value.abs_diff(*base), width);
            }
            writer.align();
        }
    }
}
