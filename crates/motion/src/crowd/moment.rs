//! Where characters are in their clips.

use super::quantise::ONE;
use crate::math::Lanes;

/// The interval between frames, or between keys, that each lane is in, as a float, and how far in it, from 0 to 1.
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

/// How many intervals a clip has, for each lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cycle<L> {
    length: L,
    /// One divided by it.
    inverse: L,
}

impl Cycle<f32> {
    /// So many intervals.
    pub(super) fn of(length: usize) -> Self {
        let length = length as f32;
        Self {
            length,
            inverse: 1.0 / length,
        }
    }

    /// The same for all lanes.
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

    /// Into `0..length`; what is no number becomes 0. Rounding may give `length` itself, or 0 for what is a little less.
    #[inline(always)]
    fn wrapped(self, value: L) -> L {
        let rest = value - (value * self.inverse).floor() * self.length;
        rest.max(L::splat(0.0)).min(self.length)
    }

    /// The same of a whole number of intervals, and without a rounding.
    #[inline(always)]
    fn wrapped_whole(self, value: L) -> L {
        // From half an interval away rounding reaches no other multiple of the length.
        let turns = ((value + L::splat(0.5)) * self.inverse).floor();
        value - turns * self.length
    }

    /// The moment at a time that is counted in intervals.
    ///
    /// No step is fused, so that all machines take the same interval.
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

/// How far lanes are from each other in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Reach {
    /// Within [`Lanes::REACH`] intervals.
    Narrow,
    /// Within [`Lanes::WIDE_REACH`] intervals.
    Wide,
    /// Further, or in different clips.
    Apart,
}

impl Reach {
    pub(super) const COUNT: usize = 3;
}

/// Where lanes are that are near each other in time.
#[derive(Clone, Copy)]
pub(super) struct Near<L: Lanes> {
    /// The interval of the one that is furthest behind.
    pub(super) start: usize,
    /// How many keys further each is: see [`Lanes::window_places`].
    pub(super) places: L::Words,
    pub(super) reach: Reach,
}

impl<L: Lanes> Near<L> {
    /// Of places that are [apart](Reach::Apart) only that is known.
    #[inline(always)]
    pub(super) fn new(intervals: usize, cycle: Cycle<L>, interval: L) -> Self {
        // From the lane that is furthest behind; the first lane is only near it.
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
        // Beyond the last interval there is one key more: the clip's last.
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

/// How much of the key before and of the key after.
#[derive(Clone, Copy)]
pub(super) struct Weights<L: Lanes> {
    /// As 16-bit numbers whose sum is [`ONE`], in the halves of a word.
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
