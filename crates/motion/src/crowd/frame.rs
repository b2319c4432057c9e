//! One call per frame: time, levels of detail and poses of all characters.
//!
//! Source: the levels are those of [`Switching`](crate::lod::Switching). Differs in how they are found: for sixteen characters at a
//! time, in the order of the groups (see `levels`). Only characters that need a finer level than their group's are moved to
//! other groups.
//!
//! ```text
//! advance the time
//! choose the level of each lane                                                               levels
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
use super::levels::LevelPass;
use super::output::Layout;
use super::sort::group::Bucket;
use crate::lod::{LevelId, Switching};
use crate::math::parallel::lock;
use crate::math::{F32x16, RowSet};

impl Crowd {
    /// Advances time, chooses levels, and poses all active characters into the beginning of `out`. Allocates nothing
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
            if let Some(switching) = frame.switching {
                self.choose(switching, frame.eye);
            }
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

    fn choose(&mut self, switching: &Switching, eye: Vec3) {
        let scratch = &mut self.scratch_of_frames;
        scratch.ramps.update(switching);
        let last = self.animations.last();
        // Those that wait for a group.
        for &id in &self.late {
            let state = &mut self.states[id as usize];
            let distance = Vec3::new(state.x, state.y, state.z).distance(eye);
            let choice = switching.choose(distance, Some(LevelId(state.detail as u16)));
            state.set_detail(f32::from(choice.level.0) + choice.blend, last);
        }
        scratch.groups.clear();
        scratch.groups.reserve(self.schedule.groups.capacity());
        let found = self.settings.isa.on_lanes(LevelPass {
            schedule: &mut self.schedule,
            eye,
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
            for (lane, &id) in cold.ids.iter().enumerate() {
                let Some(state) = self.states.get_mut(id as usize) else {
                    continue;
                };
                if detail.0[lane] < own && !state.is_late {
                    state.detail = detail.0[lane];
                    state.is_late = true;
                    self.late.push(id);
                }
            }
        }
        let levels = scratch.sorted_levels.get_or_insert(found);
        self.stale_cost.joints = (found - *levels) as isize;
    }

    /// Poses the characters into the beginning of `out`: all but inactive ones. It sorts all characters where that is due and `out` has room for
    /// any order of them. Allocates nothing once it has been called a few times for a crowd that has not grown.
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
