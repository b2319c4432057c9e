//! The rows of keys of a group whose characters are read one by one.

use super::group::ClipLines;
use super::group_moments::Moments;
use super::level_clips::LevelClips;
use super::moment::Weights;
use super::run::Run;
use crate::math::{F32x16, KeyRows, Lanes};

/// The rows of a group, and how far its characters are between two of them.
#[derive(Clone, Copy)]
pub(super) struct GroupRows<'a, L: Lanes> {
    /// Index of the group among those whose moments are known.
    pub(super) index: usize,
    /// `None` where characters share their loads.
    pub(super) own: Option<KeyRows<'a>>,
    pub(super) faded: Option<ClipRows<'a, L>>,
    pub(super) layer: Option<ClipRows<'a, L>>,
}

/// The rows of one clip for each character.
#[derive(Clone, Copy)]
pub(super) struct ClipRows<'a, L: Lanes> {
    pub(super) rows: KeyRows<'a>,
    pub(super) weights: L::Parts<Weights<L>>,
}

impl<L: Lanes> GroupRows<'_, L> {
    pub(super) const NONE: Self = Self {
        index: 0,
        own: None,
        faded: None,
        layer: None,
    };

    /// Asks for a share of the keys, while a joint of the group before is computed.
    #[inline(always)]
    pub(super) fn prefetch(&self, level: &LevelClips, joint: usize) {
        let joints = level.joints.len();
        let lane = |joint: usize| joint * F32x16::LANES / joints;
        for lane in lane(joint)..lane(joint + 1) {
            if let Some(rows) = &self.own {
                prefetch_lane(rows, lane, level);
            }
            if let Some(faded) = &self.faded {
                prefetch_lane(&faded.rows, lane, level);
            }
            if let Some(layer) = &self.layer {
                prefetch_lane(&layer.rows, lane, level);
            }
        }
    }
}

#[inline(always)]
fn prefetch_lane(rows: &KeyRows<'_>, lane: usize, level: &LevelClips) {
    for &unit in &level.fetched {
        rows.prefetch(lane, unit);
    }
}

impl Run<'_> {
    /// The rows of a group. Written in place: they are large.
    #[inline(always)]
    pub(super) fn group_rows<'a, L: Lanes>(
        &'a self,
        moments: &Moments<L>,
        to: &mut GroupRows<'a, L>,
    ) {
        let cold = &self.cold[moments.group];
        to.own = None;
        if !moments.all_near {
            to.own = Some(self.rows(moments));
        }
        if self.mix.fades {
            to.faded = Some(self.clip_rows::<L>(&cold.fade));
        }
        if self.mix.is_layered {
            to.layer = Some(self.clip_rows::<L>(&cold.layer));
        }
    }

    #[inline(always)]
    fn clip_rows<L: Lanes>(&self, clips: &ClipLines) -> ClipRows<'_, L> {
        let at = self.mixed_moments::<L>(clips);
        let mut weights = L::parts(Weights::new(L::splat(0.0)));
        for part in 0..L::PARTS {
            weights[part] = Weights::new(at[part].share);
        }
        ClipRows {
            rows: self.rows_at::<L>(&clips.rows, &at),
            weights,
        }
    }
}
