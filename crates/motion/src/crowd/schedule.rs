//! The groups of a crowd, and their positions in the output.

use super::animation_set::AnimationSet;
use super::bucket::{Bucket, GroupKind, Parked, Piece};
use super::character::CharacterState;
use super::group::{Group, GroupCold};
use super::mix::Mix;
use super::output::{Layout, Output};
use super::slot::{MOST_LATE, Slot};
use crate::anim::ClipId;
use crate::math::{DistinctRows, F32x16};

/// The groups of a crowd, with buffers for sorting.
#[derive(Clone, Debug, Default)]
pub(super) struct Schedule {
    pub(super) groups: Vec<Group>,
    pub(super) cold: Vec<GroupCold>,
    /// [`GroupKind::near`] of each group.
    pub(super) near: Vec<Option<ClipId>>,
    /// For each group, a bit mask of the lanes inside the frustum. A group without any is not posed.
    pub(super) visible: Vec<u16>,
    /// Whether each group was visible in the previous frame. Its pose is then no older than [`Hold`](super::Hold) allows.
    pub(super) was_visible: Vec<bool>,
    pub(super) parked: Vec<Parked>,
    pub(super) buckets: Vec<Bucket>,
    pub(super) pieces: Vec<Piece>,
    /// End index of each chunk's pieces.
    pub(super) ends: Vec<usize>,
    /// Length of the whole output, in [`F32x16`]s.
    pub(super) lines: usize,
    /// Index of the first group that was added since the last sorting.
    pub(super) first_late: usize,
    /// Sort keys; from the highest bits: level, mixture, clip, position in the clip, character.
    pub(super) keys: Vec<u64>,
    pub(super) spare: Vec<u64>,
    /// Number of keys whose characters are in groups.
    pub(super) filled: usize,
    /// Whether all keys of the present level are read. The characters in `rest` are then put into groups.
    pub(super) is_level_read: bool,
    /// For each mixture, by [`Mix::index`], the number of characters of `rest` that are in groups.
    pub(super) pushed: [usize; Mix::COUNT],
    /// For each mixture, by [`Mix::index`], characters that share no loads and are to be put into groups of sixteen.
    pub(super) rest: [Vec<u32>; Mix::COUNT],
    /// For [`Layout::Instances`], the character whose row each lane writes.
    pub(super) rows: DistinctRows,
}

/// Inputs of sorting a crowd into groups.
pub(super) struct Sorting<'a> {
    pub(super) animations: &'a AnimationSet,
    pub(super) states: &'a [CharacterState],
    /// Group and lane of each character, as one number.
    pub(super) slots: &'a mut [u32],
    /// The crowd's time, in seconds.
    pub(super) now: f64,
    /// The crowd's time at which the groups' clock is 0, in seconds.
    pub(super) base: f64,
    pub(super) output: Output,
    /// Number of chunks that the groups are cut into, for threads to take.
    pub(super) chunks: usize,
}

impl Schedule {
    /// Maximum number of groups of `characters` characters: full ones, one more for each mixture, and those of characters
    /// that are moved later.
    pub(super) fn most_groups(characters: usize) -> usize {
        characters.div_ceil(F32x16::LANES) + Mix::COUNT + characters / MOST_LATE + 1
    }

    /// Reserves memory for any grouping of `characters` characters, including those that are moved later.
    pub(super) fn reserve(&mut self, characters: usize, chunks: usize) {
        let groups = Self::most_groups(characters);
        reserve(&mut self.groups, groups);
        reserve(&mut self.cold, groups);
        reserve(&mut self.near, groups);
        reserve(&mut self.visible, groups);
        reserve(&mut self.was_visible, groups);
        reserve(&mut self.parked, groups);
        reserve(&mut self.buckets, groups);
        self.rows.reserve(groups * F32x16::LANES, characters);
        reserve(&mut self.pieces, groups + chunks);
        reserve(&mut self.ends, chunks);
        for rest in &mut self.rest {
            reserve(rest, characters);
        }
        for keys in [&mut self.keys, &mut self.spare] {
            reserve(keys, characters);
        }
    }

    /// Adds a group behind all others.
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
        let GroupKind { level, near, mix } = kind;
        match self.buckets.last_mut() {
            Some(bucket)
                if (bucket.level, bucket.mix) == (level, mix) && index != self.first_late =>
            {
                bucket.groups.end = index + 1;
            }
            _ => self.buckets.push(Bucket {
                level,
                mix,
                groups: index..index + 1,
                offset: self.lines,
                lines,
            }),
        }
        self.groups.push(Group::EMPTY);
        self.near.push(near);
        self.visible.push(u16::MAX);
        self.was_visible.push(false);
        self.cold.push(GroupCold {
            kind,
            offset: self.lines,
            ..GroupCold::EMPTY
        });
        self.lines += lines;
        for (lane, &id) in ids.iter().enumerate() {
            // Unused lanes repeat the first character.
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

    /// Assigns a lane to a character.
    pub(super) fn enter(&mut self, slot: Slot, id: u32, sorting: &mut Sorting<'_>) {
        self.cold[slot.group].ids[slot.lane] = id;
        sorting.slots[id as usize] = slot.number();
        if sorting.output.layout == Layout::Instances {
            self.rows.grow(sorting.states.len());
            self.rows.put(slot.number() as usize, id);
        }
    }

    /// Makes a lane unused.
    pub(super) fn leave(&mut self, slot: Slot) {
        self.cold[slot.group].ids[slot.lane] = Group::NOBODY;
        self.rows.remove(slot.number() as usize);
    }
}

/// Reserves memory for `count` items in all.
fn reserve<T>(items: &mut Vec<T>, count: usize) {
    items.reserve(count.saturating_sub(items.len()));
}

/// The reference of positions in clips.
#[derive(Clone, Copy)]
pub(super) struct GroupClock<'a> {
    pub(super) animations: &'a AnimationSet,
    /// The crowd's time at which the groups' clock is 0, in seconds.
    pub(super) base: f64,
}

impl<'a> Sorting<'a> {
    pub(super) fn clock(&self) -> GroupClock<'a> {
        GroupClock {
            animations: self.animations,
            base: self.base,
        }
    }
}
