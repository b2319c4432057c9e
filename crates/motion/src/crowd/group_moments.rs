//! Computes the moments of a group's characters in their clips.

use super::group::{ClipLines, Clock, SharedClip};
use super::key_bank::KeyPlace;
use super::moment::{Cycle, Moment, Near, Reach, Weights};
use super::moments::Moments;
use super::run::Run;
use super::sampling::WindowPlace;
use crate::math::{F32x16, KeyRows, Lanes};

/// The clips of sixteen characters, and their positions in them.
struct ClockLines<'a> {
    clock: &'a Clock,
    length: &'a F32x16,
    /// For each lane, number of frames of all clips before the character's own.
    frames: &'a [u32; F32x16::LANES],
    /// Whether each clip has one key per frame.
    is_even: bool,
}

impl Run<'_> {
    /// Computes the moments of the group at `index`.
    #[inline(always)]
    pub(super) fn find_moments<L: Lanes>(&self, index: usize, to: &mut Moments) {
        let group = &self.groups[index];
        to.group = index;
        to.is_posed = self.level.shows::<L>(&group.detail, 0);
        to.is_visible = self.visible[index] != 0;
        let Some(clip) = self.near[index] else {
            let cold = &self.cold[index];
            let lines = ClockLines {
                clock: &group.clock,
                length: &cold.length,
                frames: &cold.frames,
                is_even: cold.is_even,
            };
            let moments = self.moments::<L>(&lines, &mut to.interval);
            for part in 0..L::PARTS {
                let weights = Weights::new(moments[part].share);
                L::from_bits(weights.pair).store(&mut to.weights, part);
            }
            (to.reach, to.is_apart) = (Reach::Apart, false);
            return;
        };
        let range = &self.ranges[clip.index()];
        let frames = range.frame_cycle.lanes::<L>();
        let mut found = L::parts(Moment::zero());
        for part in 0..L::PARTS {
            found[part] = group.clock.moment(part, self.now, frames);
        }
        if !range.is_even() {
            let before = [range.frame as u32; F32x16::LANES];
            self.between_keys::<L>(&before, &mut found);
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
            let weights = Weights::new(moment.share);
            L::from_bits(weights.pair).store(&mut to.weights, part);
        }
        to.stride = place.stride;
        to.reach = reach;
        to.is_apart = reach == Reach::Apart;
    }

    /// Computes the moments of sixteen characters in clips of their own. `intervals` receives the intervals between keys.
    #[inline(always)]
    fn moments<L: Lanes>(
        &self,
        lines: &ClockLines<'_>,
        intervals: &mut F32x16,
    ) -> L::Parts<Moment<L>> {
        let mut found = L::parts(Moment::zero());
        for part in 0..L::PARTS {
            let cycle = Cycle::new(L::load(lines.length, part));
            found[part] = lines.clock.moment(part, self.now, cycle);
        }
        if !lines.is_even {
            self.between_keys::<L>(lines.frames, &mut found);
        }
        for part in 0..L::PARTS {
            found[part].interval.store(intervals, part);
        }
        found
    }

    /// Converts moments between frames to moments between keys. `before` are the numbers of frames of all clips before each
    /// lane's own.
    #[inline(always)]
    fn between_keys<L: Lanes>(
        &self,
        before: &[u32; F32x16::LANES],
        moments: &mut L::Parts<Moment<L>>,
    ) {
        let mut frames = F32x16::ZERO;
        for part in 0..L::PARTS {
            moments[part].interval.store(&mut frames, part);
        }
        let keys = self.keys.frames.of(&frames, before);
        for part in 0..L::PARTS {
            moments[part] = keys.moment(part, moments[part].share);
        }
    }

    /// The rows of keys of a group's first clips.
    #[inline(always)]
    pub(super) fn rows(&self, moments: &Moments) -> KeyRows<'_> {
        self.rows_at(&self.cold[moments.group].rows, &moments.interval)
    }

    /// The moments of characters in clips that are mixed in.
    #[inline(always)]
    pub(super) fn clip_moments<L: Lanes>(&self, clips: &ClipLines) -> ClipMoments<L> {
        let lines = ClockLines {
            clock: &clips.clock,
            length: &clips.length,
            frames: &clips.frames,
            is_even: clips.is_even,
        };
        let mut intervals = F32x16::ZERO;
        let moments = self.moments::<L>(&lines, &mut intervals);
        ClipMoments { intervals, moments }
    }

    /// The rows of keys of clips that are mixed in, and the weights of the two rows of each character.
    #[inline(always)]
    pub(super) fn clip_rows<L: Lanes>(
        &self,
        clips: &ClipLines,
        moments: &ClipMoments<L>,
    ) -> ClipRows<'_, L> {
        ClipRows {
            rows: self.rows_at(&clips.rows, &moments.intervals),
            weights: moments.weights(),
        }
    }

    /// The windows of characters that mix in one clip and are near each other in it.
    #[inline(always)]
    pub(super) fn clip_windows<L: Lanes>(
        &self,
        clips: &ClipLines,
        moments: &ClipMoments<L>,
    ) -> Option<ClipWindows<L>> {
        let SharedClip::One(clip) = clips.shared else {
            return None;
        };
        let range = &self.ranges[clip.index()];
        let (keys, place) = (range.key_cycle.lanes::<L>(), self.keys.place(range, 0));
        let mut windows = L::parts(WindowPlace {
            at: place,
            next: place,
            places: L::splat_words(0),
        });
        for part in 0..L::PARTS {
            let near = Near::new(range.intervals, keys, moments.moments[part].interval);
            if near.reach == Reach::Apart {
                return None;
            }
            let first = place.first + near.start;
            let at = KeyPlace { first, ..place };
            windows[part] = WindowPlace {
                at,
                next: at,
                places: near.places,
            };
        }
        Some(ClipWindows {
            windows,
            weights: moments.weights(),
        })
    }

    /// The rows of keys at `intervals`. `before` are the numbers of rows of all clips before each character's own.
    #[inline(always)]
    fn rows_at(&self, before: &[u32; F32x16::LANES], intervals: &F32x16) -> KeyRows<'_> {
        let units = self.keys.row_units;
        let mut starts = *before;
        for (row, interval) in starts.iter_mut().zip(intervals.0) {
            *row = (*row + interval as u32) * units as u32;
        }
        KeyRows::new(&self.keys.rows, starts, units)
    }
}

/// Moments of characters in clips that are mixed in.
pub(super) struct ClipMoments<L: Lanes> {
    /// Interval between keys of each character.
    intervals: F32x16,
    moments: L::Parts<Moment<L>>,
}

impl<L: Lanes> ClipMoments<L> {
    #[inline(always)]
    fn weights(&self) -> L::Parts<Weights<L>> {
        let mut weights = L::parts(Weights::new(L::splat(0.0)));
        for part in 0..L::PARTS {
            weights[part] = Weights::new(self.moments[part].share);
        }
        weights
    }
}

/// Wide windows of characters that mix in one clip.
#[derive(Clone, Copy)]
pub(super) struct ClipWindows<L: Lanes> {
    pub(super) windows: L::Parts<WindowPlace<L>>,
    pub(super) weights: L::Parts<Weights<L>>,
}

/// The rows of keys of one clip for each character.
#[derive(Clone, Copy)]
pub(super) struct ClipRows<'a, L: Lanes> {
    pub(super) rows: KeyRows<'a>,
    pub(super) weights: L::Parts<Weights<L>>,
}
