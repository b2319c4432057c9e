//! The groups that one call of the kernel poses, and the moments of their characters in their clips.
//!
//! ```text
//! for each lane:
//!     time = start + speed * now, wrapped into the clip            in frames
//!     interval, share = the two keys around it, and the way between them
//!     weights = two 16-bit numbers whose sum is 1
//! near: all lanes play one clip, within REACH or WIDE_REACH intervals. One load then has the keys of all lanes.
//! ```

use super::sampling::Window;
use crate::anim::ClipId;
use crate::crowd::keys::clip_times::{ClipRange, Cycle, Moment};
use crate::crowd::keys::key_bank::KeyBank;
use crate::crowd::keys::level_clips::LevelClips;
use crate::crowd::keys::tracks::ONE;
use crate::crowd::output::Output;
use crate::crowd::sort::group::{Clock, Group, GroupCold, LaneRanges};
use crate::math::{F32x16, KeyColumns, KeyPlace, KeyRows, Lanes};

/// Groups that are posed on one level in one way.
#[derive(Clone, Copy)]
pub(crate) struct Run<'a> {
    pub(crate) keys: &'a KeyBank,
    pub(crate) bank: &'a LevelClips,
    /// Number of the level that is posed, as a float.
    pub(crate) level: f32,
    /// Ranges of the keys of all clips and layers.
    pub(crate) ranges: &'a [ClipRange],
    /// For each group, the clip of all its characters if they are near each other in time, else `None`.
    pub(crate) near: &'a [Option<ClipId>],
    /// Whether the characters cross-fade to second clips.
    pub(crate) fades: bool,
    pub(crate) groups: &'a [Group],
    pub(crate) cold: &'a [GroupCold],
    /// The groups' clock, in seconds.
    pub(crate) now: f32,
    pub(crate) output: Output,
}

/// Whether no character of a group has a level that is more than `steps` levels coarser than the posed one, whose number is `posed`. The whole
/// group is tested, so that registers of every width compute the same.
#[inline(always)]
pub(crate) fn shows<L: Lanes>(posed: f32, detail: &F32x16, steps: usize) -> bool {
    let mut shows = true;
    for part in 0..L::PARTS {
        let ahead = L::load(detail, part) - L::splat(posed + steps as f32);
        shows &= ahead.all_below(f32::MIN_POSITIVE);
    }
    shows
}

/// Classes of the distance between lanes in time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Reach {
    /// Less than [`Lanes::REACH`] intervals.
    #[default]
    Narrow,
    /// Less than [`Lanes::WIDE_REACH`] intervals.
    Wide,
    /// At least as many intervals, or different clips.
    Apart,
}

/// Positions of lanes that are near each other in time.
#[derive(Clone, Copy)]
pub(crate) struct Near<L: Lanes> {
    /// Interval of the lane that is furthest behind.
    pub(crate) start: usize,
    /// Number of keys that each lane is ahead of `start`: see [`Lanes::window_places`].
    pub(crate) places: L::Words,
    pub(crate) reach: Reach,
}

impl<L: Lanes> Near<L> {
    /// Measures how far lanes are apart. If they are [apart](Reach::Apart), the other fields are meaningless.
    #[inline(always)]
    pub(crate) fn new(intervals: usize, cycle: Cycle<L>, interval: L) -> Self {
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

/// Weights of the two keys around a moment: of the key before and of the key after, as 16-bit numbers in the lower and upper half of a word.
/// Their sum is [`ONE`].
#[inline(always)]
pub(crate) fn weights<L: Lanes>(share: L) -> L::Words {
    let after = (share * L::splat(ONE) + L::splat(0.5)).floor();
    let before = L::splat(ONE) - after;
    L::pair(before.truncated(), after.truncated())
}

/// Moments of a group's characters in their clips. Lanes are stored as [`F32x16`]s, so that the same memory serves every
/// instruction set.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Moments {
    pub(crate) group: usize,
    /// The interval of each character's own clip.
    pub(crate) interval: F32x16,
    /// Bits of the [`weights`].
    pub(crate) weights: F32x16,
    /// For each part whose lanes are near each other in time, position of its window in the first column, in keys.
    pub(crate) starts: [usize; F32x16::LANES],
    /// Number of keys from the start of one column to the start of the next.
    pub(crate) stride: usize,
    /// Bits of [`Near::places`].
    pub(crate) places: F32x16,
    /// Reach of the part whose lanes are furthest from each other.
    pub(crate) reach: Reach,
    /// Whether all characters look as on the posed level, so that no joint is blended towards a coarser one.
    pub(crate) is_posed: bool,
    /// Whether all characters play one clip, but are not near each other in time.
    pub(crate) is_apart: bool,
}

impl Moments {
    /// The window of a part of this group, whose lanes are near each other in time. That of the group that is posed next is prefetched.
    #[inline(always)]
    pub(crate) fn window<'a, L: Lanes, const WIDE: bool>(
        &self,
        next: &Self,
        keys: &'a KeyBank,
        part: usize,
    ) -> Window<'a, L, WIDE> {
        let place = |moments: &Self| KeyPlace {
            first: moments.starts[part],
            stride: moments.stride,
        };
        let columns = KeyColumns {
            table: &keys.columns,
            at: place(self),
            next: place(next),
        };
        Window {
            columns,
            places: L::load_words(&self.places, part),
        }
    }
}

