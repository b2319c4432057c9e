//! Where the characters of a group are in their clips.

use super::group::ClipLines;
use super::key_bank::ClipRange;
use super::moment::{Cycle, Moment, Near, Weights};
use super::run::Run;
use crate::math::{F32x16, KeyRows, Lanes};

/// Where a group is in its clips, and what of it is shown.
#[derive(Clone, Copy)]
pub(super) struct Moments<L: Lanes> {
    /// Index of the group.
    pub(super) group: usize,
    pub(super) own: L::Parts<Moment<L>>,
    pub(super) weights: L::Parts<Weights<L>>,
    /// Where each part is that is near; `None` for others.
    pub(super) near: L::Parts<Option<Near<L>>>,
    pub(super) all_near: bool,
    /// Nobody is on the way to another level.
    pub(super) is_posed: bool,
    /// Some character is inside the frustum.
    pub(super) is_visible: bool,
}

impl<L: Lanes> Moments<L> {
    #[inline(always)]
    pub(super) fn blank() -> Self {
        let zero = L::splat(0.0);
        let moment = Moment {
            interval: zero,
            share: zero,
        };
        Self {
            group: 0,
            own: L::parts(moment),
            weights: L::parts(Weights::new(zero)),
            near: L::parts(None),
            all_near: false,
            is_posed: false,
            is_visible: true,
        }
    }
}

impl Run<'_> {
    #[inline(always)]
    pub(super) fn moments<L: Lanes>(
        &self,
        index: usize,
        near: Option<(&ClipRange, Cycle<L>)>,
    ) -> Moments<L> {
        let group = &self.groups[index];
        let mut moments = Moments::<L>::blank();
        moments.group = index;
        moments.all_near = near.is_some();
        moments.is_posed = self.level.shows::<L>(&group.detail, 0);
        moments.is_visible = self.visible[index] != 0;
        for part in 0..L::PARTS {
            let moment = match near {
                Some((range, cycle)) => {
                    let moment = group.clock.moment(part, self.now, cycle);
                    let near = Near::new(range, cycle, moment.interval);
                    moments.all_near &= near.is_some();
                    moments.near[part] = near;
                    moment
                }
                None => {
                    let cycle = Cycle::new(L::load(&self.cold[index].length, part));
                    group.clock.moment(part, self.now, cycle)
                }
            };
            moments.own[part] = moment;
            moments.weights[part] = Weights::new(moment.share);
        }
        moments
    }

    /// Where a group is in the clips that are mixed in.
    #[inline(always)]
    pub(super) fn mixed_moments<L: Lanes>(&self, clips: &ClipLines) -> L::Parts<Moment<L>> {
        let zero = L::splat(0.0);
        let mut moments = L::parts(Moment {
            interval: zero,
            share: zero,
        });
        for part in 0..L::PARTS {
            let cycle = Cycle::new(L::load(&clips.length, part));
            moments[part] = clips.clock.moment(part, self.now, cycle);
        }
        moments
    }

    /// The rows of a group's first clips.
    #[inline(always)]
    pub(super) fn rows<L: Lanes>(&self, moments: &Moments<L>) -> KeyRows<'_> {
        self.rows_at::<L>(&self.cold[moments.group].rows, &moments.own)
    }

    /// The rows of sixteen characters whose clips have so many rows before their own.
    #[inline(always)]
    pub(super) fn rows_at<L: Lanes>(
        &self,
        before: &[u32; F32x16::LANES],
        moments: &L::Parts<Moment<L>>,
    ) -> KeyRows<'_> {
        let mut intervals = F32x16::ZERO;
        for part in 0..L::PARTS {
            moments[part].interval.store(&mut intervals, part);
        }
        let units = self.keys.row_units;
        let mut starts = *before;
        for (row, interval) in starts.iter_mut().zip(intervals.0) {
            *row = (*row + interval as u32) * units as u32;
        }
        KeyRows::new(&self.keys.rows, starts, units)
    }
}
