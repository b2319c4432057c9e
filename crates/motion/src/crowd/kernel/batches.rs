//! The groups whose moments are found together, the order in which they are posed, and the memory for both.

use std::ops::Range;

use super::joint_math::{NUMBERS, SPARE};
use super::moments::{Moments, Reach, Run};
use crate::crowd::keys::animation_set::AnimationSet;
use crate::crowd::keys::level_clips::LevelClips;
use crate::crowd::output::row_lines;
use crate::math::{Apart, F32x16, Lanes};

/// Number of groups whose moments are found together. Finding a moment is a long chain of dependent operations; the chains
/// of several groups overlap.
pub(crate) const AHEAD: usize = 8;

/// Memory that a thread keeps from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    /// Moments of two batches of groups, which alternate.
    pub(crate) moments: Vec<Moments>,
    /// Joints of a group, if they cannot be computed in the output.
    pub(crate) models: Vec<F32x16>,
    /// Columns of a group's first clips, and of its second clips.
    pub(crate) columns: [Vec<F32x16>; 2],
    /// Receives the rows of unused lanes.
    pub(crate) spare: Vec<F32x16>,
}

impl Scratch {
    /// Allocates enough for any level, so that threads do not allocate later.
    pub(crate) fn new(animations: &AnimationSet) -> Self {
        let mut scratch = Self {
            moments: vec![Moments::BLANK; 2 * AHEAD],
            ..Self::default()
        };
        for bank in &animations.banks {
            scratch.fit(bank);
        }
        scratch
    }

    fn fit(&mut self, bank: &LevelClips) {
        let grow = |lines: &mut Vec<F32x16>, length: usize| {
            if lines.len() < length {
                lines.resize(length, F32x16::ZERO);
            }
        };
        grow(&mut self.models, (bank.joints.len() + SPARE) * NUMBERS);
        grow(&mut self.spare, row_lines(bank.joints.len()));
        for lines in &mut self.columns {
            grow(lines, bank.column_lines);
        }
    }
}

/// Consecutive groups whose moments are found together.
#[derive(Clone, Copy)]
pub(crate) struct Batch {
    /// Turn of the first group of the batch.
    pub(crate) begun: usize,
    /// Number of groups, at most [`AHEAD`].
    pub(crate) count: usize,
}

impl Batch {
    /// The turn after the last one of a full batch.
    #[inline(always)]
    pub(crate) fn after(self) -> usize {
        self.begun + AHEAD
    }

    /// Indices of the batch's moments in [`Scratch::moments`]. Two batches alternate
    /// there.
    #[inline(always)]
    pub(crate) fn places(self) -> Range<usize> {
        let first = self.begun % (2 * AHEAD);
        first..first + self.count
    }

    /// Number of groups that are no longer near each other in time.
    #[inline(always)]
    pub(crate) fn apart(self, moments: &[Moments]) -> usize {
        let mut apart = 0;
        for moments in &moments[self.places()] {
            apart += usize::from(moments.is_apart);
        }
        apart
    }
}

/// The groups that are posed now, and those that are posed next.
#[derive(Clone, Copy)]
pub(crate) struct Batches {
    pub(crate) now: Batch,
    pub(crate) next: Batch,
    /// Whether the keys of the first group of `now` that is read row by row have been prefetched.
    pub(crate) is_fetched: bool,
}

impl Batches {
    /// Makes the next batch the present one.
    #[inline(always)]
    pub(crate) fn advance(&mut self, is_fetched: bool) {
        self.now = self.next;
        self.is_fetched = is_fetched;
    }

    /// The visible groups, by the reach of their lanes.
    #[inline(always)]
    pub(crate) fn by_reach(&self, moments: &[Moments]) -> [Picked; Reach::COUNT] {
        let mut picked = [Picked::NONE; Reach::COUNT];
        for place in self.now.places() {
            let own = &moments[place];
            if own.is_visible {
                picked[own.reach as usize].add_now(place);
            }
        }
        for place in self.next.places() {
            let own = &moments[place];
            if own.is_visible {
                picked[own.reach as usize].add_next(place);
            }
        }
        picked
    }

    /// All visible groups.
    #[inline(always)]
    pub(crate) fn visible(&self, moments: &[Moments]) -> Picked {
        let mut picked = Picked::NONE;
        for place in self.now.places() {
            if moments[place].is_visible {
                picked.add_now(place);
            }
        }
        for place in self.next.places() {
            if moments[place].is_visible {
                picked.add_next(place);
            }
        }
        picked
    }
}

/// Some of the groups that are posed now, and the first such group of the next batch.
#[derive(Clone, Copy)]
pub(crate) struct Picked {
    places: [u8; AHEAD + 1],
    now: u8,
    all: u8,
}

impl Picked {
    const NONE: Self = Self {
        places: [0; AHEAD + 1],
        now: 0,
        all: 0,
    };

    #[inline(always)]
    fn add_now(&mut self, place: usize) {
        self.places[usize::from(self.now)] = place as u8;
        self.now += 1;
        self.all = self.now;
    }

    #[inline(always)]
    fn add_next(&mut self, place: usize) {
        if self.all == self.now {
            self.places[usize::from(self.now)] = place as u8;
            self.all += 1;
        }
    }

    /// Number of groups that are posed now.
    #[inline(always)]
    pub(crate) fn now(&self) -> usize {
        usize::from(self.now)
    }

    /// Indices of the moments of the groups that are posed now, and of the one after them.
    #[inline(always)]
    pub(crate) fn places(&self) -> &[u8] {
        &self.places[..usize::from(self.all)]
    }

    /// Index of the moments of the group at a turn. The turn after the last group gives the last group.
    #[inline(always)]
    pub(crate) fn place(&self, turn: usize) -> usize {
        usize::from(self.places[turn.min(usize::from(self.all) - 1)])
    }

    /// Whether the next batch has a group of this selection.
    #[inline(always)]
    pub(crate) fn goes_on(&self) -> bool {
        self.all > self.now
    }
}

impl Run<'_> {
    /// The first batch of groups, with an empty one after it.
    #[inline(always)]
    pub(crate) fn first_batches<L: Lanes>(&self, scratch: &mut Scratch) -> Batches {
        let now = self.find_batch::<L>(0, scratch);
        Batches {
            now,
            next: Batch { count: 0, ..now },
            is_fetched: false,
        }
    }

    /// Finds the moments of the batch that begins with the group `begun`.
    #[inline(always)]
    pub(crate) fn find_batch<L: Lanes>(&self, begun: usize, scratch: &mut Scratch) -> Batch {
        let count = AHEAD.min(self.groups.len().saturating_sub(begun));
        let batch = Batch { begun, count };
        L::apart(FindMoments {
            run: self,
            begun,
            moments: &mut scratch.moments[batch.places()],
        });
        batch
    }
}

/// Finds the moments of the groups from `begun` on.
struct FindMoments<'a> {
    run: &'a Run<'a>,
    begun: usize,
    moments: &'a mut [Moments],
}

impl<L: Lanes> Apart<L> for FindMoments<'_> {
    #[inline(always)]
    fn run(self) {
        for (group, moments) in (self.begun..).zip(self.moments) {
            self.run.find_moments::<L>(group, moments);
        }
    }
}
