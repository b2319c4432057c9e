//! Changes of a character, in its lane of the present groups and of those that are being made.

use super::character::{CharacterState, MemberId};
use super::instances::Crowd;
use super::schedule::GroupClock;
use super::slot::{NOWHERE, PARKED, Slot};

impl Crowd {
    /// Changes a character that exists, and its lane or its group.
    pub(super) fn change(&mut self, id: MemberId, change: impl FnOnce(&mut CharacterState)) {
        let mut state = self.states[id.index()];
        self.store_detail(id, &mut state);
        let before = state.level();
        change(&mut state);
        let clock = GroupClock {
            animations: &self.animations,
            base: self.base,
        };
        self.rebuild.change(id.index(), &state, clock);
        let slot = self.slots[id.index()];
        // An inactive character without a group needs none.
        let is_out = slot == NOWHERE && state.is_inactive;
        if state.is_late || is_out {
            self.states[id.index()] = state;
            return;
        }
        if slot != NOWHERE && slot & PARKED != 0 && !state.is_inactive {
            let Slot { group, lane } = Slot::of(slot);
            self.schedule.parked[group].move_to(lane, &state);
            state.is_culled = true;
        } else if slot != NOWHERE && slot & PARKED == 0 && self.fits(slot, &state) {
            let [before, after] =
                [before, state.level()].map(|level| self.animations.joints(level));
            self.stale_cost.joints += before as isize - after as isize;
            self.schedule.write(Slot::of(slot), &state, clock);
        } else {
            state.is_late = true;
            self.late.push(id.0);
        }
        self.states[id.index()] = state;
    }

    fn fits(&self, slot: u32, state: &CharacterState) -> bool {
        !state.is_inactive && self.schedule.cold[Slot::of(slot).group].kind.takes(state)
    }

    /// Reads the level that a frame has chosen, and whether the character was visible, from the character's lane.
    pub(super) fn store_detail(&self, id: MemberId, state: &mut CharacterState) {
        let slot = self.slots[id.index()];
        if slot & PARKED == 0 && !state.is_late {
            let slot = Slot::of(slot);
            state.detail = self.schedule.groups[slot.group].detail.0[slot.lane];
            state.is_culled = !self.schedule.is_visible(slot);
        }
    }
}
