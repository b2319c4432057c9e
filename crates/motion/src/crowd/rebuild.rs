//! New groups that are made a part in each frame, while the present ones are posed: sorting all characters at once would take
//! longer than posing them.
//!
//! The keys of all characters are noted, sorted digit by digit, and groups are filled in their order. Changes of characters are
//! written to the present groups and to the new ones. Who fits none of the new groups by then is moved to one when they take over.

use std::ops::Range;

use super::bucket::GroupKind;
use super::character::CharacterState;
use super::schedule::{GroupClock, Schedule, Sorting};
use super::slot::{NOWHERE, PARKED, Slot};
use super::sort::FillWork;

/// New groups.
#[derive(Clone, Debug, Default)]
pub(super) struct Rebuild {
    pub(super) schedule: Schedule,
    /// Group and lane of each character among the new groups.
    pub(super) slots: Vec<u32>,
    /// The time at which the clock of the new groups stands at 0, in seconds.
    pub(super) base: f64,
    /// Characters that need another one of the new groups.
    pub(super) misfits: Vec<u32>,
    /// Whether each character is one of `misfits`.
    is_misfit: Vec<bool>,
    /// `None` where no groups are made.
    stage: Option<Stage>,
}

/// What is done next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// The key of this character and of some after it.
    Keys(usize),
    /// Sorting by this digit.
    Digit(u32),
    /// Groups.
    Fill,
}

impl Rebuild {
    /// Frames in which the keys are noted.
    const KEY_FRAMES: usize = 10;
    /// Frames in which groups are filled.
    const FILL_FRAMES: usize = 24;

    /// Memory for so many characters.
    pub(super) fn reserve(&mut self, characters: usize, chunks: usize) {
        self.schedule.reserve(characters, chunks);
        for ids in [&mut self.slots, &mut self.misfits] {
            ids.reserve(characters.saturating_sub(ids.len()));
        }
        let more = characters.saturating_sub(self.is_misfit.len());
        self.is_misfit.reserve(more);
    }

    pub(super) fn is_running(&self) -> bool {
        self.stage.is_some()
    }

    /// Begins at a time of the crowd.
    pub(super) fn begin(&mut self, now: f64) {
        self.stage = Some(Stage::Keys(0));
        self.base = now;
        self.slots.clear();
        self.misfits.clear();
        self.is_misfit.clear();
    }

    /// Forgets the new groups.
    pub(super) fn abort(&mut self) {
        self.stage = None;
    }

    /// The characters whose keys the next step notes.
    pub(super) fn next_ids(&self, characters: usize) -> Range<usize> {
        match self.stage {
            Some(Stage::Keys(first)) => {
                let count = characters.div_ceil(Self::KEY_FRAMES).max(1);
                first.min(characters)..(first + count).min(characters)
            }
            _ => 0..0,
        }
    }

    /// Does a part of the work; returns whether all is done.
    pub(super) fn step(&mut self, sorting: &Sorting<'_>) -> bool {
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

    /// Finds those who are in no group.
    fn note_missing(&mut self, states: &[CharacterState]) {
        for (id, state) in states.iter().enumerate() {
            if self.slots[id] == NOWHERE && !state.is_inactive {
                self.add_misfit(id);
            }
        }
    }

    /// Notes that a character needs another one of the new groups: once, however often it changes.
    pub(super) fn add_misfit(&mut self, id: usize) {
        if !std::mem::replace(&mut self.is_misfit[id], true) {
            self.misfits.push(id as u32);
        }
    }

    /// Writes a character that has changed.
    pub(super) fn change(&mut self, id: usize, state: &CharacterState, clock: GroupClock<'_>) {
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
