//! The time of a clip: where its keys are among those of all clips, and the keys around a moment.
//!
//! Time is counted in frames, which have equal durations. There is one key from each frame to the next, and more where a joint turns
//! fast. A moment between two frames lies between two of the keys there.

use crate::math::{F32x16, Lanes};

/// Number of keys that a column repeats from its beginning after its end. A window that starts at the last interval
/// continues with the first keys, and no window reads beyond its column.
pub(crate) const SPARE: usize = 64;

/// Position of a clip's keys among those of all clips; the same on every level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ClipRange {
    /// Number of rows of all clips before this one.
    pub(crate) row: usize,
    /// Number of keys in one column of all clips before this one.
    pub(crate) column: usize,
    /// Number of frames of all clips before this one, not counting the last frame of each.
    pub(crate) frame: usize,
    /// Number of intervals between frames; at least 1.
    pub(crate) frames: usize,
    /// Number of intervals between keys; at least 1.
    pub(crate) intervals: usize,
    /// Frame rate, in frames per second.
    pub(crate) rate: f64,
    /// `frames` and `intervals` in the form that kernels read.
    pub(crate) frame_cycle: Cycle<f32>,
    pub(crate) key_cycle: Cycle<f32>,
}

impl ClipRange {
    /// The range of the clip that follows `before`. It has `keys_of_frames` keys from each frame to the next, and `rate`
    /// frames per second.
    pub(crate) fn after(before: Option<&Self>, keys_of_frames: &[u32], rate: f64) -> Self {
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
            frame_cycle: Cycle::with_length(frames),
            key_cycle: Cycle::with_length(intervals),
        }
    }

    /// Whether each frame has one key.
    #[inline(always)]
    pub(crate) fn is_even(&self) -> bool {
        self.frames == self.intervals
    }

    /// Number of frames in `seconds`.
    pub(crate) fn per_second(&self, seconds: f32) -> f64 {
        f64::from(seconds) * self.rate
    }

    /// A position in frames as a time, in seconds.
    pub(crate) fn seconds(&self, at: f32) -> f32 {
        (f64::from(at) / self.rate) as f32
    }

    /// A position in frames, wrapped into the clip; 0 for what is not finite.
    pub(crate) fn wrapped(&self, at: f64) -> f32 {
        let length = self.frames as f64;
        let rest = at - (at / length).floor() * length;
        if rest > 0.0 {
            rest.min(length) as f32
        } else {
            0.0
        }
    }

    /// Number of keys of a column, not counting repeated ones.
    pub(crate) fn keys(&self) -> usize {
        self.intervals + 1
    }

    /// Number of keys from the start of one column to the start of the next.
    pub(crate) fn stride(&self) -> usize {
        self.keys() + SPARE
    }
}

/// The interval between frames, or between keys, that contains a moment, as a float, and the position in it from 0 to 1. One
/// of each for each lane.
#[derive(Clone, Copy)]
pub(crate) struct Moment<L> {
    pub(crate) interval: L,
    pub(crate) share: L,
}

impl<L: Lanes> Moment<L> {
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        let zero = L::splat(0.0);
        Self {
            interval: zero,
            share: zero,
        }
    }
}

/// Number of intervals of a clip, for each lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cycle<L> {
    length: L,
    /// 1 divided by `length`.
    inverse: L,
}

impl Cycle<f32> {
    /// The cycle of `length` intervals.
    pub(crate) fn with_length(length: usize) -> Self {
        let length = length as f32;
        Self {
            length,
            inverse: 1.0 / length,
        }
    }

    #[inline(always)]
    pub(crate) fn lanes<L: Lanes>(self) -> Cycle<L> {
        Cycle {
            length: L::splat(self.length),
            inverse: L::splat(self.inverse),
        }
    }
}

impl<L: Lanes> Cycle<L> {
    #[inline(always)]
    pub(crate) fn new(length: L) -> Self {
        Self {
            length,
            inverse: L::splat(1.0) / length,
        }
    }

    /// Wraps `value` into `0..length`; NaN becomes 0. By rounding, the result may be `length` itself, or 0 for values
    /// slightly below `length`.
    #[inline(always)]
    fn wrapped(self, value: L) -> L {
        let rest = value - (value * self.inverse).floor() * self.length;
        rest.max(L::splat(0.0)).min(self.length)
    }

    /// Wraps a whole number of intervals into `0..length`, exactly.
    #[inline(always)]
    pub(crate) fn wrapped_whole(self, value: L) -> L {
        // Half an interval is added, so that rounding does not reach another multiple of the length.
        let turns = ((value + L::splat(0.5)) * self.inverse).floor();
        value - turns * self.length
    }

    /// The moment at `time`, in intervals.
    ///
    /// No operation is fused, so that all machines find the same interval.
    #[inline(always)]
    pub(crate) fn moment(self, time: L) -> Moment<L> {
        let time = self.wrapped(time);
        let interval = time.floor().min(self.length - L::splat(1.0));
        Moment {
            interval,
            share: time - interval,
        }
    }
}

/// The keys from each frame of each clip to the next frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct FrameKeys(Vec<KeysOfFrame>);

#[derive(Clone, Copy, Debug)]
struct KeysOfFrame {
    /// Index of the first key in its clip.
    first: f32,
    count: f32,
}

impl FrameKeys {
    /// Adds a clip. `keys_of_frames` has the number of keys of each frame but the last.
    pub(crate) fn add(&mut self, keys_of_frames: &[u32]) {
        let mut first = 0;
        // A clip of one frame stands still for the duration of a frame.
        for &count in if keys_of_frames.is_empty() {
            &[1]
        } else {
            keys_of_frames
        } {
            self.0.push(KeysOfFrame {
                first: first as f32,
                count: count as f32,
            });
            first += count;
        }
    }

    /// The position of `time`, which is in frames, in intervals between keys. Both are counted from the clip's beginning.
    pub(crate) fn position(&self, range: &ClipRange, time: f32) -> f32 {
        let frame = time.floor().min(range.frames as f32 - 1.0);
        let KeysOfFrame { first, count } = self.0[range.frame + frame as usize];
        (time - frame) * count + first
    }

    /// Converts moments of sixteen characters between frames to moments between keys. `before` are the numbers of frames of all clips before
    /// their own.
    ///
    /// No operation is fused, so that all machines find the same interval.
    #[inline(always)]
    pub(crate) fn between<L: Lanes>(
        &self,
        before: &[u32; F32x16::LANES],
        moments: &mut [Moment<L>; F32x16::MOST_PARTS],
    ) {
        let [mut frames, mut firsts, mut counts] = [F32x16::ZERO; 3];
        let moments = &mut moments[..L::PARTS];
        for (part, moment) in moments.iter().enumerate() {
            moment.interval.store(&mut frames, part);
        }
        for (lane, &before) in before.iter().enumerate() {
            let own = self.0[before as usize + frames.0[lane] as usize];
            (firsts.0[lane], counts.0[lane]) = (own.first, own.count);
        }
        for (part, moment) in moments.iter_mut().enumerate() {
            let count = L::load(&counts, part);
            let place = moment.share * count;
            let key = place.floor().min(count - L::splat(1.0));
            *moment = Moment {
                interval: L::load(&firsts, part) + key,
                share: place - key,
            };
        }
    }

    /// Size of the table, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.0)
    }
}
