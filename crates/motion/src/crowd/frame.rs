//! One call per frame: time, culling, levels of detail and poses of all characters.
//!
//! Source: the levels are those of [`Switching`]. Differs in how they are found: for sixteen characters at a time, in the
//! order of the groups (see `level_pass`). Only characters that need a finer level than their group's, or that enter the
//! frustum, are moved to other groups.

use glam::Vec3;

use super::character::{MemberId, Placement};
use super::error::CrowdError;
use super::frame_input::{Frame, FrameReport};
use super::instances::Crowd;
use super::level_pass::{FrameScratch, LevelPass};
use super::slot::{NOWHERE, PARKED, Slot};
use crate::lod::LevelId;
use crate::math::F32x16;

impl Crowd {
    /// Advances time, chooses levels, culls, and poses all visible characters into the beginning of `out`. Allocates nothing
    /// once it has been called a few times for a crowd that has not grown.
    ///
    /// # Errors
    /// `out` is shorter than [`Crowd::output_len`], which this call may have changed; nothing was written then, and
    /// [`Crowd::pose`] can be called with more. It is never longer than [`Crowd::max_output_len`].
    pub fn frame(
        &mut self,
        frame: &Frame<'_>,
        out: &mut [F32x16],
    ) -> Result<FrameReport, CrowdError> {
        self.advance(frame.seconds);
        let has_new_groups = {
            let _span = tracing::trace_span!("crowd: sort a part").entered();
            self.step_rebuild(Some(frame), out.len())
        };
        {
            let _span = tracing::trace_span!("crowd: choose levels").entered();
            self.choose(frame);
        }
        let mut report = {
            let _span = tracing::trace_span!("crowd: sort").entered();
            self.prepare()
        };
        if report.sorted {
            self.scratch_of_frames.sorted_levels = None;
        }
        report.sorted |= has_new_groups;
        let _span = tracing::trace_span!("crowd: pose").entered();
        self.pose_prepared(out)?;
        Ok(report)
    }

    /// Moves all characters: one placement for each, in the order of their numbers. Missing ones stay where they are.
    pub fn place_all(&mut self, placements: &[Placement]) {
        for (id, placement) in (0..self.len() as u32).zip(placements) {
            self.change(MemberId(id), |state| state.place(placement));
        }
    }

    /// Levels and visibility of all characters.
    fn choose(&mut self, frame: &Frame<'_>) {
        let mut scratch = std::mem::take(&mut self.scratch_of_frames);
        if let Some(switching) = frame.switching {
            scratch.ramps.update(switching);
        }
        self.choose_late(frame);
        if frame.switching.is_some() || frame.frustum.is_some() || !self.schedule.parked.is_empty()
        {
            self.choose_in_groups(frame, &mut scratch);
            self.unpark(frame, &mut scratch);
        } else {
            self.schedule.show_all();
            self.stale_cost.hidden = 0;
        }
        self.scratch_of_frames = scratch;
    }

    fn choose_in_groups(&mut self, frame: &Frame<'_>, scratch: &mut FrameScratch) {
        scratch.groups.clear();
        let groups = &self.schedule.groups;
        let most = groups.capacity().max(self.schedule.parked.capacity());
        scratch.groups.reserve(most);
        let last = self.animations().last();
        let found = self.settings().isa.on_lanes(LevelPass {
            schedule: &mut self.schedule,
            frame,
            ramps: &scratch.ramps,
            last: f32::from(last.0),
            finer: &mut scratch.groups,
        });
        for &group in &scratch.groups {
            let (cold, detail) = (
                &self.schedule.cold[group as usize],
                self.schedule.groups[group as usize].detail,
            );
            let own = f32::from(cold.kind.level.0);
            let visible = self.schedule.visible[group as usize];
            for (lane, &id) in cold.ids.iter().enumerate() {
                let Some(state) = self.states.get_mut(id as usize) else {
                    continue;
                };
                if visible >> lane & 1 == 1 && detail.0[lane] < own && !state.is_late {
                    state.detail = detail.0[lane];
                    state.is_late = true;
                    // Noted while it was hidden.
                    state.is_culled = false;
                    self.late.push(id);
                }
            }
        }
        let levels = scratch.sorted_levels.get_or_insert(found.levels);
        self.stale_cost.joints = (found.levels - *levels) as isize;
        self.stale_cost.hidden = found.hidden;
    }

    /// Chooses levels and visibility of the characters that wait for a group.
    fn choose_late(&mut self, frame: &Frame<'_>) {
        for index in 0..self.late.len() {
            let id = self.late[index] as usize;
            self.choose_one(frame, id);
        }
    }

    fn choose_one(&mut self, frame: &Frame<'_>, id: usize) {
        let last = self.animations().last();
        let state = &mut self.states[id];
        let own = Vec3::new(state.x, state.y, state.z);
        let position = frame.positions.and_then(|positions| positions.get(id));
        let position = position.copied().unwrap_or(own);
        state.is_culled = frame
            .frustum
            .is_some_and(|frustum| !frustum.contains(position));
        if let Some(switching) = frame.switching {
            let before = LevelId(state.detail as u16);
            let choice = switching.choose(position.distance(frame.eye), Some(before));
            state.set_detail(f32::from(choice.level.0) + choice.blend, last);
        }
    }

    /// Makes parked characters that are visible wait for a group.
    fn unpark(&mut self, frame: &Frame<'_>, scratch: &mut FrameScratch) {
        scratch.groups.clear();
        let isa = self.settings().isa;
        isa.on_lanes(super::level_pass::ParkedPass {
            parked: &self.schedule.parked,
            frame,
            visible: &mut scratch.groups,
        });
        for index in 0..scratch.groups.len() {
            let parked = scratch.groups[index] as usize;
            for lane in 0..F32x16::LANES {
                let id = self.schedule.parked[parked].ids[lane] as usize;
                if id >= self.states.len() || self.states[id].is_late {
                    continue;
                }
                self.choose_one(frame, id);
                if !self.states[id].is_culled {
                    self.states[id].is_late = true;
                    self.late.push(id as u32);
                }
            }
        }
    }

    /// Whether the last frame posed a character: not where it was outside the frustum or inactive.
    #[must_use]
    pub fn is_posed(&self, id: MemberId) -> bool {
        match self.slots.get(id.index()) {
            None | Some(&NOWHERE) => false,
            Some(&slot) if slot & PARKED != 0 => false,
            Some(&slot) => self.schedule.is_visible(Slot::of(slot)),
        }
    }
}
