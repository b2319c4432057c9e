//! Builds new groups a part in each frame, while the present ones are posed: sorting all characters at once would take
//! longer than posing them.
//!
//! The keys of all characters are recorded and sorted digit by digit, then groups are filled in their order. Changes of
//! characters are written to the present groups and to the new ones. A character that does not fit its new group is moved to
//! another one when the new groups take over.

use std::ops::Range;

use super::fill::FillWork;
use super::group::{GroupKind, NOWHERE, PARKED, Slot};
use super::schedule::{GroupClock, Schedule, Sorting};
use crate::crowd::character::CharacterState;

/// Groups that are being built.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rebuild {
    pub(crate) schedule: Schedule,
    /// Group and lane of each character among the new groups.
    pub(crate) slots: Vec<u32>,
    /// The crowd's time at which the clock of the new groups is 0, in seconds.
    pub(crate) base: f64,
    /// Characters that do not fit their new groups.
    pub(crate) misfits: Vec<u32>,
    /// Whether each character is one of `misfits`.
    is_misfit: Vec<bool>,
    /// The next step; `None` if no groups are being built.
    stage: Option<Stage>,
}

/// The next step of building.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Records the keys of characters, from this one on.
    Keys(usize),
    /// Sorts the keys by this digit.
    Digit(u32),
    /// Fills groups.
    Fill,
}

impl Rebuild {
    /// Number of frames in which keys are recorded.
    const KEY_FRAMES: usize = 10;
    /// Number of frames in which groups are filled.
    const FILL_FRAMES: usize = 24;

    /// Reserves memory for `characters` characters and `chunks` chunks.
    pub(crate) fn reserve(&mut self, characters: usize, chunks: usize) {
        self.schedule.reserve(characters, chunks);
        for ids in [&mut self.slots, &mut self.misfits] {
            ids.reserve(characters.saturating_sub(ids.len()));
        }
        let more = characters.saturating_sub(self.is_misfit.len());
        self.is_misfit.reserve(more);
    }

    pub(crate) fn is_running(&self) -> bool {
        self.stage.is_some()
    }

    /// Starts building groups whose clock is 0 at the crowd's time `now`, in seconds.
    pub(crate) fn begin(&mut self, now: f64) {
        self.stage = Some(Stage::Keys(0));
        self.base = now;
        self.slots.clear();
        self.misfits.clear();
        self.is_misfit.clear();
    }

    /// Discards the new groups.
    pub(crate) fn abort(&mut self) {
        self.stage = None;
    }

    /// Indices of the characters whose keys the next step records.
    pub(crate) fn next_ids(&self, characters: usize) -> Range<usize> {
        match self.stage {
            Some(Stage::Keys(first)) => {
                let count = characters.div_ceil(Self::KEY_FRAMES).max(1);
                first.min(characters)..(first + count).min(characters)
            }
            _ => 0..0,
        }
    }

    /// Does one step; returns whether the new groups are complete.
    pub(crate) fn step(&mut self, sorting: &Sorting<'_>) -> bool {
        let Some(stage) = self.stage else {
            return false;
        };
        let characters = sorting.states.len();
        let ids = self.next_ids(characters);
        let schedule = &mut self.schedule;
        self.slots.resize(characters, NOWHERE);
        self.is_misfit.resize(characters, false);
        let states = sorting.states;
        let mut sorting = Sorting {
            slots: &mut self.slots,
            base: self.base,
            ..*sorting
        };
        let next = match stage {
            Stage::Keys(first) => {
                if first == 0 {
                    schedule.begin(&mut sorting);
                }
                schedule.add_keys(ids.clone(), &sorting);
                match ids.end < characters {
                    true => Stage::Keys(ids.end),
                    false => Stage::Digit(0),
                }
            }
            Stage::Digit(digit) => {
                schedule.sort_digit(digit, &sorting);
                match digit + 1 < sorting.digits() {
                    true => Stage::Digit(digit + 1),
                    false => Stage::Fill,
                }
            }
            Stage::Fill => {
                let most = FillWork::part(characters, Self::FILL_FRAMES);
                if schedule.fill(most, &mut sorting) {
                    schedule.end(&mut sorting);
                    self.stage = None;
                    self.note_missing(states);
                    return true;
                }
                Stage::Fill
            }
        };
        self.stage = Some(next);
        false
    }

    /// Adds characters that are in no new group to `misfits`.
    fn note_missing(&mut self, states: &[CharacterState]) {
        for (id, state) in states.iter().enumerate() {
            if self.slots[id] == NOWHERE && !state.is_inactive {
                self.add_misfit(id);
            }
        }
    }

    /// Adds a character to `misfits`, at most once.
    pub(crate) fn add_misfit(&mut self, id: usize) {
        if !std::mem::replace(&mut self.is_misfit[id], true) {
            self.misfits.push(id as u32);
        }
    }

    /// Updates the new groups after a character has changed.
    pub(crate) fn change(&mut self, id: usize, state: &CharacterState, clock: GroupClock<'_>) {
        let slot = match (self.stage, self.slots.get(id)) {
            (Some(_), Some(&slot)) if slot != NOWHERE => slot,
            _ => return,
        };
        let at = Slot::of(slot);
        if state.is_inactive {
            self.add_misfit(id);
        } else if slot & PARKED != 0 {
            self.schedule.parked[at.group].move_to(at.lane, state);
        } else if self.kind(at).takes(state) {
            let base = self.base;
            self.schedule.write(at, state, GroupClock { base, ..clock });
        } else {
            self.add_misfit(id);
        }
    }

    fn kind(&self, slot: Slot) -> GroupKind {
        self.schedule.cold[slot.group].kind
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
    /// Number of joints that are posed for lanes outside the frustum.
    pub(crate) hidden: usize,
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
        self.total += Self::APART * apart + Self::LATE * self.late + joints + self.hidden;
    }

    /// Whether the extra cost has reached the cost of sorting.
    pub(crate) fn exceeds_sorting(&self, characters: usize) -> bool {
        self.total >= Self::CHARACTER * characters
    }
}
