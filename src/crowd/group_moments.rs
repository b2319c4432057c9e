//! Where the characters of a group are in their clips.

use super::group::ClipLines;
use super::key_bank::ClipRange;
use super::moment::{Cycle, Near, Weights};
use super::run::Run;
use crate::math::{F32x16, KeyRows, Lanes};

/// Groups whose moments are found before the first of them is posed. Where a group is in its clip is a long chain of steps, each of
/// which waits for the one before: those of several groups are done at once.
pub(super) const AHEAD: usize = 8;

/// Where a group is in its clips, and what of it is shown. In lines, so that the same memory serves every instruction set.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moments {
    /// Index of the group.
    pub(super) group: usize,
    /// The interval of each character's own clip.
    interval: F32x16,
    /// Bits of [`Weights::pair`].
    weights: F32x16,
    /// Where each part is that is near.
    starts: [usize; F32x16::LANES],
    /// Bits of [`Near::places`].
    places: F32x16,
    /// All parts are near.
    pub(super) all_near: bool,
    /// Nobody is on the way to another level.
    pub(super) is_posed: bool,
    /// Some character is inside the frustum.
    pub(super) is_visible: bool,
}

impl Moments {
    pub(super) const BLANK: Self = Self {
        group: 0,
        interval: F32x16::ZERO,
        weights: F32x16::ZERO,
        starts: [0; F32x16::LANES],
        places: F32x16::ZERO,
        all_near: false,
        is_posed: false,
        is_visible: false,
    };

    #[inline(always)]
    pub(super) fn weights<L: Lanes>(&self, part: usize) -> Weights<L> {
        Weights {
            pair: L::load_words(&self.weights, part),
        }
    }

    /// Where a part is, of a group that is near.
    #[inline(always)]
    pub(super) fn near<L: Lanes>(&self, part: usize) -> Near<L> {
        Near {
            start: self.starts[part],
            places: L::load_words(&self.places, part),
        }
    }
}

impl Run<'_> {
    /// Finds where a group is. `near` is the clip that its characters share.
    #[inline(always)]
    pub(super) fn find_moments<L: Lanes>(
        &self,
        index: usize,
        near: Option<(&ClipRange, Cycle<L>)>,
        to: &mut Moments,
    ) {
        let group = &self.groups[index];
        to.group = index;
        to.is_posed = self.level.shows::<L>(&group.detail, 0);
        to.is_visible = self.visible[index] != 0;
        let mut all_near = near.is_some();
        for part in 0..L::PARTS {
            let moment = match near {
                Some((range, cycle)) => {
                    let moment = group.clock.moment(part, self.now, cycle);
                    match Near::new(range, cycle, moment.interval) {
                        Some(near) => {
                            to.starts[part] = near.start;
                            L::from_bits(near.places).store(&mut to.places, part);
                        }
                        None => all_near = false,
                    }
                    moment
                }
                None => {
                    let cycle = Cycle::new(L::load(&self.cold[index].length, part));
                    group.clock.moment(part, self.now, cycle)
                }
            };
            moment.interval.store(&mut to.interval, part);
            let weights = Weights::new(moment.share);
            L::from_bits(weights.pair).store(&mut to.weights, part);
        }
        to.all_near = all_near;
    }

    /// The rows of a group's first clips.
    #[inline(always)]
    pub(super) fn rows(&self, moments: &Moments) -> KeyRows<'_> {
        self.rows_at(&self.cold[moments.group].rows, &moments.interval)
    }

    /// The rows of clips that are mixed in, and how far characters are between two of them.
    #[inline(always)]
    pub(super) fn clip_rows<L: Lanes>(&self, clips: &ClipLines) -> ClipRows<'_, L> {
        let (mut intervals, zero) = (F32x16::ZERO, L::splat(0.0));
        let mut weights = L::parts(Weights::new(zero));
        for part in 0..L::PARTS {
            let cycle = Cycle::new(L::load(&clips.length, part));
            let moment = clips.clock.moment(part, self.now, cycle);
            moment.interval.store(&mut intervals, part);
            weights[part] = Weights::new(moment.share);
        }
        ClipRows {
            rows: self.rows_at(&clips.rows, &intervals),
            weights,
        }
    }

    /// The rows of sixteen characters whose clips have so many rows before their own.
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

/// The rows of one clip for each character.
#[derive(Clone, Copy)]
pub(super) struct ClipRows<'a, L: Lanes> {
    pub(super) rows: KeyRows<'a>,
    pub(super) weights: L::Parts<Weights<L>>,
}
