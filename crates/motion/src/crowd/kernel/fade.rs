//! Poses groups of characters that cross-fade to second clips.
//!
//! ```text
//! for each group: the loop of `pose`, with
//!     local = first clip's local * (1 - weight) + second clip's local * weight         along the shorter arc
//! The second clip is read row by row. So is the first, unless its lanes are near each other in time.
//! ```

use super::batches::{AHEAD, Scratch};
use super::chain::Posing;
use super::moments::{Moments, Reach, Run, weights};
use super::sampling::{Faded, Fetch, Playing, ReadRows};
use super::write::RunMemory;
use crate::crowd::keys::level_clips::LevelClips;
use crate::math::{F32x16, KeyRows, Lanes};

#[derive(Clone, Copy)]
struct FadeKeys<'a, L: Lanes> {
    /// Rows of the first clips. `None` if the characters share their loads.
    own: Option<KeyRows<'a>>,
    /// Rows of the second clips.
    rows: KeyRows<'a>,
    /// Weights of the two keys of each second clip.
    weights: [L::Words; F32x16::MOST_PARTS],
}

impl<L: Lanes> Fetch for FadeKeys<'_, L> {
    #[inline(always)]
    fn prefetch_lane(&self, level: &LevelClips, lane: usize) {
        if let Some(rows) = &self.own {
            rows.prefetch_lane(level, lane);
        }
        self.rows.prefetch_lane(level, lane);
    }
}

impl Run<'_> {
    /// Poses all groups; returns the number of groups whose characters are no longer near each other in time.
    #[inline(always)]
    pub(crate) fn pose_fading_batches<L: Lanes>(
        &self,
        scratch: &mut Scratch,
        to: &mut RunMemory<'_>,
    ) -> usize {
        let (mut apart, mut is_fetched) = (0, false);
        let none = FadeKeys::<L> {
            own: None,
            rows: KeyRows::none(&self.keys.rows),
            weights: [L::splat_words(0); F32x16::MOST_PARTS],
        };
        let mut keys = [none; AHEAD + 1];
        let mut batch = self.find_batch::<L>(0, scratch);
        while batch.count > 0 {
            let next = self.find_batch::<L>(batch.begun + AHEAD, scratch);
            apart += batch.apart(&scratch.moments);
            let [groups] = batch.pick(next, &scratch.moments, |_| 0);
            let places = groups.places();
            for (keys, &place) in keys.iter_mut().zip(places) {
                // Some groups before they are used: numbers that were stored together are not read one by one at once.
                let moments = &scratch.moments[usize::from(place)];
                L::apart(
                    #[inline(always)]
                    || self.find_keys(moments, keys),
                );
            }
            if !(places.is_empty() || is_fetched && groups.now() > 0) {
                keys[0].prefetch_all(self.bank);
            }
            for turn in 0..groups.now() {
                let (now, next) = (groups.place(turn), groups.place(turn + 1));
                let keys = &keys[turn..places.len()];
                self.pose_fading_group::<L>(now, next, keys, scratch, to);
            }
            (batch, is_fetched) = (next, groups.goes_on());
        }
        apart
    }

    /// Finds the keys of a group. They are large, so they are written in place.
    #[inline(always)]
    fn find_keys<'a, L: Lanes>(&'a self, moments: &Moments, to: &mut FadeKeys<'a, L>) {
        let fade = &self.cold[moments.group].fade;
        to.own = match moments.reach {
            Reach::Apart => Some(self.rows(moments)),
            _ => None,
        };
        let mut intervals = F32x16::ZERO;
        let second = self.moments::<L>(&fade.clock, &fade.clips, &mut intervals);
        for part in 0..L::PARTS {
            to.weights[part] = weights(second[part].share);
        }
        to.rows = self.rows_at(&fade.clips.rows, &intervals);
    }

    /// Poses the group whose moments are at the place `now`. `keys` has its keys, then those of the group that is posed next,
    /// whose moments are at `next`.
    #[inline(always)]
    fn pose_fading_group<L: Lanes>(
        &self,
        now: usize,
        next: usize,
        keys: &[FadeKeys<'_, L>],
        scratch: &mut Scratch,
        to: &mut RunMemory<'_>,
    ) {
        let Scratch {
            models,
            columns: [first, second],
            spare,
            moments: ahead,
        } = scratch;
        let (bank, moments) = (self.bank, &ahead[now]);
        let mut out = to.group(moments.group, self.group_lines(), spare);
        let weight = &self.cold[moments.group].fade.weight;
        let (own_keys, fetch) = (&keys[0], keys.get(1));
        for part in 0..L::PARTS {
            let posing: Posing<'_> = self.posing(moments, &mut out, models);
            let weights = L::load_words(&moments.weights, part);
            let weight = L::load(weight, part);
            let fade = Playing {
                columns: ReadRows::new::<L>(bank, &own_keys.rows, part, second),
                weights: own_keys.weights[part],
            };
            match &own_keys.own {
                Some(rows) => {
                    let columns = ReadRows::new::<L>(bank, rows, part, first);
                    let own = Playing { columns, weights };
                    posing.joints::<L, _>(part, Faded { own, fade, weight }, fetch);
                }
                None => {
                    let columns = moments.window::<L, true>(&ahead[next], self.keys, part);
                    let own = Playing { columns, weights };
                    posing.joints::<L, _>(part, Faded { own, fade, weight }, fetch);
                }
            }
        }
        self.write::<L>(out, models);
    }
}
