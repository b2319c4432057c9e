//! The groups of a crowd, and their positions in the output.

use bytemuck::Zeroable;

use super::group::{Bucket, Group, GroupCold, GroupKind, MOST_LATE, NOWHERE, Slot};
use crate::anim::ClipId;
use crate::crowd::character::CharacterState;
use crate::crowd::keys::animation_set::AnimationSet;
use crate::crowd::output::{Layout, Output};
use crate::math::{DistinctRows, F32x16};

/// The groups of a crowd, with buffers for sorting.
#[derive(Clone, Debug, Default)]
pub(crate) struct Schedule {
    pub(crate) groups: Vec<Group>,
    pub(crate) cold: Vec<GroupCold>,
    /// [`GroupKind::near`] of each group.
    pub(crate) near: Vec<Option<ClipId>>,
    pub(crate) buckets: Vec<Bucket>,
    pub(crate) pieces: Vec<Bucket>,
    /// End index of each chunk's pieces.
    pub(crate) ends: Vec<usize>,
    /// Length of the whole output, in [`F32x16`]s.
    pub(crate) lines: usize,
    /// Index of the first group that was added since the last sorting.
    pub(crate) first_late: usize,
    /// Sort keys; from the highest bits: level, whether it cross-fades, clip, position in the clip, character.
    pub(crate) keys: Vec<u64>,
    /// Characters that share no loads and are to be put into groups of sixteen: those that do not cross-fade, and those that
    /// do.
    pub(crate) rest: [Vec<u32>; 2],
    /// For [`Layout::Instances`], the character whose row each lane writes.
    pub(crate) rows: DistinctRows,
}

/// Inputs of sorting a crowd into groups.
pub(crate) struct Sorting<'a> {
    pub(crate) animations: &'a AnimationSet,
    pub(crate) states: &'a [CharacterState],
    /// Group and lane of each character, as one number.
    pub(crate) slots: &'a mut [u32],
    /// The crowd's time, in seconds.
    pub(crate) now: f64,
    /// The crowd's time at which the groups' clock is 0, in seconds.
    pub(crate) base: f64,
    pub(crate) output: Output,
    /// Number of chunks that the groups are cut into, for threads to take.
    pub(crate) chunks: usize,
}

impl Schedule {
    /// Maximum number of groups of `characters` characters: full ones, one more with and one without cross-fades, and those of characters
    /// that are moved later.
    pub(crate) fn most_groups(characters: usize) -> usize {
        characters.div_ceil(F32x16::LANES) + 2 + characters / MOST_LATE + 1
    }

    /// Reserves memory for any grouping of `characters` characters, including those that are moved later.
    pub(crate) fn reserve(&mut self, characters: usize, chunks: usize) {
        let groups = Self::most_groups(characters);
        reserve(&mut self.groups, groups);
        reserve(&mut self.cold, groups);
        reserve(&mut self.near, groups);
        reserve(&mut self.buckets, groups);
        self.rows.reserve(groups * F32x16::LANES, characters);
        reserve(&mut self.pieces, groups + chunks);
        reserve(&mut self.ends, chunks);
        for rest in &mut self.rest {
            reserve(rest, characters);
        }
        reserve(&mut self.keys, characters);
    }

    /// Adds a group behind all others.
    pub(crate) fn push(
        &mut self,
        kind: GroupKind,
        ids: &[u32; F32x16::LANES],
        sorting: &mut Sorting<'_>,
    ) {
        let index = self.groups.len();
        let lines = sorting
            .output
            .group_len(sorting.animations.joints(kind.level));
        let GroupKind { level, near, fades } = kind;
        match self.buckets.last_mut() {
            Some(bucket)
                if (bucket.level, bucket.fades) == (level, fades) && index != self.first_late =>
            {
                bucket.groups.end = index + 1;
            }
            _ => self.buckets.push(Bucket {
                level,
                fades,
                groups: index..index + 1,
                offset: self.lines,
                lines,
            }),
        }
        self.groups.push(Group::zeroed());
        self.near.push(near);
        self.cold.push(GroupCold::empty(kind, self.lines));
        self.lines += lines;
        for (lane, &id) in ids.iter().enumerate() {
            // Unused lanes repeat the first character.
            let shown = if id == Group::NOBODY { ids[0] } else { id };
            let slot = Slot { group: index, lane };
            if let Some(state) = sorting.states.get(shown as usize) {
                self.write(slot, state, sorting.animations, sorting.base);
            }
            if id != Group::NOBODY {
                self.enter(slot, id, sorting);
            }
        }
    }

    /// Writes a character into a lane.
    pub(crate) fn write(
        &mut self,
        Slot { group, lane }: Slot,
        state: &CharacterState,
        animations: &AnimationSet,
        base: f64,
    ) {
        let clips = state.lane(animations, base);
        self.groups[group].write(lane, state, &clips[0]);
        self.cold[group].write(lane, &clips);
    }

    /// Assigns a lane to a character.
    pub(crate) fn enter(&mut self, slot: Slot, id: u32, sorting: &mut Sorting<'_>) {
        self.cold[slot.group].ids[slot.lane] = id;
        sorting.slots[id as usize] = slot.number();
        if sorting.output.layout == Layout::Instances {
            self.rows.grow(sorting.states.len());
            self.rows.put(slot.number() as usize, id);
        }
    }
}

fn reserve<T>(items: &mut Vec<T>, count: usize) {
    items.reserve(count.saturating_sub(items.len()));
}

