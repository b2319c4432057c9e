//! The groups whose moments are found together, and the order in which they are posed.

use std::ops::Range;

use super::moment::Reach;
use super::moments::Moments;
use super::scratch::AHEAD;

/// Consecutive groups whose moments are found together.
#[derive(Clone, Copy)]
pub(super) struct Batch {
    /// Turn of the first group of the batch.
    pub(super) begun: usize,
    /// Number of groups, at most [`AHEAD`].
    pub(super) count: usize,
}

impl Batch {
    /// The turn after the last one of a full batch.
    #[inline(always)]
    pub(super) fn after(self) -> usize {
        self.begun + AHEAD
    }

    /// Indices of the batch's moments in [`Scratch::moments`](super::scratch::Scratch::moments). Two batches alternate
    /// there.
    #[inline(always)]
    pub(super) fn places(self) -> Range<usize> {
        let first = self.begun % (2 * AHEAD);
        first..first + self.count
    }

    #[inline(always)]
    pub(super) fn of(self, moments: &[Moments]) -> &[Moments] {
        &moments[self.places()]
    }
}

/// The groups that are posed now, and those that are posed next.
#[derive(Clone, Copy)]
pub(super) struct Batches {
    pub(super) now: Batch,
    pub(super) next: Batch,
    /// Whether the keys of the first group of `now` that is read row by row have been prefetched.
    pub(super) is_fetched: bool,
}

impl Batches {
    /// Makes the next batch the present one.
    #[inline(always)]
    pub(super) fn advance(&mut self, is_fetched: bool) {
        self.now = self.next;
        self.is_fetched = is_fetched;
    }

    /// The visible groups, by the reach of their lanes.
    #[inline(always)]
    pub(super) fn by_reach(&self, moments: &[Moments]) -> [Picked; Reach::COUNT] {
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
    pub(super) fn visible(&self, moments: &[Moments]) -> Picked {
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
pub(super) struct Picked {
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
    pub(super) fn now(&self) -> usize {
        usize::from(self.now)
    }

    /// Indices of the moments of the groups that are posed now, and of the one after them.
    #[inline(always)]
    pub(super) fn places(&self) -> &[u8] {
        &self.places[..usize::from(self.all)]
    }

    /// Index of the moments of the group at a turn. The turn after the last group gives the last group.
    #[inline(always)]
    pub(super) fn place(&self, turn: usize) -> usize {
        usize::from(self.places[turn.min(usize::from(self.all) - 1)])
    }

    /// Whether the next batch has a group of this selection.
    #[inline(always)]
    pub(super) fn goes_on(&self) -> bool {
        self.all > self.now
    }
}
