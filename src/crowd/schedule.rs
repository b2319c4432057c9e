//! Which characters form a group.
//!
//! Sixteen characters of one clip and level that are near each other in time share their loads. The others fill groups in the
//! order of their levels, whatever they play: a group is posed on the finest level of its characters, and those that may be
//! coarser are made to look so. So few lanes stay empty, however many clips and levels there are.

use super::animation_set::AnimationSet;
use super::bucket::{Bucket, GroupKind, Mix, Parked, Piece};
use super::character::CharacterState;
use super::group::{Group, GroupCold};
use super::output::{Layout, Output};
use super::radix_sort;
use super::slot::{ID_BITS, MOST, MOST_LATE, NOWHERE, Slot};
use crate::math::{DistinctRows, F32x16};

/// The order of a crowd.
#[derive(Clone, Debug, Default)]
pub(super) struct Schedule {
    pub(super) groups: Vec<Group>,
    pub(super) cold: Vec<GroupCold>,
    /// Lanes of each group that are inside the frustum, a bit each. A group without any is not posed.
    pub(super) visible: Vec<u16>,
    /// Whether each group was visible in the frame before, and so its pose is at most as old as it may be.
    pub(super) was_visible: Vec<bool>,
    pub(super) parked: Vec<Parked>,
    pub(super) buckets: Vec<Bucket>,
    pub(super) pieces: Vec<Piece>,
    /// Where the pieces of each chunk end.
    pub(super) ends: Vec<usize>,
    /// Of the whole output.
    pub(super) lines: usize,
    /// The first group that was added since the last sorting.
    pub(super) first_late: usize,
    /// Sorted: level, what is mixed in, clip, position in it, character.
    keys: Vec<u64>,
    spare: Vec<u64>,
    /// Fewer than sixteen characters that are not near others, by [`Mix::index`].
    rest: [Vec<u32>; Mix::COUNT],
    /// Of [`Layout::Instances`]: which character's row each lane writes.
    pub(super) rows: DistinctRows,
}

/// Bits of a key, from the lowest: character ([`ID_BITS`]), position in the clip, what is played (22).
const TIME_BITS: u32 = 14;

/// Sixteen characters within so many intervals share their loads, and go on doing so for a while.
const NEAR: u64 = 12;

/// What the order follows from.
pub(super) struct Sorting<'a> {
    pub(super) animations: &'a AnimationSet,
    pub(super) states: &'a [CharacterState],
    /// Of each character its group and lane, as one number.
    pub(super) slots: &'a mut [u32],
    /// The crowd's time, in seconds.
    pub(super) now: f64,
    /// The time at which the groups' clock stands at 0.
    pub(super) base: f64,
    pub(super) output: Output,
    /// Number of chunks that the groups are cut into, for threads to take.
    pub(super) chunks: usize,
}

impl Schedule {
    /// Puts all characters into groups. Allocates only where a crowd has grown.
    pub(super) fn sort(&mut self, mut sorting: Sorting<'_>) {
        self.order(&sorting);
        self.fill(&mut sorting);
        self.share_out(sorting.chunks);
    }

    fn order(&mut self, sorting: &Sorting<'_>) {
        let Sorting {
            animations, now, ..
        } = *sorting;
        let clips = animations.clips();
        self.keys.clear();
        let present = sorting.states.iter().enumerate();
        let present = present.filter(|(_, state)| !state.is_inactive && !state.is_culled);
        self.keys.extend(present.map(|(id, state)| {
            let at = state.share(animations, now);
            let time = (at * (1 << TIME_BITS) as f32) as u64;
            let time = time.min((1 << TIME_BITS) - 1);
            let kind = Mix::COUNT * state.level().index() + state.mix.index();
            let plays = (kind * clips + state.clip.index()) as u64;
            plays << (TIME_BITS + ID_BITS) | time << ID_BITS | id as u64
        }));
        let kinds = Mix::COUNT * animations.levels() * clips;
        let bits = ID_BITS + TIME_BITS + kinds.next_power_of_two().ilog2();
        radix_sort::sort(&mut self.keys, &mut self.spare, (ID_BITS, bits));
    }

