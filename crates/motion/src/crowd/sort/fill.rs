//! Sorts characters into groups of sixteen.
//!
//! The method is ours. Sixteen characters of one clip and level that are near each other in time form a group and share their
//! loads. The others fill groups in the order of their levels, whatever they play. Such a group is posed on the finest level of
//! its characters, and those with coarser levels are blended to look like them. Few lanes therefore stay empty, however many
//! clips and levels there are.
//!
//! ```text
//! key of each character = level, whether it cross-fades, clip, position in the clip, number
//! sort the keys by radix
//! for each level:
//!     while keys are left:
//!         if the next sixteen play one clip, near each other in time: they are a group
//!         else the next one waits in a list
//!     each sixteen of the list are a group; fewer wait for the next level
//! ```

use std::ops::Range;

use super::group::{Group, GroupKind, NOWHERE};
use super::schedule::{Schedule, Sorting};
use crate::anim::ClipId;
use crate::crowd::character::CharacterState;
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

/// An amount of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FillWork(usize);

impl FillWork {
    /// All the work that is left.
    pub(crate) const ALL: Self = Self(usize::MAX);
    /// Work of reading a key.
    const KEY: usize = 1;
    /// Work of filling a group.
    const GROUP: usize = 128;

    /// The work of grouping `characters` characters, divided by `parts`.
    pub(crate) fn part(characters: usize, parts: usize) -> Self {
        let groups = characters.div_ceil(F32x16::LANES);
        Self((characters * Self::KEY + groups * Self::GROUP).div_ceil(parts))
    }
}

impl Schedule {
    /// Puts all characters into groups. Allocates only where a crowd has grown.
    pub(crate) fn sort(&mut self, mut sorting: Sorting<'_>) {
        self.begin(&mut sorting);
        self.add_keys(0..sorting.states.len(), &sorting);
        for digit in 0..sorting.digits() {
            self.sort_digit(digit, &sorting);
        }
        self.fill(FillWork::ALL, &mut sorting);
        self.end(&mut sorting);
    }

    /// Removes all groups and keys.
    pub(crate) fn begin(&mut self, sorting: &mut Sorting<'_>) {
        self.groups.clear();
        self.cold.clear();
        self.near.clear();
        self.visible.clear();
        self.parked.clear();
        self.buckets.clear();
        self.keys.clear();
        for rest in &mut self.rest {
            rest.clear();
        }
        self.filled = 0;
        self.is_level_read = false;
        self.pushed = [0; 2];
        self.lines = 0;
        self.first_late = usize::MAX;
        self.reserve(sorting.states.len(), sorting.chunks);
        self.rows.reset(sorting.states.len());
        sorting.slots.fill(NOWHERE);
    }

    /// Adds the keys of the characters `ids`.
    pub(crate) fn add_keys(&mut self, ids: Range<usize>, sorting: &Sorting<'_>) {
        let Sorting {
            animations, now, ..
        } = *sorting;
        let clips = animations.clips();
        let present = ids.clone().zip(&sorting.states[ids]);
        let present = present.filter(|(_, state)| !state.is_inactive && !state.is_culled);
        self.keys.extend(present.map(|(id, state)| {
            let at = state.share(animations, now);
            let time = (at * (1 << TIME_BITS) as f32) as u64;
            let time = time.min((1 << TIME_BITS) - 1);
            let kind = 2 * state.level().index() + usize::from(state.fades);
            let plays = (kind * clips + state.clip.index()) as u64;
            plays << (TIME_BITS + ID_BITS) | time << ID_BITS | id as u64
        }));
    }

    /// Sorts the keys by one digit. Digits must be sorted from the lowest to the highest.
    pub(crate) fn sort_digit(&mut self, digit: u32, sorting: &Sorting<'_>) {
        let low = ID_BITS + digit * DIGIT;
        let high = sorting.key_bits().min(low + DIGIT);
        radix_sort(&mut self.keys, &mut self.spare, low..high);
    }

    /// Fills groups in the order of the keys until the work reaches `most`; returns whether all keys are done.
    pub(crate) fn fill(&mut self, most: FillWork, sorting: &mut Sorting<'_>) -> bool {
        let keys = std::mem::take(&mut self.keys);
        let mut work = 0;
        while work < most.0 && (self.is_level_read || self.filled < keys.len()) {
            if self.is_level_read {
                self.is_level_read = self.push_sixteen(sorting);
                work += FillWork::GROUP;
                continue;
            }
            let left = &keys[self.filled..];
            let kind = sorting.kind(left[0]);
            if sorting.are_near(left) {
                let mut ids = [0; F32x16::LANES];
                for (id, &key) in ids.iter_mut().zip(left) {
                    *id = who(key) as u32;
                }
                self.push_fitting(kind, &ids, sorting);
                self.filled += F32x16::LANES;
                work += FillWork::GROUP;
            } else {
                self.rest[usize::from(kind.fades)].push(who(left[0]) as u32);
                self.filled += 1;
                work += FillWork::KEY;
            }
            let next = keys.get(self.filled).map(|&key| sorting.kind(key).level);
            self.is_level_read = next != Some(kind.level);
        }
        let is_done = !self.is_level_read && self.filled == keys.len();
        self.keys = keys;
        is_done
    }

