//! Asking for keys before they are needed.

use super::group::ClipLines;
use super::group_moments::Moments;
use super::level_clips::LevelClips;
use super::run::Run;
use crate::math::{F32x16, KeyRows, Lanes};

/// Asks for the keys of a group, a few with each joint of the group before it.
pub(super) struct Fetch<'a> {
    bank: &'a LevelClips,
    own: Option<KeyRows<'a>>,
    faded: Option<KeyRows<'a>>,
    layer: Option<KeyRows<'a>>,
}

impl<'a> Fetch<'a> {
    /// Nothing yet.
    #[inline(always)]
    pub(super) fn none(bank: &'a LevelClips) -> Self {
        Self {
            bank,
            own: None,
            faded: None,
            layer: None,
        }
    }

    #[inline(always)]
    pub(super) fn joint(&self, joint: usize) {
        let joints = self.bank.joints.len();
        let lane = |joint: usize| joint * F32x16::LANES / joints;
        for lane in lane(joint)..lane(joint + 1) {
            for &unit in &self.bank.fetched {
                if let Some(rows) = &self.own {
                    rows.prefetch(lane, unit);
                }
                if let Some(rows) = &self.faded {
                    rows.prefetch(lane, unit);
                }
                if let Some(rows) = &self.layer {
                    rows.prefetch(lane, unit);
                }
            }
        }
    }
}

impl Run<'_> {
    /// What is asked for while the group before is posed. Written in place: it is large.
    #[inline(always)]
    pub(super) fn fetch<'a, L: Lanes>(&'a self, next: &Moments<L>, fetch: &mut Fetch<'a>) {
        if !next.all_near {
            fetch.own = Some(self.rows(next));
        }
        let cold = &self.cold[next.group];
        if self.mix.fades {
            fetch.faded = Some(self.mixed_rows::<L>(&cold.fade));
        }
        if self.mix.is_layered {
            fetch.layer = Some(self.mixed_rows::<L>(&cold.layer));
        }
    }

    #[inline(always)]
    fn mixed_rows<L: Lanes>(&self, clips: &ClipLines) -> KeyRows<'_> {
        self.rows_at::<L>(&clips.rows, &self.mixed_moments::<L>(clips))
    }
}
