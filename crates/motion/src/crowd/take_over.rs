//! When new groups are made, and how they take over from the present ones.

use super::character::MemberId;
use super::debt::Debt;
use super::frame_input::Frame;
use super::instances::{Crowd, LONGEST_RUN};
use super::output::Layout;
use super::slot::{MOST_LATE, NOWHERE, PARKED, Slot};
use crate::lod::{LevelId, Switching};

impl Crowd {
    /// Share of the longest run of the groups' clock after which new groups are made: theirs starts at 0 again.
    const RUN_SHARE: f64 = 0.75;

    /// Makes a part of new groups, if they are due; returns whether they have taken over. `frame` is what chooses levels next.
    /// New groups that take more than `most` lines are forgotten.
    pub(super) fn step_rebuild(&mut self, frame: Option<&Frame<'_>>, most: usize) -> bool {
        if !(self.rebuild.is_running() || self.is_rebuild_due()) {
            return false;
        }
        if !self.rebuild.is_running() {
            self.rebuild.begin(self.time);
        }
        let mut rebuild = std::mem::take(&mut self.rebuild);
        let mut is_done = false;
        for _ in 0..self.rebuild_steps() {
            if !is_done {
                for id in rebuild.next_ids(self.states.len()) {
                    self.store_lane(id);
                }
                is_done = rebuild.step(&self.sorting().1);
            }
        }
        self.rebuild = rebuild;
        is_done &= self.new_len() <= most;
        if is_done {
            let switching = frame.and_then(|frame| frame.switching);
            self.take_over(!switching.is_some_and(Switching::blends));
        }
        is_done
    }

    /// The most that the new groups take once all characters are in one of them.
    fn new_len(&self) -> usize {
        let output = self.settings.output;
        let each = output.group_len(self.animations.joints(LevelId(0)));
        match output.layout {
            Layout::Instances => self.needed_len(),
            Layout::Blocks | Layout::Rows => {
                self.rebuild.schedule.lines + each * self.rebuild.misfits.len()
            }
        }
    }

    fn is_rebuild_due(&self) -> bool {
        let is_old = self.time - self.base > Self::RUN_SHARE * LONGEST_RUN;
        let is_due = self.debt.is_due(self.states.len()) || self.late_eighths() >= 5;
        !self.states.is_empty() && (is_old || is_due)
    }

    /// Eighths of the characters that may be moved to other groups before all are sorted at once.
    fn late_eighths(&self) -> usize {
        8 * MOST_LATE * self.debt.late / self.states.len().max(1)
    }

    /// More where characters would else be sorted at once before the new groups are made.
    fn rebuild_steps(&self) -> usize {
        match self.late_eighths() {
            0..=5 => 1,
            6 => 2,
            _ => 4,
        }
    }

    /// Takes a character's level, and whether it is visible, from its lane, which is newer.
    fn store_lane(&mut self, id: usize) {
        let mut state = self.states[id];
        self.store_detail(MemberId(id as u32), &mut state);
        self.states[id] = state;
    }

    /// Poses the new groups from now on. `copies_lanes`: what frames have chosen is not chosen again at once.
    fn take_over(&mut self, copies_lanes: bool) {
        for index in 0..self.rebuild.misfits.len() {
            self.store_lane(self.rebuild.misfits[index] as usize);
        }
        if copies_lanes {
            self.copy_lanes();
        }
        std::mem::swap(&mut self.schedule, &mut self.rebuild.schedule);
        std::mem::swap(&mut self.slots, &mut self.rebuild.slots);
        self.base = self.rebuild.base;
        for &id in &self.rebuild.misfits {
            let state = &mut self.states[id as usize];
            if !state.is_late {
                state.is_late = true;
                self.late.push(id);
            }
        }
        self.debt = Debt::default();
        self.is_settled = false;
        self.scratch_of_frames.sorted_levels = None;
    }

    /// Copies levels and visibility to the new groups.
    fn copy_lanes(&mut self) {
        for id in 0..self.states.len() {
            self.store_lane(id);
            let (state, slot) = (&self.states[id], self.rebuild.slots[id]);
            if slot == NOWHERE || state.is_late {
                continue;
            }
            if slot & PARKED != 0 {
                if !state.is_culled {
                    self.rebuild.add_misfit(id);
                }
                continue;
            }
            let Slot { group, lane } = Slot::of(slot);
            let schedule = &mut self.rebuild.schedule;
            schedule.groups[group].detail.0[lane] = state.detail;
            if state.is_culled {
                schedule.visible[group] &= !(1 << lane);
            }
            if !schedule.cold[group].kind.takes(state) {
                self.rebuild.add_misfit(id);
            }
        }
    }
}
