//! Posing the groups of a crowd, on one thread or on several.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::error::CrowdError;
use super::instances::{Crowd, MOST_CHUNKS};
use super::output::Layout;
use super::run::{Level, Run, RunMemory, Turn};
use super::schedule::Schedule;
use crate::math::{F32x16, RowSet, lock};

/// What one chunk of the groups writes.
struct Part<'a>(Mutex<RunMemory<'a>>);

impl<'a> Part<'a> {
    fn none() -> Self {
        Self(Mutex::new(RunMemory::Lines(&mut [])))
    }
}

impl Crowd {
    /// Poses all characters into the beginning of `out`. Allocates nothing once it has been called a few times for a crowd
    /// that has not grown.
    ///
    /// # Errors
    /// A buffer that is too small.
    pub fn pose(&mut self, out: &mut [F32x16]) -> Result<(), CrowdError> {
        // A caller who has asked for the length has no more memory.
        self.step_rebuild(None, self.needed_len());
        self.prepare();
        self.pose_prepared(out)
    }

    /// Poses the groups as they are.
    pub(super) fn pose_prepared(&mut self, out: &mut [F32x16]) -> Result<(), CrowdError> {
        let (needed, found) = (self.needed_len(), out.len());
        if found < needed {
            return Err(CrowdError::TooSmall { needed, found });
        }
        let mut parts = [(); MOST_CHUNKS].map(|()| Part::none());
        let row_len = self.row_len();
        let layout = self.settings.output.layout;
        let mut rest = match layout {
            Layout::Instances => RunMemory::Rows(RowSet::new(out, row_len, &self.schedule.rows)),
            Layout::Blocks | Layout::Rows => RunMemory::Lines(out),
        };
        for (part, pieces) in parts.iter_mut().zip(self.schedule.parts()) {
            let lines = pieces.iter().map(|piece| piece.lines.len()).sum();
            let groups = pieces.iter().map(|piece| piece.groups.len()).sum();
            *part = Part(Mutex::new(rest.split_off_front(lines, groups)));
        }
        let apart = AtomicUsize::new(0);
        let (schedule, now) = (&self.schedule, self.now());
        let (animations, settings) = (&*self.animations, &self.settings);
        let scratch = &self.scratch;
        let frame = self.frame;
        let takes_turns = self.is_settled && !settings.keeps_previous;
        let next = AtomicUsize::new(0);
        let chunks = schedule.chunks();
        self.pool.run(&|thread: usize| {
            let scratch = &mut lock(&scratch[thread]);
            loop {
                let chunk = next.fetch_add(1, Ordering::Relaxed);
                if chunk >= chunks {
                    return;
                }
                let mut out = lock(&parts[chunk].0);
                for piece in schedule.part(chunk) {
                    let own = out.split_off_front(piece.lines.len(), piece.groups.len());
                    let level = piece.level;
                    let run = Run {
                        keys: &animations.keys,
                        bank: &animations.banks[level.index()],
                        level: Level {
                            number: f32::from(level.0),
                            steps: &animations.steps[level.index()],
                        },
                        turn: match takes_turns && schedule.is_held(piece, settings.hold) {
                            true => {
                                let step = usize::from(settings.hold.frames) + 1;
                                Turn {
                                    first: (frame + step - piece.groups.start % step) % step,
                                    step,
                                }
                            }
                            false => Turn { first: 0, step: 1 },
                        },
                        ranges: &animations.ranges,
                        near: &schedule.near[piece.groups.clone()],
                        mix: piece.mix,
                        groups: &schedule.groups[piece.groups.clone()],
                        visible: &schedule.visible[piece.groups.clone()],
                        cold: &schedule.cold[piece.groups.clone()],
                        now,
                        output: settings.output,
                        scratch,
                    };
                    apart.fetch_add(run.on(settings.isa, own), Ordering::Relaxed);
                }
            }
        });
        self.debt.of_a_frame(apart.into_inner());
        self.note_places();
        let Schedule {
            visible,
            was_visible,
            ..
        } = &mut self.schedule;
        for (was_visible, visible) in was_visible.iter_mut().zip(visible) {
            *was_visible = *visible != 0;
        }
        self.frame = self.frame.wrapping_add(1);
        self.is_settled = true;
        Ok(())
    }
}
