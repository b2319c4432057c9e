//! Starts building new groups, and replaces the present groups by them.

use super::character::MemberId;
use super::frame_input::Frame;
use super::instances::{Crowd, LONGEST_RUN};
use super::output::Layout;
use super::sort::group::{MOST_LATE, NOWHERE, PARKED, Slot};
use super::sort::rebuild::StaleCost;
use crate::lod::{LevelId, Switching};

impl Crowd {
    /// Share of [`LONGEST_RUN`] after which new groups are built, to reset the groups' clock.
    const RUN_SHARE: f64 = 0.75;

    /// Builds a part of new groups if they are due; returns whether they have replaced the present ones. `frame` is the
    /// frame that chooses levels next. New groups that take more than `most` `F32x16`s are discarded.
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

    /// Maximum length of the new groups once each misfit is in a group, in `F32x16`s.
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
        let is_due = self.stale_cost.exceeds_sorting(self.states.len()) || self.late_eighths() >= 5;
        !self.states.is_empty() && (is_old || is_due)
    }

    /// Number of characters that were moved to other groups, in eighths of the number at which all are sorted at once.
    fn late_eighths(&self) -> usize {
        8 * MOST_LATE * self.stale_cost.late / self.states.len().max(1)
    }

    /// Number of steps in this frame. It grows as the number of moved characters approaches the number at which all are
    /// sorted at once.
    fn rebuild_steps(&self) -> usize {
        match self.late_eighths() {
            0..=5 => 1,
            6 => 2,
            _ => 4,
        }
    }

    /// Copies a character's level and visibility from its lane, which has newer values.
    fn store_lane(&mut self, id: usize) {
        let mut state = self.states[id];
        self.store_detail(MemberId(id as u32), &mut state);
        self.states[id] = state;
    }

    /// Replaces the present groups by the new ones. With `copies_lanes`, levels and visibility that frames have chosen are
    /// copied, because they are not chosen again at once.
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
        self.stale_cost = StaleCost::default();
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
