//! Who stands beside whom: characters of one clip and level, in the order of their moments.

use std::ops::Range;

use super::character::{ClipId, LevelId};
use super::group::Group;
use super::output::Output;
use super::repertoire::Repertoire;
use crate::math::Line;

/// What a character plays: what its group has in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Kind {
    pub(super) clip: ClipId,
    /// One that the repertoire has.
    pub(super) level: LevelId,
    /// The second clip, if there is one: it may differ within a group.
    pub(super) second: Option<ClipId>,
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
    /// Sorted: the kind, then where in the clip, then who.
    keys: Vec<u64>,
    pub(super) buckets: Vec<Bucket>,
    pieces: Vec<Piece>,
    /// Where the pieces of each thread end.
    ends: Vec<usize>,
    /// Of the whole output.
    pub(super) lines: usize,
    spare: Vec<Group>,
}

/// Bits of a key, from the lowest: who, where in the clip, which kind (20).
const ID_BITS: u32 = 28;
const TIME_BITS: u32 = 16;

/// A crowd may not have more characters.
pub(super) const MOST: usize = (1 << ID_BITS) - 1;

pub(super) struct Sorting<'a> {
    pub(super) repertoire: &'a Repertoire,
    pub(super) kinds: &'a [Kind],
    pub(super) groups: &'a mut Vec<Group>,
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
        std::mem::swap(&mut self.spare, sorting.groups);
        self.share_out(sorting.threads);
    }

    fn order(&mut self, sorting: &Sorting<'_>) {
        let Sorting {
            repertoire, kinds, ..
        } = *sorting;
        self.keys.clear();
        self.keys.extend(kinds.iter().enumerate().map(|(id, kind)| {
            let (group, lane) = split(sorting.slots[id]);
            let length = repertoire.span(kind.clip, kind.level).intervals as f32;
            let at = sorting.groups[group].clock.at(lane, sorting.now) / length;
            // What is no number becomes 0, as where it is played.
            let time = ((at - at.floor()) * (1 << TIME_BITS) as f32) as u64;
            let time = time.min((1 << TIME_BITS) - 1);
            kind.number(repertoire.clips()) << (TIME_BITS + ID_BITS) | time << ID_BITS | id as u64
        }));
        self.keys.sort_unstable();
    }

    /// Fills groups in the order of the keys, a new one for each kind.
    fn fill(&mut self, sorting: &mut Sorting<'_>) {
        let who = |key: u64| (key & MOST as u64) as usize;
        let kind_of = |key: u64| key >> (TIME_BITS + ID_BITS);
        self.spare.clear();
        self.buckets.clear();
        self.lines = 0;
        for same in self.keys.chunk_by(|&a, &b| kind_of(a) == kind_of(b)) {
            let kind = sorting.kinds[who(same[0])];
            let first = self.spare.len();
            for sixteen in same.chunks(Line::LANES) {
                let mut group = Group::EMPTY;
                for lane in 0..Line::LANES {
                    // Lanes that nobody uses repeat the last character: they stay near in time.
                    let id = who(sixteen[lane.min(sixteen.len() - 1)]);
                    let (from, other) = split(sorting.slots[id]);
                    group.take(lane, &sorting.groups[from], other);
                }
                group.ids[sixteen.len()..].fill(Group::NOBODY);
                self.spare.push(group);
            }
            let bucket = Bucket {
                kind,
                groups: first..self.spare.len(),
                first_line: self.lines,
                lines: sorting.output.lines(sorting.repertoire.joints(kind.level)),
            };
            self.lines += bucket.lines * bucket.groups.len();
            self.buckets.push(bucket);
        }
        for (group, members) in self.spare.iter().enumerate() {
            for (lane, &id) in members.ids.iter().enumerate() {
                if id != Group::NOBODY {
                    sorting.slots[id as usize] = (group * Line::LANES + lane) as u32;
                }
            }
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

impl Kind {
    /// Whether characters of the two can share a group.
    pub(super) fn stands_with(self, other: Self) -> bool {
        (self.clip, self.level, self.second.is_some())
            == (other.clip, other.level, other.second.is_some())
    }

    fn number(self, clips: usize) -> u64 {
        2 * (self.level.index() * clips + self.clip.index()) as u64
            + u64::from(self.second.is_some())
    }
}

/// A slot as group and lane.
pub(super) fn split(slot: u32) -> (usize, usize) {
    let slot = slot as usize;
    (slot / Line::LANES, slot % Line::LANES)
}
