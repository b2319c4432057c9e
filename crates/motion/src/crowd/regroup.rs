//! Changes of groups between two sortings: moves characters to other groups, parks those that leave the frustum, and stores
//! the levels that a frame has chosen.

use super::bucket::{GroupKind, Parked};
use super::character::CharacterState;
use super::group::Group;
use super::schedule::{Schedule, Sorting};
use super::slot::{NOWHERE, PARKED, Slot};
use crate::math::F32x16;

impl Schedule {
    /// Parks a character that is in no group: it is not posed.
    pub(super) fn park(&mut self, id: u32, states: &[CharacterState], slots: &mut [u32]) {
        let free = |parked: &Parked| parked.ids.iter().position(|&id| id == Group::NOBODY);
        let lane = match self.parked.last().and_then(free) {
            Some(lane) => lane,
            None => {
                self.parked.push(Parked {
                    x: F32x16::ZERO,
                    y: F32x16::ZERO,
                    z: F32x16::ZERO,
                    ids: [Group::NOBODY; F32x16::LANES],
                });
                0
            }
        };
        let index = self.parked.len() - 1;
        let state = &states[id as usize];
        let parked = &mut self.parked[index];
        parked.ids[lane] = id;
        parked.move_to(lane, state);
        slots[id as usize] = PARKED | (index * F32x16::LANES + lane) as u32;
    }

    /// Puts characters that do not fit their groups, or that were added, into groups of their own at the end.
    pub(super) fn move_late(&mut self, late: &[u32], mut sorting: Sorting<'_>) {
        for &id in late {
            self.vacate(id, &mut sorting);
            let state = &sorting.states[id as usize];
            if state.is_inactive {
                continue;
            }
            if state.is_culled {
                self.park(id, sorting.states, sorting.slots);
                continue;
            }
            let own = GroupKind {
                level: state.level(),
                near: None,
                mix: state.mix,
            };
            // Only the last few groups are searched; others seldom have a free lane.
            let mut open = (self.first_late..self.groups.len()).rev().take(4);
            let vacancy = open.find_map(|group| {
                let cold = &self.cold[group];
                let lane = (0..F32x16::LANES).find(|&lane| !cold.is_used(lane))?;
                cold.kind.takes(state).then_some(Slot { group, lane })
            });
            match vacancy {
                Some(slot) => {
                    self.write(slot, state, sorting.clock());
                    self.visible[slot.group] |= 1 << slot.lane;
                    self.enter(slot, id, &mut sorting);
                }
                None => {
                    let mut ids = [Group::NOBODY; F32x16::LANES];
                    ids[0] = id;
                    self.push(own, &ids, &mut sorting);
                }
            }
        }
        self.share_out(sorting.chunks);
    }

    fn vacate(&mut self, id: u32, sorting: &mut Sorting<'_>) {
        let slot = std::mem::replace(&mut sorting.slots[id as usize], NOWHERE);
        if slot == NOWHERE {
            return;
        }
        if slot & PARKED != 0 {
            let Slot { group, lane } = Slot::of(slot);
            self.parked[group].ids[lane] = Group::NOBODY;
            return;
        }
        let slot = Slot::of(slot);
        self.leave(slot);
        let Slot { group, lane } = slot;
        let stays = |&id: &u32| id != Group::NOBODY;
        if let Some(other) = self.cold[group].ids.iter().position(stays) {
            self.groups[group].copy_lane(other, lane);
            self.cold[group].copy_lane(other, lane);
        } else {
            self.visible[group] = 0;
        }
    }

    /// Whether the character in a lane was visible in the last frame.
    pub(super) fn is_visible(&self, slot: Slot) -> bool {
        self.visible[slot.group] >> slot.lane & 1 == 1
    }

    /// Makes the lanes of all groups with characters visible.
    pub(super) fn show_all(&mut self) {
        for (visible, cold) in self.visible.iter_mut().zip(&self.cold) {
            let is_empty = *visible == 0 && cold.ids == [Group::NOBODY; F32x16::LANES];
            if !is_empty {
                *visible = u16::MAX;
            }
        }
    }

    /// Resets the groups' clock to 0.
    pub(super) fn rebase(&mut self, sorting: &Sorting<'_>) {
        for group in 0..self.groups.len() {
            let ids = self.cold[group].ids;
            let Some(&any) = ids.iter().find(|&&id| id != Group::NOBODY) else {
                continue;
            };
            let detail = self.groups[group].detail;
            for (lane, id) in ids.into_iter().enumerate() {
                let shown = if id == Group::NOBODY { any } else { id };
                let state = &sorting.states[shown as usize];
                self.write(Slot { group, lane }, state, sorting.clock());
            }
            self.groups[group].detail = detail;
        }
    }

    /// Copies the levels that frames have chosen from the groups to the characters.
    pub(super) fn store_details(&self, states: &mut [CharacterState]) {
        for ((group, cold), visible) in self.groups.iter().zip(&self.cold).zip(&self.visible) {
            for (lane, &id) in cold.ids.iter().enumerate() {
                if let Some(state) = states.get_mut(id as usize)
                    && !state.is_late
                {
                    state.detail = group.detail.0[lane];
                    state.is_culled = visible >> lane & 1 == 0;
                }
            }
        }
    }
}

impl Parked {
    pub(super) fn move_to(&mut self, lane: usize, state: &CharacterState) {
        self.x.0[lane] = state.x;
        self.y.0[lane] = state.y;
        self.z.0[lane] = state.z;
    }
}
