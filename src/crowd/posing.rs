//! Posing the groups of a crowd, on one thread or on several.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::instances::{Crowd, MOST_CHUNKS};
use super::run::{Level, Run, Turn};
use super::settings::PoseError;
use crate::math::F32x16;

/// What one chunk of the groups writes.
struct Part<'a>(Mutex<&'a mut [F32x16]>);

impl Part<'_> {
    fn none() -> Self {
        Self(Mutex::new(&mut []))
    }
}

impl Crowd {
    /// Poses all characters into the beginning of `out`. Allocates nothing once it has been called a few times for a crowd
    /// that has not grown.
    ///
    /// # Errors
    /// A buffer that is too small.
    pub fn pose(&mut self, out: &mut [F32x16]) -> Result<(), PoseError> {
        self.prepare();
        self.pose_prepared(out)
    }

    /// Poses the groups as they are.
    pub(super) fn pose_prepared(&mut self, out: &mut [F32x16]) -> Result<(), PoseError> {
        let (needed, found) = (self.schedule.lines, out.len());
        if found < needed {
            return Err(PoseError::TooSmall { needed, found });
        }
        let mut parts = [(); MOST_CHUNKS].map(|()| Part::none());
        let mut rest = out;
        for (part, pieces) in parts.iter_mut().zip(self.schedule.parts()) {
            let lines = pieces.iter().map(|piece| piece.lines.len()).sum();
            let (out, others) = rest.split_at_mut(lines);
            *part = Part(Mutex::new(out));
            rest = others;
        }
        let apart = AtomicUsize::new(0);
        let (schedule, now) = (&self.schedule, self.now());
        let (animations, settings) = (&*self.animations, &self.settings);
        let scratch = &self.scratch;
        let (frame, is_settled) = (self.frame, self.is_settled);
        let next = AtomicUsize::new(0);
        let chunks = schedule.chunks();
        self.pool.run(&|thread: usize| {
            let scratch = &mut lock(&scratch[thread]);
            loop {
                let chunk = next.fetch_add(1, Ordering::Relaxed);
                if chunk >= chunks {
                    return;
                }
                let mut out: &mut [F32x16] = &mut lock(&parts[chunk].0);
                for piece in schedule.part(chunk) {
                    let (own, others) = out.split_at_mut(piece.lines.len());
                    out = others;
                    let level = piece.kind.level;
                    let run = Run {
                        keys: &animations.keys,
                        bank: &animations.banks[level.index()],
                        level: Level {
                            number: f32::from(level.0),
                            steps: &animations.steps[level.index()],
                        },
                        turn: match settings.hold {
                            hold if is_settled && level >= hold.from => {
                                let step = usize::from(hold.frames) + 1;
                                Turn {
                                    first: (frame + step - piece.groups.start % step) % step,
                                    step,
                                }
                            }
                            _ => Turn { first: 0, step: 1 },
                        },
                        near: piece.kind.near.map(|clip| animations.range(clip)),
                        fading: piece.kind.is_fading,
                        groups: &schedule.groups[piece.groups.clone()],
                        visible: &schedule.visible[piece.groups.clone()],
                        cold: &schedule.cold[piece.groups.clone()],
                        now,
                        output: settings.output,
                        out: own,
                        scratch,
                    };
                    apart.fetch_add(run.on(settings.isa), Ordering::Relaxed);
                }
            }
        });
        self.debt.of_a_frame(apart.into_inner());
        self.frame = self.frame.wrapping_add(1);
        self.is_settled = true;
        Ok(())
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
