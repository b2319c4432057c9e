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

/// Groups of one bucket that one thread poses.
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
    buckets: Vec<Bucket>,
    pieces: Vec<Piece>,
    /// Where the pieces of each thread end.
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

/// Of a character who is in no group.
pub(super) const NOWHERE: u32 = u32::MAX;

/// What the order follows from.
pub(super) struct Sorting<'a> {
    pub(super) animations: &'a AnimationSet,
    pub(super) states: &'a [CharacterState],
    /// Of each character its group and lane, as one number.
    pub(super) slots: &'a mut [u32],
    pub(super) now: f32,
    pub(super) output: Output,
    pub(super) threads: usize,
}

impl Schedule {
    /// Puts everybody where they belong. Allocates only where a crowd has grown.
    pub(super) fn sort(&mut self, mut sorting: Sorting<'_>) {
        self.order(&sorting);
        self.fill(&mut sorting);
        self.share_out(sorting.threads);
    }

    fn order(&mut self, sorting: &Sorting<'_>) {
        let Sorting {
            animations, now, ..
        } = *sorting;
        let clips = animations.clips();
        self.keys.clear();
        let present = sorting.states.iter().enumerate();
        let present = present.filter(|(_, state)| !state.is_inactive);
        self.keys.extend(present.map(|(id, state)| {
            let at = state.at(now) / animations.range(state.clip).intervals as f32;
            // What is no number becomes 0, as where it is played.
            let time = ((at - at.floor()) * (1 << TIME_BITS) as f32) as u64;
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
        self.buckets.clear();
        self.lines = 0;
        self.reserve(sorting.states.len(), sorting.threads);
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
    }

    /// For any order of so many characters, and for those who come late.
    fn reserve(&mut self, characters: usize, threads: usize) {
        let full = characters / F32x16::LANES + 2;
        let groups = full + characters / MOST_LATE + 2;
        self.groups.reserve(groups);
        self.cold.reserve(groups);
        self.buckets.reserve(groups);
        self.pieces
            .reserve((groups + threads).saturating_sub(self.pieces.len()));
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
                self.write((index, lane), state, sorting.animations);
            }
            if id != Group::NOBODY {
                self.cold[index].ids[lane] = id;
                sorting.slots[id as usize] = (index * F32x16::LANES + lane) as u32;
            }
        }
    }

    /// All that a lane shows of a character.
    pub(super) fn write(
        &mut self,
        (group, lane): (usize, usize),
        state: &CharacterState,
        animations: &AnimationSet,
    ) {
        let ranges = [state.clip, state.second].map(|clip| {
            let range = animations.range(clip);
            (range.row, range.intervals)
        });
        self.groups[group].write(lane, state);
        self.cold[group].write(lane, state, ranges);
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
                    self.write((group, lane), state, sorting.animations);
                }
                None => {
                    let mut ids = [Group::NOBODY; F32x16::LANES];
                    ids[0] = id;
                    self.push(own, &ids, &mut sorting);
                }
            }
        }
        self.share_out(sorting.threads);
    }

    fn vacate(&mut self, id: u32, sorting: &mut Sorting<'_>) {
        let slot = std::mem::replace(&mut sorting.slots[id as usize], NOWHERE);
        if slot == NOWHERE {
            return;
        }
        let (group, lane) = split(slot);
        self.cold[group].ids[lane] = Group::NOBODY;
        let stays = |&&id: &&u32| id != Group::NOBODY;
        if let Some(&other) = self.cold[group].ids.iter().find(stays) {
            let state = &sorting.states[other as usize];
            self.write((group, lane), state, sorting.animations);
        }
    }

    /// Fixed parts for the threads, of equal lengths in the output.
    fn share_out(&mut self, threads: usize) {
        self.pieces.clear();
        self.ends.clear();
        for thread in 0..threads {
            let start = self.lines * thread / threads;
            let end = self.lines * (thread + 1) / threads;
            for bucket in &self.buckets {
                // A group goes to the thread in whose part it starts.
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

    /// What each thread poses.
    pub(super) fn parts(&self) -> impl Iterator<Item = &[Piece]> {
        (0..self.ends.len()).map(|thread| self.part(thread))
    }

    /// What one thread poses, in the order of the output.
    pub(super) fn part(&self, thread: usize) -> &[Piece] {
        let start = thread.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.pieces[start..self.ends[thread]]
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
