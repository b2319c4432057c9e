//! Positions of a clip's keys among those of all clips.

use super::moment::Cycle;

/// Number of keys that a column repeats from its beginning after its end. A window that starts at the last interval
/// continues with the first keys, and no window reads beyond its column.
pub(super) const SPARE: usize = 64;

/// Position of a clip's keys among those of all clips; the same on every level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ClipRange {
    /// Number of rows of all clips before this one.
    pub(super) row: usize,
    /// Number of keys in one column of all clips before this one.
    pub(super) column: usize,
    /// Number of frames of all clips before this one, not counting the last frame of each.
    pub(super) frame: usize,
    /// Number of intervals between frames; at least 1.
    pub(super) frames: usize,
    /// Number of intervals between keys; at least 1.
    pub(super) intervals: usize,
    /// Frame rate, in frames per second.
    pub(super) rate: f64,
    /// `frames` and `intervals` in the form that kernels read.
    pub(super) frame_cycle: Cycle<f32>,
    pub(super) key_cycle: Cycle<f32>,
}

impl ClipRange {
    /// The range of the clip that follows `before`. It has `keys_of_frames` keys from each frame to the next, and `rate`
    /// frames per second.
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

    /// Number of frames in `seconds`.
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

    /// Number of keys of a column, not counting repeated ones.
    pub(super) fn keys(&self) -> usize {
        self.intervals + 1
    }

    /// Number of keys from the start of one column to the start of the next.
    pub(super) fn stride(&self) -> usize {
        self.keys() + SPARE
    }
}
