//! The groups of a crowd, and where they are in the output.

use super::character::CharacterId;
use super::debt::Debt;
use super::frame_input::FrameReport;
use super::instances::{CHUNKS_OF_A_THREAD, Crowd, MOST_CHUNKS};
use super::output::PoseSlice;
use super::schedule::{Schedule, Sorting};
use super::settings::CrowdError;
use super::slot::{MOST_LATE, NOWHERE, PARKED, split};
use crate::lod::LevelId;

impl Crowd {
    /// Length of what [`Crowd::pose`] writes now. Moves characters to other groups where that is due.
    pub fn output_len(&mut self) -> usize {
        self.prepare();
        self.schedule.lines
    }

    /// A length that [`Crowd::output_len`] never exceeds for so many characters, however their levels change: the size to
    /// allocate.
    #[must_use]
    pub fn max_output_len(&self, characters: usize) -> usize {
        let group = self
            .settings
            .output
            .group_len(self.animations.joints(LevelId(0)));
        // Full groups, one more for each kind of rest, and those of moved characters: `fill` and `move_late`.
        (characters.div_ceil(16) + 2 + characters / MOST_LATE + 1) * group
    }

    /// Brings all characters into groups.
    pub(super) fn prepare(&mut self) -> FrameReport {
        let characters = self.states.len();
        let moved = self.late.len();
        let many = MOST_LATE * (moved + self.debt.late) > characters;
        let sorted = many || self.debt.is_due(characters);
        if sorted {
            self.schedule.store_details(&mut self.states);
            let (schedule, sorting) = self.sorting();
            schedule.sort(sorting);
            self.debt = Debt::default();
            self.is_settled = false;
            let spare = characters.saturating_sub(self.late.len());
            self.late.reserve(spare);
        } else if moved > 0 {
            let late = std::mem::take(&mut self.late);
            let (schedule, sorting) = self.sorting();
            schedule.move_late(&late, sorting);
            self.late = late;
            self.debt.late += moved;
            self.is_settled = false;
        }
        for &id in &self.late {
            self.states[id as usize].is_late = false;
        }
        self.late.clear();
        FrameReport { moved, sorted }
    }

    pub(super) fn sorting(&mut self) -> (&mut Schedule, Sorting<'_>) {
        let sorting = Sorting {
            animations: &self.animations,
            states: &self.states,
            slots: &mut self.slots,
            now: self.time,
            base: self.base,
            output: self.settings.output,
            chunks: match self.pool.threads() {
                1 => 1,
                threads => (threads * CHUNKS_OF_A_THREAD).min(MOST_CHUNKS),
            },
        };
        (&mut self.schedule, sorting)
    }

    /// Where the pose of a character is, as [`Crowd::pose`] wrote it last.
    ///
    /// # Errors
    /// A character that is not there, is out, or was added since.
    pub fn pose_slice(&self, id: CharacterId) -> Result<PoseSlice, CrowdError> {
        self.check(id)?;
        let slot = self.slots[id.index()];
        if slot == NOWHERE {
            return Err(self.no_such(id));
        }
        if slot & PARKED != 0 {
            return Err(CrowdError::NotVisible { id: id.0 });
        }
        let (group, lane) = split(slot);
        let cold = &self.schedule.cold[group];
        let joints = self.animations.joints(cold.kind.level);
        let output = self.settings.output;
        Ok(PoseSlice::new(
            output,
            (cold.kind.level, joints),
            (cold.offset, lane),
        ))
    }
}