    /// Adds the last groups, parks characters that are not visible, and cuts the groups into chunks. From now on, only
    /// moving characters adds groups.
    pub(crate) fn end(&mut self, sorting: &mut Sorting<'_>) {
        for fades in [false, true] {
            self.push_rest(fades, sorting);
        }
        self.first_late = self.groups.len();
        for id in 0..sorting.slots.len() {
            if sorting.slots[id] == NOWHERE {
                let state = &sorting.states[id];
                if state.is_culled && !state.is_inactive {
                    self.park(id as u32, sorting.states, sorting.slots);
                }
            }
        }
        self.share_out(sorting.chunks);
    }

    /// Adds a group of sixteen characters that do not share their loads; returns false if fewer are left, with and without
    /// cross-fades. Some may be left over from finer levels.
    fn push_sixteen(&mut self, sorting: &mut Sorting<'_>) -> bool {
        for fades in [false, true] {
            let kind = usize::from(fades);
            let pushed = self.pushed[kind];
            if let Some(&ids) = self.rest[kind][pushed..].first_chunk() {
                self.pushed[kind] += F32x16::LANES;
                self.push_mixed(&ids, fades, sorting);
                return true;
            }
            self.rest[kind].drain(..pushed);
            self.pushed[kind] = 0;
        }
        false
    }

    /// Adds the last group with or without cross-fades, of the characters that are left over.
    fn push_rest(&mut self, fades: bool, sorting: &mut Sorting<'_>) {
        let rest = &mut self.rest[usize::from(fades)];
        let mut ids = [Group::NOBODY; F32x16::LANES];
        for (to, id) in ids.iter_mut().zip(rest.drain(..)) {
            *to = id;
        }
        self.push_mixed(&ids, fades, sorting);
    }

    /// Adds a group of up to sixteen characters that do not share their loads.
    fn push_mixed(&mut self, ids: &[u32; F32x16::LANES], fades: bool, sorting: &mut Sorting<'_>) {
        let states = ids.iter().filter_map(|&id| sorting.states.get(id as usize));
        let kind = GroupKind {
            level: states.map(CharacterState::level).min().unwrap_or_default(),
            near: None,
            fades,
        };
        self.push_fitting(kind, ids, sorting);
    }

    /// Adds a group of those of `ids` that fit `kind`. Others have changed since their keys were recorded.
    fn push_fitting(
        &mut self,
        kind: GroupKind,
        ids: &[u32; F32x16::LANES],
        sorting: &mut Sorting<'_>,
    ) {
        let mut fitting = [Group::NOBODY; F32x16::LANES];
        let mut count = 0;
        for &id in ids {
            let state = sorting.states.get(id as usize);
            if state.is_some_and(|state| !state.is_inactive && kind.takes(state)) {
                fitting[count] = id;
                count += 1;
            }
        }
        if count > 0 {
            self.push(kind, &fitting, sorting);
        }
    }
}

impl Sorting<'_> {
    /// Number of bits of a key.
    fn key_bits(&self) -> u32 {
        let kinds = 2 * self.animations.levels() * self.animations.clips();
        ID_BITS + TIME_BITS + kinds.next_power_of_two().ilog2()
    }

    /// Number of digits by which keys are sorted.
    pub(crate) fn digits(&self) -> u32 {
        (self.key_bits() - ID_BITS).div_ceil(DIGIT)
    }

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

fn who(key: u64) -> usize {
    (key & MOST_CHARACTERS as u64) as usize
}

/// Number of bits of a digit, by which one pass sorts.
const DIGIT: u32 = 11;
const VALUES: usize = 1 << DIGIT;

/// Radix sort, least significant digit first: linear in the number of keys, and the same time whatever their order. Sorts
/// by the bits in `bits`; equal keys stay in their order. `spare` may have any length and content.
fn radix_sort(keys: &mut Vec<u64>, spare: &mut Vec<u64>, bits: Range<u32>) {
    spare.resize(keys.len(), 0);
    for shift in bits.clone().step_by(DIGIT as usize) {
        let width = DIGIT.min(bits.end - shift);
        let digit = |key: u64| (key >> shift) as usize & ((1 << width) - 1);
        let mut places = [0u32; VALUES];
        for &key in keys.iter() {
            places[digit(key)] += 1;
        }
        let mut sum = 0;
        for place in &mut places {
            sum += std::mem::replace(place, sum);
        }
        for &key in keys.iter() {
            let place = &mut places[digit(key)];
            spare[*place as usize] = key;
            *place += 1;
        }
        std::mem::swap(keys, spare);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn keys_are_sorted_as_the_library_sorts(
            keys in prop::collection::vec(0u64.., 0..3000),
            low in 0u32..40,
            width in 0u32..=24,
        ) {
            let bits = low..low + width;
            let mut expected = keys.clone();
            expected.sort_by_key(|&key| key >> bits.start & ((1 << width) - 1));
            let (mut keys, mut spare) = (keys, Vec::new());
            radix_sort(&mut keys, &mut spare, bits);
            prop_assert_eq!(keys, expected);
        }
    }
}
