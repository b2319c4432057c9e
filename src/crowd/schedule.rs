//! Who stands beside whom.
//!
//! Sixteen characters of one clip and level who are near each other in time share their loads. The
//! others fill groups in the order of their levels, whatever they play: a group is posed on the
//! finest level of its characters, and those who may be coarser are made to look so. So few lanes
//! stay empty, however many clips and levels there are.

use std::ops::Range;

use super::animation_set::AnimationSet;
use super::character::{CharacterState, ClipId};
use super::group::{Group, GroupCold};
use super::instances::MOST_LATE;
use super::output::Output;
use super::radix_sort;
use crate::lod::LevelId;
use crate::math::F32x16;

/// How a group is posed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct GroupKind {
    /// The finest that one of them needs.
    pub(super) level: LevelId,
    /// The clip of all, who are near each other in time.
    pub(super) near: Option<ClipId>,
    /// Whether there is a second clip.
    pub(super) is_fading: bool,
}

/// Groups of one kind that stand together.
#[derive(Clone, Debug)]
pub(super) struct Bucket {
    pub(super) kind: GroupKind,
    pub(super) groups: Range<usize>,
    pub(super) offset: usize,
    /// Of each group.
    pub(super) lines: usize,
}

/// Sixteen characters outside the frustum, which are not posed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parked {
    pub(super) x: F32x16,
    pub(super) y: F32x16,
    pub(super) z: F32x16,
    /// [`Group::NOBODY`] for lanes that are not used.
    pub(super) ids: [u32; F32x16::LANES],
}

/// Groups of one bucket in one chunk.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub(super) kind: GroupKind,
    pub(super) groups: Range<usize>,
    pub(super) lines: Range<usize>,
}

/// The order of a crowd.
#[derive(Clone, Debug, Default)]
pub(super) struct Schedule {
    pub(super) groups: Vec<Group>,
    pub(super) cold: Vec<GroupCold>,
    /// Lanes of each group that are inside the frustum, a bit each. A group without any is not posed.
    pub(super) visible: Vec<u16>,
    pub(super) parked: Vec<Parked>,
    pub(super) buckets: Vec<Bucket>,
    pieces: Vec<Piece>,
    /// Where the pieces of each chunk end.
    ends: Vec<usize>,
    /// Of the whole output.
    pub(super) lines: usize,
    /// The first of the groups of those who have come since the last sorting.
    first_late: usize,
    /// Sorted: the level, whether there is a second clip, the clip, where in it, and who.
    keys: Vec<u64>,
    spare: Vec<u64>,
    /// Those who are not near others, with one clip and with two: not sixteen yet.
    rest: [Vec<u32>; 2],
}

/// Bits of a key, from the lowest: who, where in the clip, what is played (22).
const ID_BITS: u32 = 28;
const TIME_BITS: u32 = 14;

/// Sixteen who are within so many intervals can share loads of sixteen words, and for a while yet.
const NEAR: u64 = 12;

/// A crowd may not have more characters.
pub(super) const MOST: usize = (1 << ID_BITS) - 1;

/// The slot of a character that is in no group.
pub(super) const NOWHERE: u32 = u32::MAX;

