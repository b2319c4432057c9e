//! The groups whose moments are found together, and the order in which they are posed.

use std::ops::Range;

use super::moment::Reach;
use super::moments::Moments;
use super::scratch::AHEAD;

/// Groups whose moments are found together.
#[derive(Clone, Copy)]
pub(super) struct Batch {
    /// Turn of the first of them.
    pub(super) begun: usize,
    /// At most [`AHEAD`].
    pub(super) count: usize,
}

impl Batch {
    /// The turn after the last one of a full batch.
    #[inline(always)]
    pub(super) fn after(self) -> usize {
        self.begun + AHEAD
    }

    /// Where their moments are: two batches take turns.
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

/// The groups that are posed, and those that are posed after them.
#[derive(Clone, Copy)]
pub(super) struct Batches {
    pub(super) now: Batch,
    pub(super) next: Batch,
    /// Whether the keys of the first group of `now` that is read one by one have been asked for.
    pub(super) is_fetched: bool,
}

impl Batches {
    /// Goes on to the groups after these.
    #[inline(always)]
    pub(super) fn advance(&mut self, is_fetched: bool) {
        self.now = self.next;
        self.is_fetched = is_fetched;
    }

    /// The visible groups of each reach.
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

/// Some of the groups that are posed, and the first of those after them.
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

    /// Number of those that are posed now.
    #[inline(always)]
    pub(super) fn now(&self) -> usize {
        usize::from(self.now)
    }

    /// Where the moments are of those that are posed now, and of the one after them.
    #[inline(always)]
    pub(super) fn places(&self) -> &[u8] {
        &self.places[..usize::from(self.all)]
    }

    /// Where the moments are of the group at a turn; of the last one for the turn after it.
    #[inline(always)]
    pub(super) fn place(&self, turn: usize) -> usize {
        usize::from(self.places[turn.min(usize::from(self.all) - 1)])
    }

    /// Whether there is one after those that are posed now.
    #[inline(always)]
    pub(super) fn goes_on(&self) -> bool {
        self.all > self.now
    }
}
