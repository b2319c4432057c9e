//! Moments of characters in their clips.

use super::quantise::ONE;
use crate::math::Lanes;

/// The interval between frames, or between keys, that contains a moment, as a float, and the position in it from 0 to 1. One
/// of each for each lane.
#[derive(Clone, Copy)]
pub(super) struct Moment<L> {
    pub(super) interval: L,
    pub(super) share: L,
}

impl<L: Lanes> Moment<L> {
    #[inline(always)]
    pub(super) fn zero() -> Self {
        let zero = L::splat(0.0);
        Self {
            interval: zero,
            share: zero,
        }
    }
}

/// Number of intervals of a clip, for each lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cycle<L> {
    length: L,
    /// 1 divided by `length`.
    inverse: L,
}

impl Cycle<f32> {
    /// The cycle of `length` intervals.
    pub(super) fn of(length: usize) -> Self {
        let length = length as f32;
        Self {
            length,
            inverse: 1.0 / length,
        }
    }

    /// The same cycle in all lanes.
    #[inline(always)]
    pub(super) fn lanes<L: Lanes>(self) -> Cycle<L> {
        Cycle {
            length: L::splat(self.length),
            inverse: L::splat(self.inverse),
        }
    }
}

impl<L: Lanes> Cycle<L> {
    #[inline(always)]
    pub(super) fn new(length: L) -> Self {
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
    fn wrapped_whole(self, value: L) -> L {
        // Half an interval is added, so that rounding does not reach another multiple of the length.
        let turns = ((value + L::splat(0.5)) * self.inverse).floor();
        value - turns * self.length
    }

    /// The moment at `time`, in intervals.
    ///
    /// No operation is fused, so that all machines find the same interval.
    #[inline(always)]
    pub(super) fn moment(self, time: L) -> Moment<L> {
        let time = self.wrapped(time);
        let interval = time.floor().min(self.length - L::splat(1.0));
        Moment {
            interval,
            share: time - interval,
        }
    }
}

/// Classes of the distance between lanes in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Reach {
    /// Less than [`Lanes::REACH`] intervals.
    Narrow,
    /// Less than [`Lanes::WIDE_REACH`] intervals.
    Wide,
    /// At least as many intervals, or different clips.
    Apart,
}

impl Reach {
    pub(super) const COUNT: usize = 3;
}

/// Positions of lanes that are near each other in time.
#[derive(Clone, Copy)]
pub(super) struct Near<L: Lanes> {
    /// Interval of the lane that is furthest behind.
    pub(super) start: usize,
    /// Number of keys that each lane is ahead of `start`: see [`Lanes::window_places`].
    pub(super) places: L::Words,
    pub(super) reach: Reach,
}

impl<L: Lanes> Near<L> {
    /// Measures how far lanes are apart. If they are [apart](Reach::Apart), the other fields are meaningless.
    #[inline(always)]
    pub(super) fn new(intervals: usize, cycle: Cycle<L>, interval: L) -> Self {
        // Positions ahead of the lane that is furthest behind. The first lane is only near it.
        let first = interval.first();
        let half = (intervals / 2) as f32;
        let ahead = cycle.wrapped_whole(interval + L::splat(half - first));
        let least = ahead.least();
        let start = (first + least - half) as i32 as isize;
        let start = if start < 0 {
            start.wrapping_add_unsigned(intervals)
        } else {
            start
        };
        let start = (start as usize).min(intervals - 1);
        let places = ahead - L::splat(least);
        // There is one more key after the last interval: the last key of the clip.
        let beyond = places - L::splat((intervals - start) as f32 - 1.0);
        let places = places + beyond.max(L::splat(0.0)).min(L::splat(1.0));
        let is_within = |reach: usize| places.all_below(reach as f32);
        let reach = match (is_within(L::REACH), is_within(L::WIDE_REACH)) {
            (true, _) => Reach::Narrow,
            (false, true) => Reach::Wide,
            (false, false) => Reach::Apart,
        };
        Self {
            start,
            places: L::window_places(places),
            reach,
        }
    }
}

/// Weights of the two keys around a moment.
#[derive(Clone, Copy)]
pub(super) struct Weights<L: Lanes> {
    /// Weight of the key before and of the key after as 16-bit numbers, in the lower and upper half of a word. Their sum is
    /// [`ONE`].
    pub(super) pair: L::Words,
}

impl<L: Lanes> Weights<L> {
    #[inline(always)]
    pub(super) fn new(share: L) -> Self {
        let after = (share * L::splat(ONE) + L::splat(0.5)).floor();
        let before = L::splat(ONE) - after;
        Self {
            pair: L::pair(before.truncated(), after.truncated()),
        }
    }
}