/// Set in the slots of parked characters.
pub(super) const PARKED: u32 = 1 << 31;

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
    /// Puts everybody where they belong. Allocates only where a crowd has grown.
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
            let range = animations.range(state.clip);
            let at = state.start(range, now) / range.intervals as f32;
            let time = (at * (1 << TIME_BITS) as f32) as u64;
            let time = time.min((1 << TIME_BITS) - 1);
            let kind = 2 * state.level().index() + usize::from(state.is_fading);
            let plays = (kind * clips + state.clip.index()) as u64;
            plays << (TIME_BITS + ID_BITS) | time << ID_BITS | id as u64
        }));
        let kinds = 2 * animations.levels() * clips;
        let bits = ID_BITS + TIME_BITS + kinds.next_power_of_two().ilog2();
        radix_sort::sort(&mut self.keys, &mut self.spare, (ID_BITS, bits));
    }

    /// Fills groups in the order of the keys.
    fn fill(&mut self, sorting: &mut Sorting<'_>) {
        self.groups.clear();
        self.cold.clear();
        self.visible.clear();
        self.parked.clear();
        self.buckets.clear();
        self.lines = 0;
        self.reserve(sorting.states.len(), sorting.chunks);
        sorting.slots.fill(NOWHERE);
        let keys = std::mem::take(&mut self.keys);
        let level = |key: &u64| sorting.states[who(*key)].level();
        for same_level in keys.chunk_by(|a, b| level(a) == level(b)) {
            self.fill_level(same_level, sorting);
        }
        self.keys = keys;
        for is_fading in [false, true] {
            self.push_rest(is_fading, sorting);
        }
        self.first_late = self.groups.len();
        for (id, state) in sorting.states.iter().enumerate() {
            if state.is_culled && !state.is_inactive {
                self.park(id as u32, sorting.states, sorting.slots);
            }
        }
    }

    /// Puts a character that is in no group among those that are not posed.
    fn park(&mut self, id: u32, states: &[CharacterState], slots: &mut [u32]) {
        let free = |parked: &Parked| parked.ids.iter().position(|&id| id == Group::NOBODY);
        let lane = match self.parked.last().and_then(free) {
            Some(lane) => lane,
            None => {
                self.parked.push(Parked {
                    x: F32x16::ZERO,
                    y: F32x16::ZERO,
                    z: F32x16::ZERO,
                    ids: [Group::NOBODY; F32x16::LANES],
                });
                0
            }
        };
        let index = self.parked.len() - 1;
        let state = &states[id as usize];
        let parked = &mut self.parked[index];
        parked.ids[lane] = id;
        parked.move_to(lane, state);
        slots[id as usize] = PARKED | (index * F32x16::LANES + lane) as u32;
    }

    /// For any order of so many characters, and for those who come late.
    pub(super) fn reserve(&mut self, characters: usize, chunks: usize) {
        let full = characters / F32x16::LANES + 2;
        let groups = full + characters / MOST_LATE + 2;
        self.groups.reserve(groups);
        self.cold.reserve(groups);
        self.visible.reserve(groups);
        self.parked.reserve(groups);
        self.buckets.reserve(groups);
        self.pieces
            .reserve((groups + chunks).saturating_sub(self.pieces.len()));
        for rest in &mut self.rest {
            rest.reserve(characters);
        }
    }

    /// Groups of those who are near each other, then of the others and of those who were left of
    /// finer levels, as long as there are sixteen.
    fn fill_level(&mut self, mut left: &[u64], sorting: &mut Sorting<'_>) {
        while let Some(&key) = left.first() {
            let state = &sorting.states[who(key)];
            if !state.is_fading && sorting.are_near(left) {
                let kind = GroupKind {
                    level: state.level(),
                    near: Some(state.clip),
                    is_fading: false,
                };
                let (near, others) = left.split_at(F32x16::LANES);
                let mut ids = [0; F32x16::LANES];
                for (id, &key) in ids.iter_mut().zip(near) {
                    *id = who(key) as u32;
                }
                self.push(kind, &ids, sorting);
                left = others;
            } else {
                self.rest[usize::from(state.is_fading)].push(who(key) as u32);
                left = &left[1..];
            }
        }
        for is_fading in [false, true] {
            let mut rest = std::mem::take(&mut self.rest[usize::from(is_fading)]);
            let sixteens = rest.chunks_exact(F32x16::LANES);
            let left = rest.len() - sixteens.remainder().len();
            for ids in sixteens {
                self.push_mixed(ids, is_fading, sorting);
            }
            rest.drain(..left);
            self.rest[usize::from(is_fading)] = rest;
        }
    }

    /// The last group of those who are left.
    fn push_rest(&mut self, is_fading: bool, sorting: &mut Sorting<'_>) {
        let mut rest = std::mem::take(&mut self.rest[usize::from(is_fading)]);
        if !rest.is_empty() {
            self.push_mixed(&rest, is_fading, sorting);
        }
        rest.clear();
        self.rest[usize::from(is_fading)] = rest;
    }

    /// Sixteen at most, the one of the finest level first.
    fn push_mixed(&mut self, members: &[u32], is_fading: bool, sorting: &mut Sorting<'_>) {
        let mut ids = [Group::NOBODY; F32x16::LANES];
        ids[..members.len()].copy_from_slice(members);
        let kind = GroupKind {
            level: sorting.states[members[0] as usize].level(),
            near: None,
            is_fading,
        };
        self.push(kind, &ids, sorting);
    }

    /// One more group, behind all others.
    fn push(&mut self, kind: GroupKind, ids: &[u32; F32x16::LANES], sorting: &mut Sorting<'_>) {
        let index = self.groups.len();
        let lines = sorting
            .output
            .group_len(sorting.animations.joints(kind.level));
        match self.buckets.last_mut() {
            Some(bucket) if bucket.kind == kind => bucket.groups.end = index + 1,
            _ => self.buckets.push(Bucket {
                kind,
                groups: index..index + 1,
                offset: self.lines,
                lines,
            }),
        }
        self.groups.push(Group::EMPTY);
        self.visible.push(u16::MAX);
        self.cold.push(GroupCold {
            kind,
            offset: self.lines,
            ..GroupCold::EMPTY
        });
        self.lines += lines;
        for (lane, &id) in ids.iter().enumerate() {
            // Lanes that nobody uses repeat the first.
            let shown = if id == Group::NOBODY { ids[0] } else { id };
            if let Some(state) = sorting.states.get(shown as usize) {
                self.write((index, lane), state, (sorting.animations, sorting.base));
            }
            if id != Group::NOBODY {
                self.cold[index].ids[lane] = id;
                sorting.slots[id as usize] = (index * F32x16::LANES + lane) as u32;
            }
        }
    }

    /// Writes a character into a lane. `base` is the time at which the groups' clock stands at 0.
    pub(super) fn write(
        &mut self,
        (group, lane): (usize, usize),
        state: &CharacterState,
        (animations, base): (&AnimationSet, f64),
    ) {
        let ranges = [state.clip, state.second].map(|clip| animations.range(clip));
        let first = (ranges[0], state.start(ranges[0], base));
        self.groups[group].write(lane, state, first);
        let fade_start = if state.is_fading {
            state.fade_start(ranges[1], base)
        } else {
            0.0
        };
        self.cold[group].write(lane, state, (ranges, fade_start));
    }

    /// Lets the groups' clock start at 0 again.
    pub(super) fn rebase(&mut self, sorting: &Sorting<'_>) {
        for group in 0..self.groups.len() {
            let ids = self.cold[group].ids;
            let Some(&any) = ids.iter().find(|&&id| id != Group::NOBODY) else {
                continue;
            };
            let detail = self.groups[group].detail;
            for (lane, id) in ids.into_iter().enumerate() {
                let shown = if id == Group::NOBODY { any } else { id };
                let state = &sorting.states[shown as usize];
                self.write((group, lane), state, (sorting.animations, sorting.base));
            }
            self.groups[group].detail = detail;
        }
    }

    /// Takes the levels that frames have chosen from the groups to the characters.
    pub(super) fn store_details(&self, states: &mut [CharacterState]) {
        for ((group, cold), visible) in self.groups.iter().zip(&self.cold).zip(&self.visible) {
            for (lane, &id) in cold.ids.iter().enumerate() {
                if let Some(state) = states.get_mut(id as usize)
                    && !state.is_late
                {
                    state.detail = group.detail.0[lane];
                    state.is_culled = visible >> lane & 1 == 0;
                }
            }
        }
    }

    /// Puts those who cannot stay where they are, or have just come, into groups of their own at the
    /// end.
    pub(super) fn move_late(&mut self, late: &[u32], mut sorting: Sorting<'_>) {
        for &id in late {
            self.vacate(id, &mut sorting);
            let state = &sorting.states[id as usize];
            if state.is_inactive {
                continue;
            }
            if state.is_culled {
                self.park(id, sorting.states, sorting.slots);
                continue;
            }
            let own = GroupKind {
                level: state.level(),
                near: None,
                is_fading: state.is_fading,
            };
            // The last few: more are seldom open.
            let open = (self.first_late..self.groups.len()).rev().take(4);
            let vacancy = { open }.find_map(|group| {
                let cold = &self.cold[group];
                let lane = (0..F32x16::LANES).find(|&lane| !cold.is_used(lane))?;
                cold.kind.takes(state).then_some((group, lane))
            });
            match vacancy {
                Some((group, lane)) => {
                    self.cold[group].ids[lane] = id;
                    sorting.slots[id as usize] = (group * F32x16::LANES + lane) as u32;
                    self.write((group, lane), state, (sorting.animations, sorting.base));
                    self.visible[group] |= 1 << lane;
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
        if slot & PARKED != 0 {
            let (parked, lane) = split(slot & !PARKED);
            self.parked[parked].ids[lane] = Group::NOBODY;
            return;
        }
        let (group, lane) = split(slot);
        self.cold[group].ids[lane] = Group::NOBODY;
        let stays = |&id: &u32| id != Group::NOBODY;
        if let Some(other) = self.cold[group].ids.iter().position(stays) {
            self.groups[group].copy_lane(other, lane);
            self.cold[group].copy_lane(other, lane);
        } else {
            self.visible[group] = 0;
        }
    }

    /// Cuts the groups into chunks of equal lengths in the output.
    fn share_out(&mut self, chunks: usize) {
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
                    let line = |group: usize| bucket.offset + group * bucket.lines;
                    self.pieces.push(Piece {
                        kind: bucket.kind,
                        groups: bucket.groups.start + from..bucket.groups.start + to,
                        lines: line(from)..line(to),
                    });
                }
            }
            self.ends.push(self.pieces.len());
        }
    }

    /// All chunks.
    pub(super) fn parts(&self) -> impl Iterator<Item = &[Piece]> {
        (0..self.ends.len()).map(|chunk| self.part(chunk))
    }

    /// Number of chunks.
    pub(super) fn chunks(&self) -> usize {
        self.ends.len()
    }

    /// One chunk, in the order of the output.
    pub(super) fn part(&self, chunk: usize) -> &[Piece] {
        let start = chunk.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.pieces[start..self.ends[chunk]]
    }
}

impl Parked {
    pub(super) fn move_to(&mut self, lane: usize, state: &CharacterState) {
        self.x.0[lane] = state.x;
        self.y.0[lane] = state.y;
        self.z.0[lane] = state.z;
    }
}

impl Sorting<'_> {
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

impl GroupKind {
    /// Whether a character can be posed so.
    pub(super) fn takes(self, state: &CharacterState) -> bool {
        self.level <= state.level()
            && self.near.is_none_or(|clip| clip == state.clip)
            && (self.is_fading || !state.is_fading)
    }
}

fn who(key: u64) -> usize {
    (key & MOST as u64) as usize
}

/// A slot as group and lane.
pub(super) fn split(slot: u32) -> (usize, usize) {
    let slot = slot as usize;
    (slot / F32x16::LANES, slot % F32x16::LANES)
}
