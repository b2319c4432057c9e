//! The groups of a crowd, and where they are in the output.

use super::character::MemberId;
use super::error::CrowdError;
use super::frame_input::FrameReport;
use super::instances::{CHUNKS_OF_A_THREAD, Crowd, MOST_CHUNKS};
use super::output::{Layout, PoseSlice, SlicePlace};
use super::schedule::{Schedule, Sorting};
use super::slot::{MOST_LATE, NOWHERE, Slot};
use super::stale_cost::StaleCost;
use crate::lod::LevelId;

impl Crowd {
    /// Length of the output of [`Crowd::pose`], in `F32x16`s. Moves characters to other groups where that is due: a
    /// [`PoseSlice`] from before this call may be another character's.
    pub fn output_len(&mut self) -> usize {
        self.prepare();
        self.needed_len()
    }

    /// Length of the output for the present groups, in `F32x16`s.
    pub(super) fn needed_len(&self) -> usize {
        match self.settings.output.layout {
            Layout::Instances => self.row_len() * self.states.len(),
            Layout::Blocks | Layout::Rows => self.schedule.lines,
        }
    }

    /// A length in `F32x16`s that [`Crowd::output_len`] never exceeds for `characters` characters, however their levels
    /// change: the size to allocate. The length for [`Crowd::capacity`] characters stays the same as long as the crowd does
    /// not outgrow it.
    #[must_use]
    pub fn max_output_len(&self, characters: usize) -> usize {
        let output = self.settings.output;
        let group = output.group_len(self.animations.joints(LevelId(0)));
        match output.layout {
            Layout::Instances => self.row_len() * characters,
            Layout::Blocks | Layout::Rows => Schedule::most_groups(characters) * group,
        }
    }

    /// Number of characters that the crowd has memory for. It grows only where characters are added beyond it.
    #[must_use]
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    /// Length of a character's row in [`Layout::Instances`], in `F32x16`s.
    pub(super) fn row_len(&self) -> usize {
        let joints = self.animations.joints(LevelId(0));
        self.settings.output.row_len(joints)
    }

    /// Puts all characters into groups. Sorts them all at once if many are in none.
    pub(super) fn prepare(&mut self) -> FrameReport {
        let characters = self.states.len();
        let moved = self.late.len();
        let sorted = MOST_LATE * (moved + self.stale_cost.late) > characters;
        if sorted {
            self.rebuild.abort();
            self.schedule.store_details(&mut self.states);
            let (schedule, sorting) = self.sorting();
            schedule.sort(sorting);
            self.stale_cost = StaleCost::default();
            self.is_settled = false;
            let chunks = self.chunks();
            self.rebuild.reserve(characters, chunks);
            let spare = characters.saturating_sub(self.late.len());
            self.late.reserve(spare);
        } else if moved > 0 {
            let late = std::mem::take(&mut self.late);
            let (schedule, sorting) = self.sorting();
            schedule.move_late(&late, sorting);
            self.late = late;
            self.stale_cost.late += moved;
        }
        for &id in &self.late {
            self.states[id as usize].is_late = false;
        }
        self.late.clear();
        FrameReport { moved, sorted }
    }

    pub(super) fn sorting(&mut self) -> (&mut Schedule, Sorting<'_>) {
        let chunks = self.chunks();
        let sorting = Sorting {
            animations: &self.animations,
            states: &self.states,
            slots: &mut self.slots,
            now: self.time,
            base: self.base,
            output: self.settings.output,
            chunks,
        };
        (&mut self.schedule, sorting)
    }

    /// Number of chunks that the groups are cut into.
    fn chunks(&self) -> usize {
        match self.pool.threads() {
            1 => 1,
            threads => (threads * CHUNKS_OF_A_THREAD).min(MOST_CHUNKS),
        }
    }

    /// Where the pose of a character is, as [`Crowd::pose`] or [`Crowd::frame`] wrote it last. Ask for it after that call. It
    /// is valid until the next [`Crowd::output_len`], [`Crowd::pose`] or [`Crowd::frame`]: each of them may move characters,
    /// and after `output_len` alone the new places are not written yet.
    ///
    /// # Errors
    /// [`CrowdError::NotVisible`] for a character that the last frame found outside the frustum;
    /// [`CrowdError::NoSuchCharacter`] for one that does not exist, is [inactive](Crowd::deactivate) or was added since.
    pub fn pose_slice(&self, id: MemberId) -> Result<PoseSlice, CrowdError> {
        self.check(id)?;
        let slot = self.slots[id.index()];
        if slot == NOWHERE {
            return Err(self.no_such(id));
        }
        if !self.is_posed(id) {
            return Err(CrowdError::NotVisible { id: id.0 });
        }
        let Slot { group, lane } = Slot::of(slot);
        Ok(PoseSlice::new(
            self.settings.output,
            self.slice_place(group, lane),
        ))
    }

    fn slice_place(&self, group: usize, lane: usize) -> SlicePlace {
        let cold = &self.schedule.cold[group];
        let (offset, lane) = match self.settings.output.layout {
            Layout::Instances => (self.row_len() * cold.ids[lane] as usize, 0),
            Layout::Blocks | Layout::Rows => (cold.offset, lane),
        };
        SlicePlace {
            level: cold.kind.level,
            joints: self.animations.joints(cold.kind.level),
            offset,
            lane,
        }
    }

    /// Where the pose of a character is in the memory that the frame before the last one was given: another buffer than the
    /// last one's, which the caller has kept. `None` if it was not posed then, or without
    /// [`CrowdSettings::keeps_previous`](super::CrowdSettings::keeps_previous).
    #[must_use]
    pub fn previous_slice(&self, id: MemberId) -> Option<PoseSlice> {
        self.history.previous(self.settings.output, id.index())
    }

    /// Records where the poses of this frame are.
    pub(super) fn note_places(&mut self) {
        if self.settings.keeps_previous {
            let mut history = std::mem::take(&mut self.history);
            let place = |group: usize, lane: usize| self.slice_place(group, lane);
            history.note(self.states.len(), &self.schedule, place);
            self.history = history;
        }
    }
}