impl Schedule {
    /// Puts characters that do not fit their groups, or that were added, into groups of their own at the end.
    pub(crate) fn move_late(&mut self, late: &[u32], mut sorting: Sorting<'_>) {
        for &id in late {
            self.vacate(id, &mut sorting);
            let state = &sorting.states[id as usize];
            if state.is_inactive {
                continue;
            }
            let own = GroupKind {
                level: state.level(),
                near: None,
                fades: state.fades,
            };
            // Only the last few groups are searched; others seldom have a free lane.
            let mut open = (self.first_late..self.groups.len()).rev().take(4);
            let vacancy = open.find_map(|group| {
                let cold = &self.cold[group];
                let lane = cold.ids.iter().position(|&id| id == Group::NOBODY)?;
                cold.kind.takes(state).then_some(Slot { group, lane })
            });
            match vacancy {
                Some(slot) => {
                    self.write(slot, state, sorting.animations, sorting.base);
                    self.enter(slot, id, &mut sorting);
                }
                None => {
                    let mut ids = [Group::NOBODY; F32x16::LANES];
                    ids[0] = id;
                    self.push(own, &ids, &mut sorting);
                }
            }
        }
        self.share_out(sorting.chunks);
    }

    fn vacate(&mut self, id: u32, sorting: &mut Sorting<'_>) {
        let slot = std::mem::replace(&mut sorting.slots[id as usize], NOWHERE);
        if slot == NOWHERE {
            return;
        }
        let slot = Slot::from_number(slot);
        let Slot { group, lane } = slot;
        self.cold[group].ids[lane] = Group::NOBODY;
        self.rows.remove(slot.number() as usize);
        let stays = |(_, id): &(usize, u32)| {
            let state = sorting.states.get(*id as usize);
            state.is_some_and(|state| !state.is_late)
        };
        let mut others = self.cold[group].ids.into_iter().enumerate();
        if let Some((other, id)) = others.find(stays) {
            let detail = self.groups[group].detail.0[other];
            let state = &sorting.states[id as usize];
            self.write(slot, state, sorting.animations, sorting.base);
            self.groups[group].detail.0[lane] = detail;
        }
    }

    /// Resets the groups' clock to 0.
    pub(crate) fn rebase(&mut self, sorting: &Sorting<'_>) {
        for group in 0..self.groups.len() {
            let ids = self.cold[group].ids;
            let Some(&any) = ids.iter().find(|&&id| id != Group::NOBODY) else {
                continue;
            };
            let detail = self.groups[group].detail;
            for (lane, id) in ids.into_iter().enumerate() {
                let shown = if id == Group::NOBODY { any } else { id };
                let state = &sorting.states[shown as usize];
                self.write(
                    Slot { group, lane },
                    state,
                    sorting.animations,
                    sorting.base,
                );
            }
            self.groups[group].detail = detail;
        }
    }

    /// Copies the levels that frames have chosen from the groups to the characters.
    pub(crate) fn store_details(&self, states: &mut [CharacterState]) {
        for (group, cold) in self.groups.iter().zip(&self.cold) {
            for (lane, &id) in cold.ids.iter().enumerate() {
                if let Some(state) = states.get_mut(id as usize)
                    && !state.is_late
                {
                    state.detail = group.detail.0[lane];
                }
            }
        }
    }
}

/// Extra cost of posing the present groups instead of new ones. The unit is a fiftieth of the time that sorting one
/// character takes: about a nanosecond.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StaleCost {
    /// Extra cost of all frames since the last sorting.
    pub(crate) total: usize,
    /// Number of joints that are posed beyond those of the characters' levels, because characters stay in their groups.
    pub(crate) joints: isize,
    /// Number of characters that were moved to other groups.
    pub(crate) late: usize,
    /// Number of groups whose characters were not near each other in time in the first frame: with narrow registers, some
    /// are not.
    apart: Option<usize>,
}

impl StaleCost {
    /// Cost of sorting a character.
    const CHARACTER: usize = 50;
    /// Extra cost of a frame for each group whose characters are no longer near each other in time.
    const APART: usize = 100;
    /// Extra cost of a frame for each moved character, whose group is not full.
    const LATE: usize = 4;

    /// Adds the extra cost of a frame in which `apart` groups had characters that are not near each other in time.
    pub(crate) fn add_frame(&mut self, apart: usize) {
        let joints = self.joints.max(0) as usize;
        let apart = apart.saturating_sub(*self.apart.get_or_insert(apart));
        self.total += Self::APART * apart + Self::LATE * self.late + joints;
    }

    /// Whether the extra cost has reached the cost of sorting.
    pub(crate) fn exceeds_sorting(&self, characters: usize) -> bool {
        self.total >= Self::CHARACTER * characters
    }
}

impl Schedule {
    /// Cuts the groups into chunks of equal lengths in the output.
    pub(crate) fn share_out(&mut self, chunks: usize) {
        self.pieces.clear();
        self.ends.clear();
        for chunk in 0..chunks {
            let start = self.lines * chunk / chunks;
            let end = self.lines * (chunk + 1) / chunks;
            for bucket in &self.buckets {
                // A group belongs to the chunk in which it starts.
                let up_to = |line: usize| {
                    let groups = line.saturating_sub(bucket.offset).div_ceil(bucket.lines);
                    groups.min(bucket.groups.len())
                };
                let (from, to) = (up_to(start), up_to(end));
                if from < to {
                    self.pieces.push(Bucket {
                        groups: bucket.groups.start + from..bucket.groups.start + to,
                        offset: bucket.offset + from * bucket.lines,
                        ..*bucket
                    });
                }
            }
            self.ends.push(self.pieces.len());
        }
    }

    /// The pieces of one chunk, in the order of the output.
    pub(crate) fn part(&self, chunk: usize) -> &[Bucket] {
        let start = chunk.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.pieces[start..self.ends[chunk]]
    }
}
