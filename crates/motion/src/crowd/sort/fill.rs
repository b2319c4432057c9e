//! Sorts characters into groups of sixteen.
//!
//! The method is ours. Sixteen characters of one clip and level that are near each other in time form a group and share their
//! loads. The others fill groups in the order of their levels, whatever they play. Such a group is posed on the finest level of
//! its characters, and those with coarser levels are blended to look like them. Few lanes therefore stay empty, however many
//! clips and levels there are.
//!
//! ```text
//! key of each character = level, whether it cross-fades, clip, position in the clip, number
//! sort the keys
//! for each level:
//!     while keys are left:
//!         if the next sixteen play one clip, near each other in time: they are a group
//!         else the next one waits in a list
//!     each sixteen of the list are a group; fewer wait for the next level
//! ```

use super::group::{Group, GroupKind, NOWHERE};
use super::schedule::{Schedule, Sorting};
use crate::anim::ClipId;
use crate::crowd::error::MOST_CHARACTERS;
use crate::lod::LevelId;
use crate::math::F32x16;

/// Number of bits of a character's number.
const ID_BITS: u32 = MOST_CHARACTERS.count_ones();

/// Number of bits for the position in the clip. A key consists, from the lowest bit, of the character ([`ID_BITS`]), the
/// position in the clip, and the clip with its level and whether it cross-fades (22).
const TIME_BITS: u32 = 14;

/// Sixteen characters within this many intervals are put into one group and share their loads. They drift apart and share
/// loads for as long as a wide window contains them, which reaches 62 intervals.
const NEAR: u64 = 40;

impl Schedule {
    /// Puts all characters into groups. Allocates only where a crowd has grown.
    pub(crate) fn sort(&mut self, mut sorting: Sorting<'_>) {
        self.clear(&mut sorting);
        self.add_keys(&sorting);
        self.keys.sort_unstable();
        self.fill(&mut sorting);
        self.first_late = self.groups.len();
        self.share_out(sorting.chunks);
    }

    fn clear(&mut self, sorting: &mut Sorting<'_>) {
        self.groups.clear();
        self.cold.clear();
        self.near.clear();
        self.buckets.clear();
        self.keys.clear();
        self.lines = 0;
        self.first_late = usize::MAX;
        self.reserve(sorting.states.len(), sorting.chunks);
        self.rows.reset(sorting.states.len());
        sorting.slots.fill(NOWHERE);
    }

    fn add_keys(&mut self, sorting: &Sorting<'_>) {
        let Sorting {
            animations, now, ..
        } = *sorting;
        let clips = animations.clips();
        let present = sorting.states.iter().enumerate();
        let present = present.filter(|(_, state)| !state.is_inactive);
        self.keys.extend(present.map(|(id, state)| {
            let at = state.share(animations, now);
            let time = (at * (1 << TIME_BITS) as f32) as u64;
            let time = time.min((1 << TIME_BITS) - 1);
            let kind = 2 * state.level().index() + usize::from(state.fades);
            let plays = (kind * clips + state.own.clip.index()) as u64;
            plays << (TIME_BITS + ID_BITS) | time << ID_BITS | id as u64
        }));
    }

    /// Fills groups in the order of the keys.
    fn fill(&mut self, sorting: &mut Sorting<'_>) {
        let keys = std::mem::take(&mut self.keys);
        let mut left = &keys[..];
        while let Some(&key) = left.first() {
            let kind = sorting.kind(key);
            let count = match sorting.are_near(left) {
                true => {
                    let mut ids = [0; F32x16::LANES];
                    for (id, &key) in ids.iter_mut().zip(left) {
                        *id = who(key);
                    }
                    self.push(kind, &ids, sorting);
                    F32x16::LANES
                }
                false => {
                    self.rest[usize::from(kind.fades)].push(who(key));
                    1
                }
            };
            left = &left[count..];
            let next = left.first().map(|&key| sorting.kind(key).level);
            if next != Some(kind.level) {
                self.push_rest(F32x16::LANES, sorting);
            }
        }
        self.push_rest(1, sorting);
        self.keys = keys;
    }

    /// Adds groups of up to sixteen characters that do not share their loads, until fewer than `least` are left.
    fn push_rest(&mut self, least: usize, sorting: &mut Sorting<'_>) {
        for fades in [false, true] {
            let mut rest = std::mem::take(&mut self.rest[usize::from(fades)]);
            let mut pushed = 0;
            while rest.len() - pushed >= least {
                let mut ids = [Group::NOBODY; F32x16::LANES];
                for (to, &id) in ids.iter_mut().zip(&rest[pushed..]) {
                    *to = id;
                }
                // Keys are in the order of levels, so the first character has the finest.
                let kind = GroupKind {
                    level: sorting.states[ids[0] as usize].level(),
                    near: None,
                    fades,
                };
                self.push(kind, &ids, sorting);
                pushed = rest.len().min(pushed + F32x16::LANES);
            }
            rest.drain(..pushed);
            self.rest[usize::from(fades)] = rest;
        }
    }
}

impl Sorting<'_> {
    /// Kind of the groups for characters with this key that are near each other in time.
    fn kind(&self, key: u64) -> GroupKind {
        let plays = (key >> (TIME_BITS + ID_BITS)) as usize;
        let (kind, clip) = (
            plays / self.animations.clips(),
            plays % self.animations.clips(),
        );
        GroupKind {
            level: LevelId((kind / 2) as u16),
            near: Some(ClipId(clip as u32)),
            fades: kind % 2 == 1,
        }
    }

    /// Whether the first sixteen characters are near enough in time to share their loads for a while, although lanes drift
    /// apart.
    fn are_near(&self, keys: &[u64]) -> bool {
        let Some(sixteen) = keys.get(..F32x16::LANES) else {
            return false;
        };
        let plays = |key: u64| key >> (TIME_BITS + ID_BITS);
        if plays(sixteen[0]) != plays(sixteen[F32x16::LANES - 1]) {
            return false;
        }
        let clip = plays(sixteen[0]) as usize % self.animations.clips();
        let intervals = self.animations.range(ClipId(clip as u32)).intervals as u64;
        let time = |key: u64| key >> ID_BITS & ((1 << TIME_BITS) - 1);
        let between = time(sixteen[F32x16::LANES - 1]) - time(sixteen[0]);
        between * intervals <= NEAR << TIME_BITS
    }
}

fn who(key: u64) -> u32 {
    (key & MOST_CHARACTERS as u64) as u32
}
