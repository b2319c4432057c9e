//! The groups whose moments are found together, the order in which they are posed, and the memory for both.

use std::ops::Range;

use super::joint_math::{NUMBERS, SPARE};
use super::moments::{Moments, Run};
use crate::crowd::keys::animation_set::AnimationSet;
use crate::crowd::keys::level_clips::LevelClips;
use crate::crowd::output::row_lines;
use crate::math::{F32x16, Lanes};

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
        let most = |of: fn(&LevelClips) -> usize| animations.banks.iter().map(of).max();
        let lines = |of| vec![F32x16::ZERO; most(of).unwrap_or_default()];
        let columns = || lines(|bank| bank.column_lines);
        Self {
            moments: vec![Moments::default(); 2 * AHEAD],
            models: lines(|bank| (bank.joints.len() + SPARE) * NUMBERS),
            columns: [columns(), columns()],
            spare: lines(|bank| row_lines(bank.joints.len())),
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

    /// The groups of this batch, which is posed now, and of the `next` one, by class.
    #[inline(always)]
    pub(crate) fn pick<const CLASSES: usize>(
        self,
        next: Self,
        moments: &[Moments],
        class: impl Fn(&Moments) -> usize,
    ) -> [Picked; CLASSES] {
        let mut picked = [Picked::NONE; CLASSES];
        for (batch, is_now) in [(self, true), (next, false)] {
            for place in batch.places() {
                let own = &moments[place];
                picked[class(own)].add(place, is_now);
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
    fn add(&mut self, place: usize, is_now: bool) {
        if is_now || self.all == self.now {
            self.places[usize::from(self.all)] = place as u8;
            self.all += 1;
            self.now += u8::from(is_now);
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
    /// Finds the moments of the batch that begins with the group `begun`.
    #[inline(always)]
    pub(crate) fn find_batch<L: Lanes>(&self, begun: usize, scratch: &mut Scratch) -> Batch {
        let count = AHEAD.min(self.groups.len().saturating_sub(begun));
        let batch = Batch { begun, count };
        let places = &mut scratch.moments[batch.places()];
        L::apart(
            #[inline(always)]
            || {
                for (group, moments) in (begun..).zip(places) {
                    self.find_moments::<L>(group, moments);
                }
            },
        );
        batch
    }
}
