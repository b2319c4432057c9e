//! Where the keys of a clip stand among those of all clips.

use super::moment::Cycle;

/// Keys that a column repeats from its beginning after its end: a window that starts at the last interval goes on at the
/// first, and no window ends beyond its column.
pub(super) const SPARE: usize = 64;

/// A clip's intervals, on every level the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ClipRange {
    /// Rows of all clips before it.
    pub(super) row: usize,
    /// Keys of one column of all clips before it.
    pub(super) column: usize,
    /// Frames of all clips before it, without the last one of each.
    pub(super) frame: usize,
    /// Intervals between frames; at least one.
    pub(super) frames: usize,
    /// Intervals between keys; at least one.
    pub(super) intervals: usize,
    /// Frames per second.
    pub(super) rate: f64,
    /// `frames` and `intervals` for kernels.
    pub(super) frame_cycle: Cycle<f32>,
    pub(super) key_cycle: Cycle<f32>,
}

impl ClipRange {
    /// The clip after `before`, of so many keys from each frame to the next, and frames per second.
    pub(super) fn after(before: Option<&Self>, keys_of_frames: &[u32], rate: f64) -> Self {
        let (row, column, frame) = match before {
            Some(range) => (
                range.row + range.keys(),
                range.column + range.stride(),
                range.frame + range.frames,
            ),
            None => (0, 0, 0),
        };
        let keys: u32 = keys_of_frames.iter().sum();
        let (frames, intervals) = (keys_of_frames.len().max(1), keys.max(1) as usize);
        Self {
            row,
            column,
            frame,
            frames,
            intervals,
            rate,
            frame_cycle: Cycle::of(frames),
            key_cycle: Cycle::of(intervals),
        }
    }

    /// Whether each frame has one key.
    #[inline(always)]
    pub(super) fn is_even(&self) -> bool {
        self.frames == self.intervals
    }

    /// Frames in so many seconds.
    pub(super) fn per_second(&self, seconds: f32) -> f64 {
        f64::from(seconds) * self.rate
    }

    /// A position in frames as a time, in seconds.
    pub(super) fn seconds(&self, at: f32) -> f32 {
        (f64::from(at) / self.rate) as f32
    }

    /// A position in frames, wrapped into the clip; 0 for what is not finite.
    pub(super) fn wrapped(&self, at: f64) -> f32 {
        let length = self.frames as f64;
        let rest = at - (at / length).floor() * length;
        if rest > 0.0 {
            rest.min(length) as f32
        } else {
            0.0
        }
    }

    /// Keys of a column, without those that are repeated.
    pub(super) fn keys(&self) -> usize {
        self.intervals + 1
    }

    /// Keys from column to column.
    pub(super) fn stride(&self) -> usize {
        self.keys() + SPARE
    }
}