    /// Fills groups in the order of the keys.
    fn fill(&mut self, sorting: &mut Sorting<'_>) {
        self.groups.clear();
        self.cold.clear();
        self.visible.clear();
        self.was_visible.clear();
        self.parked.clear();
        self.buckets.clear();
        self.lines = 0;
        self.first_late = usize::MAX;
        self.reserve(sorting.states.len(), sorting.chunks);
        self.rows.reset(sorting.states.len());
        sorting.slots.fill(NOWHERE);
        let keys = std::mem::take(&mut self.keys);
        let level = |key: &u64| sorting.states[who(*key)].level();
        for same_level in keys.chunk_by(|a, b| level(a) == level(b)) {
            self.fill_level(same_level, sorting);
        }
        self.keys = keys;
        for mix in Mix::all() {
            self.push_rest(mix, sorting);
        }
        self.first_late = self.groups.len();
        for (id, state) in sorting.states.iter().enumerate() {
            if state.is_culled && !state.is_inactive {
                self.park(id as u32, sorting.states, sorting.slots);
            }
        }
    }

    /// Full groups of so many characters, one more for each kind of rest, and those of characters that are moved later.
    pub(super) fn most_groups(characters: usize) -> usize {
        characters.div_ceil(F32x16::LANES) + Mix::COUNT + characters / MOST_LATE + 1
    }

    /// Memory for any order of so many characters, and for those that are moved later.
    pub(super) fn reserve(&mut self, characters: usize, chunks: usize) {
        let groups = Self::most_groups(characters);
        self.groups.reserve(groups);
        self.cold.reserve(groups);
        self.visible.reserve(groups);
        self.was_visible.reserve(groups);
        self.parked.reserve(groups);
        self.buckets.reserve(groups);
        self.rows.reserve(groups * F32x16::LANES, characters);
        self.pieces
            .reserve((groups + chunks).saturating_sub(self.pieces.len()));
        for rest in &mut self.rest {
            rest.reserve(characters);
        }
        for keys in [&mut self.keys, &mut self.spare] {
            keys.reserve(characters.saturating_sub(keys.len()));
        }
    }

    /// Groups of characters that are near each other; then of the others and of those left over from finer levels, as long as
    /// there are sixteen.
    fn fill_level(&mut self, mut left: &[u64], sorting: &mut Sorting<'_>) {
        while let Some(&key) = left.first() {
            let state = &sorting.states[who(key)];
            if sorting.are_near(left) {
                let kind = GroupKind {
                    level: state.level(),
                    near: Some(state.clip),
                    mix: state.mix,
                };
                let (near, others) = left.split_at(F32x16::LANES);
                let mut ids = [0; F32x16::LANES];
                for (id, &key) in ids.iter_mut().zip(near) {
                    *id = who(key) as u32;
                }
                self.push(kind, &ids, sorting);
                left = others;
            } else {
                self.rest[state.mix.index()].push(who(key) as u32);
                left = &left[1..];
            }
        }
        for mix in Mix::all() {
            let mut rest = std::mem::take(&mut self.rest[mix.index()]);
            let sixteens = rest.chunks_exact(F32x16::LANES);
            let left = rest.len() - sixteens.remainder().len();
            for ids in sixteens {
                self.push_mixed(ids, mix, sorting);
            }
            rest.drain(..left);
            self.rest[mix.index()] = rest;
        }
    }

    /// The last group, of the characters that are left over.
    fn push_rest(&mut self, mix: Mix, sorting: &mut Sorting<'_>) {
        let mut rest = std::mem::take(&mut self.rest[mix.index()]);
        if !rest.is_empty() {
            self.push_mixed(&rest, mix, sorting);
        }
        rest.clear();
        self.rest[mix.index()] = rest;
    }

