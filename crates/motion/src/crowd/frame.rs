//! One call per frame: time, culling, levels of detail and poses of all characters.
//!
//! Source: the levels are those of [`Switching`](crate::lod::Switching). Differs in how they are found: for sixteen characters at a
//! time, in the order of the groups (see `levels`). Only characters that need a finer level than their group's, or that enter the
//! frustum, are moved to other groups.
//!
//! ```text
//! advance the time
//! choose levels and visibility of each lane                                                   levels
//! move the characters that no longer fit their groups, or sort all of them                    sort
//! for each chunk of groups, on any thread: pose its pieces                                    kernel
//! ```

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::Vec3;

use super::character::{MemberId, Placement};
use super::error::CrowdError;
use super::frame_input::{Frame, FrameReport};
use super::instances::{Crowd, MOST_CHUNKS};
use super::kernel::moments::Run;
use super::kernel::write::RunMemory;
use super::levels::{FrameScratch, LevelPass, ParkedPass};
use super::output::Layout;
use super::sort::group::{Bucket, NOWHERE, PARKED, Slot};
use crate::lod::LevelId;
use crate::math::parallel::lock;
use crate::math::{F32x16, RowSet};

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
        {
            let _span = tracing::trace_span!("crowd: choose levels").entered();
            self.choose(frame);
        }
        let report = {
            let _span = tracing::trace_span!("crowd: sort").entered();
            self.prepare(out.len())
        };
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
        // Those that wait for a group.
        for index in 0..self.late.len() {
            self.choose_one(frame, self.late[index] as usize);
        }
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

    /// Chooses level and visibility of a character that is in no group.
    fn choose_one(&mut self, frame: &Frame<'_>, id: usize) {
        let last = self.animations().last();
        let state = &mut self.states[id];
        let position = Vec3::new(state.x, state.y, state.z);
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
        isa.on_lanes(ParkedPass {
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
            Some(&slot) => self.schedule.is_visible(Slot::from_number(slot)),
        }
    }

    /// Poses the characters into the beginning of `out`: all but inactive ones and those that the last [`Crowd::frame`] found
    /// outside its frustum, which stay out until a frame sees them again. It sorts all characters where that is due and `out`
    /// has room for any order of them. Allocates nothing once it has been called a few times for a crowd that has not grown.
    ///
    /// # Errors
    /// A buffer that is too small.
    pub fn pose(&mut self, out: &mut [F32x16]) -> Result<(), CrowdError> {
        self.prepare(out.len());
        self.pose_prepared(out)
    }

    /// Poses the groups as they are.
    pub(super) fn pose_prepared(&mut self, out: &mut [F32x16]) -> Result<(), CrowdError> {
        let (needed, found) = (self.needed_len(), out.len());
        if found < needed {
            return Err(CrowdError::TooSmall { needed, found });
        }
        let apart = self.pose_parts(out);
        self.stale_cost.add_frame(apart);
        Ok(())
    }

    /// Poses the chunks on all threads; returns the number of groups that are no longer near each other in time.
    fn pose_parts(&mut self, out: &mut [F32x16]) -> usize {
        let mut parts = [(); MOST_CHUNKS].map(|()| Mutex::new(RunMemory::Lines(&mut [])));
        let schedule = &self.schedule;
        let mut rest = match self.settings.output.layout {
            Layout::Instances => RunMemory::Rows(RowSet::new(out, self.row_len(), &schedule.rows)),
            Layout::Blocks => RunMemory::Lines(out),
        };
        let chunks = schedule.ends.len();
        for (chunk, part) in parts.iter_mut().enumerate().take(chunks) {
            let pieces = schedule.part(chunk);
            let lines = pieces.iter().map(Bucket::output_len).sum();
            let groups = pieces.iter().map(|piece| piece.groups.len()).sum();
            *part = Mutex::new(rest.split_off_front(lines, groups));
        }
        let (animations, output, now) = (&*self.animations, self.settings.output, self.now());
        let isa = self.settings.isa;
        let (apart, next) = (AtomicUsize::new(0), AtomicUsize::new(0));
        self.pool.run(&|thread: usize| {
            let scratch = &mut lock(&self.scratch[thread]);
            loop {
                let chunk = next.fetch_add(1, Ordering::Relaxed);
                if chunk >= chunks {
                    return;
                }
                let mut out = lock(&parts[chunk]);
                for piece in schedule.part(chunk) {
                    let own = out.split_off_front(piece.output_len(), piece.groups.len());
                    let (bank, groups) = (&animations.banks[piece.level.index()], &piece.groups);
                    let run = Run {
                        keys: &animations.keys,
                        bank,
                        level: f32::from(piece.level.0),
                        ranges: &animations.ranges,
                        near: &schedule.near[groups.clone()],
                        fades: piece.fades,
                        groups: &schedule.groups[groups.clone()],
                        visible: &schedule.visible[groups.clone()],
                        cold: &schedule.cold[groups.clone()],
                        now,
                        output,
                    };
                    let found = run.pose(isa, scratch, own);
                    apart.fetch_add(found, Ordering::Relaxed);
                }
            }
        });
        apart.into_inner()
    }
}
