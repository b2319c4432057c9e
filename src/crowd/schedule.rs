//! Who stands beside whom.
//!
//! Sixteen characters of one clip and level who are near each other in time share their loads. The
//! others fill groups in the order of their levels, whatever they play: a group is posed on the
//! finest level of its characters, and those who may be coarser are made to look so. So few lanes
//! stay empty, however many clips and levels there are.

use std::ops::Range;

use super::character::{Being, ClipId, LevelId};
use super::group::{Aside, Group};
use super::instances::MOST_LATE;
use super::output::Output;
use super::radix;
use super::repertoire::Repertoire;
use crate::math::Line;

/// How a group is posed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Kind {
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
    pub(super) kind: Kind,
    pub(super) groups: Range<usize>,
    pub(super) first_line: usize,
    /// Of each group.
    pub(super) lines: usize,
}

/// Groups of one bucket that one thread poses.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub(super) kind: Kind,
    pub(super) groups: Range<usize>,
    pub(super) lines: Range<usize>,
}

/// The order of a crowd.
#[derive(Clone, Debug, Default)]
pub(super) struct Schedule {
    pub(super) groups: Vec<Group>,
    pub(super) asides: Vec<Aside>,
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
    pub(super) repertoire: &'a Repertoire,
    pub(super) beings: &'a [Being],
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
            repertoire, now, ..
        } = *sorting;
        let clips = repertoire.clips();
        self.keys.clear();
        let present = sorting.beings.iter().enumerate();
        let present = present.filter(|(_, being)| !being.is_out);
        self.keys.extend(present.map(|(id, being)| {
            let at = being.at(now) / repertoire.span(being.clip).intervals as f32;
            // What is no number becomes 0, as where it is played.
            let time = ((at - at.floor()) * (1 << TIME_BITS) as f32) as u64;
            let time = time.min((1 << TIME_BITS) - 1);
            let kind = 2 * being.level().index() + usize::from(being.is_fading);
            let plays = (kind * clips + being.clip.index()) as u64;
            plays << (TIME_BITS + ID_BITS) | time << ID_BITS | id as u64
        }));
        let kinds = 2 * repertoire.levels() * clips;
        let bits = ID_BITS + TIME_BITS + kinds.next_power_of_two().ilog2();
        radix::sort(&mut self.keys, &mut self.spare, (ID_BITS, bits));
    }

    /// Fills groups in the order of the keys.
    fn fill(&mut self, sorting: &mut Sorting<'_>) {
        self.groups.clear();
        self.asides.clear();
        self.buckets.clear();
        self.lines = 0;
        self.reserve(sorting.beings.len(), sorting.threads);
        sorting.slots.fill(NOWHERE);
        let keys = std::mem::take(&mut self.keys);
        let level = |key: &u64| sorting.beings[who(*key)].level();
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
        let full = characters / Line::LANES + 2;
        let groups = full + characters / MOST_LATE + 2;
        self.groups.reserve(groups);
        self.asides.reserve(groups);
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
            let being = &sorting.beings[who(key)];
            if !being.is_fading && sorting.are_near(left) {
                let kind = Kind {
                    level: being.level(),
                    near: Some(being.clip),
                    is_fading: false,
                };
                let (near, others) = left.split_at(Line::LANES);
                let mut ids = [0; Line::LANES];
                for (id, &key) in ids.iter_mut().zip(near) {
                    *id = who(key) as u32;
                }
                self.push(kind, &ids, sorting);
                left = others;
            } else {
                self.rest[usize::from(being.is_fading)].push(who(key) as u32);
                left = &left[1..];
            }
        }
        for is_fading in [false, true] {
            let mut rest = std::mem::take(&mut self.rest[usize::from(is_fading)]);
            let sixteens = rest.chunks_exact(Line::LANES);
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
        let mut ids = [Group::NOBODY; Line::LANES];
        ids[..members.len()].copy_from_slice(members);
        let kind = Kind {
            level: sorting.beings[members[0] as usize].level(),
            near: None,
            is_fading,
        };
        self.push(kind, &ids, sorting);
    }

    /// One more group, behind all others.
    fn push(&mut self, kind: Kind, ids: &[u32; Line::LANES], sorting: &mut Sorting<'_>) {
        let index = self.groups.len();
        let lines = sorting.output.lines(sorting.repertoire.joints(kind.level));
        match self.buckets.last_mut() {
            Some(bucket) if bucket.kind == kind => bucket.groups.end = index + 1,
            _ => self.buckets.push(Bucket {
                kind,
                groups: index..index + 1,
                first_line: self.lines,
                lines,
            }),
        }
        self.groups.push(Group::EMPTY);
        self.asides.push(Aside {
            kind,
            first_line: self.lines,
            ..Aside::EMPTY
        });
        self.lines += lines;
        for (lane, &id) in ids.iter().enumerate() {
            // Lanes that nobody uses repeat the first.
            let shown = if id == Group::NOBODY { ids[0] } else { id };
            if let Some(being) = sorting.beings.get(shown as usize) {
                self.write((index, lane), being, sorting.repertoire);
            }
            if id != Group::NOBODY {
                self.asides[index].ids[lane] = id;
                sorting.slots[id as usize] = (index * Line::LANES + lane) as u32;
            }
        }
    }

    /// All that a lane shows of a character.
    pub(super) fn write(
        &mut self,
        (group, lane): (usize, usize),
        being: &Being,
        repertoire: &Repertoire,
    ) {
        let spans = [being.clip, being.second].map(|clip| {
            let span = repertoire.span(clip);
            (span.row, span.intervals)
        });
        self.groups[group].write(lane, being);
        self.asides[group].write(lane, being, spans);
    }

    /// Puts those who cannot stay where they are, or have just come, into groups of their own at the
    /// end.
    pub(super) fn move_late(&mut self, late: &[u32], mut sorting: Sorting<'_>) {
        for &id in late {
            self.vacate(id, &mut sorting);
            let being = &sorting.beings[id as usize];
            if being.is_out {
                continue;
            }
            let own = Kind {
                level: being.level(),
                near: None,
                is_fading: being.is_fading,
            };
            // The last few: more are seldom open.
            let open = (self.first_late..self.groups.len()).rev().take(4);
            let vacancy = { open }.find_map(|group| {
                let aside = &self.asides[group];
                let lane = (0..Line::LANES).find(|&lane| !aside.is_used(lane))?;
                aside.kind.takes(being).then_some((group, lane))
            });
            match vacancy {
                Some((group, lane)) => {
                    self.asides[group].ids[lane] = id;
                    sorting.slots[id as usize] = (group * Line::LANES + lane) as u32;
                    self.write((group, lane), being, sorting.repertoire);
                }
                None => {
                    let mut ids = [Group::NOBODY; Line::LANES];
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
        self.asides[group].ids[lane] = Group::NOBODY;
        let stays = |&&id: &&u32| id != Group::NOBODY;
        if let Some(&other) = self.asides[group].ids.iter().find(stays) {
            let being = &sorting.beings[other as usize];
            self.write((group, lane), being, sorting.repertoire);
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
                    let groups = line
                        .saturating_sub(bucket.first_line)
                        .div_ceil(bucket.lines);
                    groups.min(bucket.groups.len())
                };
                let (from, to) = (up_to(start), up_to(end));
                if from < to {
                    let line = |group: usize| bucket.first_line + group * bucket.lines;
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
        let Some(sixteen) = keys.get(..Line::LANES) else {
            return false;
        };
        let plays = |key: u64| key >> (TIME_BITS + ID_BITS);
        if plays(sixteen[0]) != plays(sixteen[Line::LANES - 1]) {
            return false;
        }
        let clip = self.beings[who(sixteen[0])].clip;
        let intervals = self.repertoire.span(clip).intervals as u64;
        let time = |key: u64| key >> ID_BITS & ((1 << TIME_BITS) - 1);
        let between = time(sixteen[Line::LANES - 1]) - time(sixteen[0]);
        between * intervals <= NEAR << TIME_BITS
    }
}

impl Kind {
    /// Whether a character can be posed so.
    pub(super) fn takes(self, being: &Being) -> bool {
        self.level <= being.level()
            && self.near.is_none_or(|clip| clip == being.clip)
            && (self.is_fading || !being.is_fading)
    }
}

fn who(key: u64) -> usize {
    (key & MOST as u64) as usize
}

/// A slot as group and lane.
pub(super) fn split(slot: u32) -> (usize, usize) {
    let slot = slot as usize;
    (slot / Line::LANES, slot % Line::LANES)
}