    /// A group of up to sixteen characters, the one of the finest level first.
    fn push_mixed(&mut self, members: &[u32], mix: Mix, sorting: &mut Sorting<'_>) {
        let mut ids = [Group::NOBODY; F32x16::LANES];
        ids[..members.len()].copy_from_slice(members);
        let kind = GroupKind {
            level: sorting.states[members[0] as usize].level(),
            near: None,
            mix,
        };
        self.push(kind, &ids, sorting);
    }

    /// One more group, behind all others.
    pub(super) fn push(
        &mut self,
        kind: GroupKind,
        ids: &[u32; F32x16::LANES],
        sorting: &mut Sorting<'_>,
    ) {
        let index = self.groups.len();
        let lines = sorting
            .output
            .group_len(sorting.animations.joints(kind.level));
        match self.buckets.last_mut() {
            Some(bucket) if bucket.kind == kind && index != self.first_late => {
                bucket.groups.end = index + 1;
            }
            _ => self.buckets.push(Bucket {
                kind,
                groups: index..index + 1,
                offset: self.lines,
                lines,
            }),
        }
        self.groups.push(Group::EMPTY);
        self.visible.push(u16::MAX);
        self.was_visible.push(false);
        self.cold.push(GroupCold {
            kind,
            offset: self.lines,
            ..GroupCold::EMPTY
        });
        self.lines += lines;
        for (lane, &id) in ids.iter().enumerate() {
            // Lanes that nobody uses repeat the first.
            let shown = if id == Group::NOBODY { ids[0] } else { id };
            let slot = Slot { group: index, lane };
            if let Some(state) = sorting.states.get(shown as usize) {
                self.write(slot, state, sorting.clock());
            }
            if id != Group::NOBODY {
                self.enter(slot, id, sorting);
            }
        }
    }

    /// Writes a character into a lane.
    pub(super) fn write(&mut self, slot: Slot, state: &CharacterState, clock: GroupClock<'_>) {
        let GroupClock { animations, base } = clock;
        let Slot { group, lane } = slot;
        let clips = state.lane(animations, base);
        self.groups[group].write(lane, state, &clips.own);
        self.cold[group].write(lane, &clips);
    }

    /// Makes a lane a character's own.
    pub(super) fn enter(&mut self, slot: Slot, id: u32, sorting: &mut Sorting<'_>) {
        self.cold[slot.group].ids[slot.lane] = id;
        sorting.slots[id as usize] = slot.number();
        if sorting.output.layout == Layout::Instances {
            self.rows.grow(sorting.states.len());
            self.rows.put(slot.number() as usize, id);
        }
    }

    /// Makes a lane nobody's.
    pub(super) fn leave(&mut self, slot: Slot) {
        self.cold[slot.group].ids[slot.lane] = Group::NOBODY;
        self.rows.remove(slot.number() as usize);
    }
}

/// What positions in clips are counted from.
#[derive(Clone, Copy)]
pub(super) struct GroupClock<'a> {
    pub(super) animations: &'a AnimationSet,
    /// The time at which the groups' clock stands at 0, in seconds.
    pub(super) base: f64,
}

impl<'a> Sorting<'a> {
    pub(super) fn clock(&self) -> GroupClock<'a> {
        GroupClock {
            animations: self.animations,
            base: self.base,
        }
    }

    /// Whether the first sixteen can share their loads for a while: lanes drift apart.
    fn are_near(&self, keys: &[u64]) -> bool {
        let Some(sixteen) = keys.get(..F32x16::LANES) else {
            return false;
        };
        let plays = |key: u64| key >> (TIME_BITS + ID_BITS);
        if plays(sixteen[0]) != plays(sixteen[F32x16::LANES - 1]) {
            return false;
        }
        let clip = self.states[who(sixteen[0])].clip;
        let intervals = self.animations.range(clip).intervals as u64;
        let time = |key: u64| key >> ID_BITS & ((1 << TIME_BITS) - 1);
        let between = time(sixteen[F32x16::LANES - 1]) - time(sixteen[0]);
        between * intervals <= NEAR << TIME_BITS
    }
}

fn who(key: u64) -> usize {
    (key & MOST as u64) as usize
}
