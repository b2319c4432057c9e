//! Posing the groups of a crowd, on one thread or on several.

use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::animation_set::AnimationSet;
use super::bucket::Piece;
use super::error::CrowdError;
use super::instances::{Crowd, MOST_CHUNKS};
use super::output::Layout;
use super::run::{Level, Run, RunMemory, Turn};
use super::schedule::Schedule;
use super::scratch::Scratch;
use super::settings::CrowdSettings;
use crate::math::parallel::lock;
use crate::math::{F32x16, RowSet};

/// The memory that one chunk of the groups writes.
struct Part<'a>(Mutex<RunMemory<'a>>);

impl<'a> Part<'a> {
    fn none() -> Self {
        Self(Mutex::new(RunMemory::Lines(&mut [])))
    }
}

impl Crowd {
    /// Poses the characters into the beginning of `out`: all but inactive ones and those that the last [`Crowd::frame`] found
    /// outside its frustum, which stay out until a frame sees them again. Groups that [`Hold`](super::Hold) keeps for some frames are not
    /// written. Allocates nothing once it has been called a few times for a crowd that has not grown.
    ///
    /// # Errors
    /// A buffer that is too small.
    pub fn pose(&mut self, out: &mut [F32x16]) -> Result<(), CrowdError> {
        // A caller of `output_len` may have allocated exactly the present length.
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
        let apart = self.pose_parts(out);
        self.stale_cost.add_frame(apart);
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

    /// Poses the chunks on all threads; returns the number of groups that are no longer near each other in time.
    fn pose_parts(&mut self, out: &mut [F32x16]) -> usize {
        let mut parts = [(); MOST_CHUNKS].map(|()| Part::none());
        let schedule = &self.schedule;
        let mut rest = match self.settings.output.layout {
            Layout::Instances => RunMemory::Rows(RowSet::new(out, self.row_len(), &schedule.rows)),
            Layout::Blocks | Layout::Rows => RunMemory::Lines(out),
        };
        for (part, pieces) in parts.iter_mut().zip(schedule.parts()) {
            let lines = pieces.iter().map(|piece| piece.lines.len()).sum();
            let groups = pieces.iter().map(|piece| piece.groups.len()).sum();
            *part = Part(Mutex::new(rest.split_off_front(lines, groups)));
        }
        let pieces = Pieces {
            schedule,
            animations: &self.animations,
            settings: &self.settings,
            takes_turns: self.is_settled && !self.settings.keeps_previous,
            frame: self.frame,
            now: self.now(),
        };
        let (apart, next) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let chunks = schedule.chunks();
        self.pool.run(&|thread: usize| {
            let scratch = &mut lock(&self.scratch[thread]);
            loop {
                let chunk = next.fetch_add(1, Ordering::Relaxed);
                if chunk >= chunks {
                    return;
                }
                let mut out = lock(&parts[chunk].0);
                for piece in schedule.part(chunk) {
                    let memory = PieceMemory {
                        out: &mut out,
                        scratch,
                    };
                    apart.fetch_add(pieces.pose(piece, memory), Ordering::Relaxed);
                }
            }
        });
        apart.into_inner()
    }
}

/// Inputs of posing that all pieces share.
struct Pieces<'a> {
    schedule: &'a Schedule,
    animations: &'a AnimationSet,
    settings: &'a CrowdSettings,
    /// Whether groups may be held: posed only every few frames.
    takes_turns: bool,
    /// Number of frames that were posed.
    frame: usize,
    /// The groups' clock, in seconds.
    now: f32,
}

/// Memory for posing a piece.
struct PieceMemory<'a, 'b> {
    /// Receives the pieces of a chunk, one after the other.
    out: &'a mut RunMemory<'b>,
    scratch: &'a mut Scratch,
}

/// Consecutive groups of a piece, and which of them are posed.
struct Portion {
    groups: Range<usize>,
    turn: Turn,
}

impl Pieces<'_> {
    /// Poses a piece; returns the number of groups that are no longer near each other in time.
    fn pose(&self, piece: &Piece, memory: PieceMemory<'_, '_>) -> usize {
        let is_held = self.takes_turns && self.schedule.is_held(piece, self.settings.hold);
        let lines = piece.lines.len() / piece.groups.len();
        let (mut left, mut apart) = (piece.groups.clone(), 0);
        while !left.is_empty() {
            let portion = match is_held {
                true => self.next_portion(left.clone()),
                false => Portion {
                    groups: left.clone(),
                    turn: Turn { first: 0, step: 1 },
                },
            };
            left.start = portion.groups.end;
            let count = portion.groups.len();
            let own = memory.out.split_off_front(count * lines, count);
            if portion.turn.first < count {
                let run = self.run(piece, portion, memory.scratch);
                apart += run.on(self.settings.isa, own);
            }
        }
        apart
    }

    /// The first portion of groups that may be held: either those that have just come into view, which are all posed, or
    /// those that have not. Which groups are posed does not depend on how groups are cut into pieces.
    fn next_portion(&self, groups: Range<usize>) -> Portion {
        let is_new = |group: usize| self.schedule.is_new_in_view(group);
        let all = is_new(groups.start);
        let end = groups.clone().find(|&group| is_new(group) != all);
        let step = match all {
            true => 1,
            false => usize::from(self.settings.hold.frames) + 1,
        };
        Portion {
            turn: Turn {
                first: (self.frame + step - groups.start % step) % step,
                step,
            },
            groups: groups.start..end.unwrap_or(groups.end),
        }
    }

    fn run<'a>(&'a self, piece: &Piece, portion: Portion, scratch: &'a mut Scratch) -> Run<'a> {
        let Self {
            schedule,
            animations,
            ..
        } = self;
        let Portion { groups, turn } = portion;
        let level = piece.level;
        Run {
            keys: &animations.keys,
            bank: &animations.banks[level.index()],
            level: Level {
                number: f32::from(level.0),
                steps: &animations.steps[level.index()],
            },
            turn,
            ranges: &animations.ranges,
            near: &schedule.near[groups.clone()],
            mix: piece.mix,
            groups: &schedule.groups[groups.clone()],
            visible: &schedule.visible[groups.clone()],
            cold: &schedule.cold[groups],
            now: self.now,
            output: self.settings.output,
            scratch,
        }
    }
}