impl Run<'_> {
    /// Computes the moments of the group at `index`.
    #[inline(always)]
    pub(crate) fn find_moments<L: Lanes>(&self, index: usize, to: &mut Moments) {
        let group = &self.groups[index];
        to.group = index;
        to.is_posed = shows::<L>(self.level, &group.detail, 0);
        let Some(clip) = self.near[index] else {
            let moments = self.moments::<L>(&group.clock, &self.cold[index].own, &mut to.interval);
            for part in 0..L::PARTS {
                let weights = weights(moments[part].share);
                L::from_bits(weights).store(&mut to.weights, part);
            }
            (to.reach, to.is_apart) = (Reach::Apart, false);
            return;
        };
        let range = &self.ranges[clip.index()];
        let frames = range.frame_cycle.lanes::<L>();
        let mut found = [Moment::zero(); F32x16::MOST_PARTS];
        for part in 0..L::PARTS {
            found[part] = group.clock.moment(part, self.now, frames);
        }
        if !range.is_even() {
            let before = [range.frame as u32; F32x16::LANES];
            self.keys.frames.between::<L>(&before, &mut found);
        }
        let (place, keys) = (self.keys.place(range, 0), range.key_cycle.lanes::<L>());
        let mut reach = Reach::Narrow;
        for part in 0..L::PARTS {
            let moment = found[part];
            let near = Near::new(range.intervals, keys, moment.interval);
            to.starts[part] = place.first + near.start;
            L::from_bits(near.places).store(&mut to.places, part);
            reach = reach.max(near.reach);
            moment.interval.store(&mut to.interval, part);
            L::from_bits(weights(moment.share)).store(&mut to.weights, part);
        }
        to.stride = place.stride;
        to.reach = reach;
        to.is_apart = reach == Reach::Apart;
    }

    /// Computes the moments of sixteen characters in clips of their own. `intervals` receives the intervals between keys.
    #[inline(always)]
    pub(crate) fn moments<L: Lanes>(
        &self,
        clock: &Clock,
        clips: &LaneRanges,
        intervals: &mut F32x16,
    ) -> [Moment<L>; F32x16::MOST_PARTS] {
        let mut found = [Moment::zero(); F32x16::MOST_PARTS];
        for part in 0..L::PARTS {
            let cycle = Cycle::new(L::load(&clips.length, part));
            found[part] = clock.moment(part, self.now, cycle);
        }
        if clips.is_uneven {
            self.keys.frames.between::<L>(&clips.frames, &mut found);
        }
        for part in 0..L::PARTS {
            found[part].interval.store(intervals, part);
        }
        found
    }

    /// The rows of keys of a group's first clips.
    #[inline(always)]
    pub(crate) fn rows(&self, moments: &Moments) -> KeyRows<'_> {
        self.rows_at(&self.cold[moments.group].own.rows, &moments.interval)
    }

    /// The rows of keys at `intervals`. `before` are the numbers of rows of all clips before each character's own.
    #[inline(always)]
    pub(crate) fn rows_at(&self, before: &[u32; F32x16::LANES], intervals: &F32x16) -> KeyRows<'_> {
        let units = self.keys.row_units;
        let mut starts = *before;
        for (row, interval) in starts.iter_mut().zip(intervals.0) {
            *row = (*row + interval as u32) * units as u32;
        }
        KeyRows::new(&self.keys.rows, starts, units)
    }
}
