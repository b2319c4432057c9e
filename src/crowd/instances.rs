use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::animation_set::AnimationSet;
use super::character::{Character, CharacterId, CharacterState, ClipId, Placement};
use super::kernel::{Level, Run, Scratch};
use super::output::PoseSlice;
use super::schedule::{self, NOWHERE, Schedule, Sorting, split};
use super::settings::{CrowdError, CrowdSettings, PoseError};
use crate::lod::LevelId;
use crate::math::{F32x16, WorkerPool, thread_count};

/// Characters that are posed together.
pub struct Crowd {
    animations: Arc<AnimationSet>,
    settings: CrowdSettings,
    pool: WorkerPool,
    /// One for each thread.
    scratch: Vec<Mutex<Scratch>>,
    states: Vec<CharacterState>,
    /// Of each character its group and lane, as one number.
    slots: Vec<u32>,
    schedule: Schedule,
    /// Characters who cannot stay in their groups, or have none.
    late: Vec<u32>,
    /// Seconds since the clocks were set back.
    now: f32,
    is_sorted: bool,
    debt: Debt,
    /// Frames that were posed.
    frame: usize,
    /// Whether slices are where they were in the frame before.
    is_settled: bool,
}

/// What the order costs more than a new one would, in fiftieths of what it takes to sort one
/// character: about a nanosecond.
#[derive(Clone, Copy, Debug, Default)]
struct Debt {
    /// Since the last sorting.
    owed: usize,
    /// Joints that characters have more than they need, since they stay in their groups.
    joints: isize,
    /// Characters in groups of their own.
    late: usize,
}

/// The clocks are set back when they have run for so long, seconds: a number of eight digits then
/// still tells a ten-thousandth of a frame.
const LONGEST_RUN: f32 = 8.0;

/// Sorted anew when one character in so many has come or changed its kind.
pub(super) const MOST_LATE: usize = 16;

const MOST_THREADS: usize = 64;

/// What one thread writes.
struct Part<'a>(Mutex<&'a mut [F32x16]>);

impl Part<'_> {
    fn none() -> Self {
        Self(Mutex::new(&mut []))
    }
}

impl Debt {
    /// Sorting a character.
    const CHARACTER: usize = 50;
    /// A group in a frame that is no longer near in time: it is read row by row.
    const APART: usize = 100;
    /// A character in a group of its own, which is not full.
    const LATE: usize = 4;

    fn of_a_frame(&mut self, apart: usize) {
        let joints = self.joints.max(0) as usize;
        self.owed += Self::APART * apart + Self::LATE * self.late + joints;
    }

    fn is_due(&self, characters: usize) -> bool {
        self.owed >= Self::CHARACTER * characters
    }
}

impl Crowd {
    /// Nobody yet.
    #[must_use]
    pub fn new(animations: Arc<AnimationSet>, settings: CrowdSettings) -> Self {
        let pool = WorkerPool::new(thread_count(settings.threads).min(MOST_THREADS));
        let scratch = |_| Mutex::new(Scratch::of(&animations));
        Self {
            scratch: (0..pool.threads()).map(scratch).collect(),
            animations,
            settings,
            pool,
            states: Vec::new(),
            slots: Vec::new(),
            schedule: Schedule::default(),
            late: Vec::new(),
            now: 0.0,
            is_sorted: true,
            debt: Debt::default(),
            frame: 0,
            is_settled: false,
        }
    }

    /// What its characters can play.
    #[must_use]
    pub fn animations(&self) -> &AnimationSet {
        &self.animations
    }

    /// How many characters, those who are [out](Crowd::deactivate) counted in.
    #[must_use]
    pub fn len(&self) -> usize {
        self.states.len()
    }

    /// Whether nobody is there.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.states.is_empty()
    }

    /// One more character.
    ///
    /// # Errors
    /// A clip that is not there; a crowd that is full.
    pub fn add(&mut self, character: &Character) -> Result<CharacterId, CrowdError> {
        if self.states.len() >= schedule::MOST {
            return Err(CrowdError::Full);
        }
        let state = self.state(character)?;
        let id = self.states.len() as u32;
        self.states.push(state);
        self.slots.push(NOWHERE);
        self.late.push(id);
        Ok(CharacterId(id))
    }

    /// Makes a character another one, and lets it in again where it was out.
    ///
    /// # Errors
    /// A clip or a character that is not there.
    pub fn set(&mut self, id: CharacterId, character: &Character) -> Result<(), CrowdError> {
        self.check(id)?;
        let state = self.state(character)?;
        self.change(id, |old| *old = state);
        Ok(())
    }

    /// Puts a character somewhere else.
    ///
    /// # Errors
    /// A character that is not there.
    pub fn place(&mut self, id: CharacterId, placement: &Placement) -> Result<(), CrowdError> {
        self.check(id)?;
        self.change(id, |state| state.place(placement));
        Ok(())
    }

    /// Lets a character go on with more joints or fewer; its motion goes on where it is.
    ///
    /// # Errors
    /// A character that is not there.
    pub fn set_level(&mut self, id: CharacterId, level: LevelId) -> Result<(), CrowdError> {
        self.set_detail(id, level, 0.0)
    }

    /// The same, on the way to the next level: see [`Character::blend`]. Level and blend of a
    /// [`Choice`](crate::lod::Choice) go here each frame; a crowd is seldom sorted anew for it.
    ///
    /// # Errors
    /// A character that is not there.
    pub fn set_detail(
        &mut self,
        id: CharacterId,
        level: LevelId,
        blend: f32,
    ) -> Result<(), CrowdError> {
        self.check(id)?;
        let last = self.animations.last();
        self.change(id, |state| state.set_detail((level, blend), last));
        Ok(())
    }

    /// A character is not posed until it is [set](Crowd::set) again.
    ///
    /// # Errors
    /// A character that is not there.
    pub fn deactivate(&mut self, id: CharacterId) -> Result<(), CrowdError> {
        self.check(id)?;
        self.change(id, |state| state.is_inactive = true);
        Ok(())
    }

    /// What a character does now: its time is that of this moment.
    ///
    /// # Errors
    /// A character that is not there.
    pub fn character(&self, id: CharacterId) -> Result<Character, CrowdError> {
        self.check(id)?;
        let state = &self.states[id.index()];
        let ranges = [state.clip, state.second].map(|clip| self.animations.range(clip));
        Ok(state.character(ranges, self.now))
    }

    /// Time goes on, seconds. Negative or not finite: it stands still.
    pub fn advance(&mut self, seconds: f32) {
        if seconds > 0.0 && seconds.is_finite() {
            self.now += seconds;
        }
        if self.now > LONGEST_RUN {
            for state in &mut self.states {
                let ranges = [state.clip, state.second].map(|clip| self.animations.range(clip));
                state.set_back(self.now, ranges);
            }
            self.now = 0.0;
            self.is_sorted = false;
        }
    }

    /// How many lines [`Crowd::pose`] writes now. Sorts the crowd where that is due.
    pub fn output_len(&mut self) -> usize {
        let characters = self.states.len();
        let sorting = Sorting {
            animations: &self.animations,
            states: &self.states,
            slots: &mut self.slots,
            now: self.now,
            output: self.settings.output,
            threads: self.pool.threads(),
        };
        let many = MOST_LATE * (self.late.len() + self.debt.late) > characters;
        if !self.is_sorted || many || self.debt.is_due(characters) {
            self.schedule.sort(sorting);
            self.debt = Debt::default();
            self.is_sorted = true;
            self.late
                .reserve(characters.saturating_sub(self.late.len()));
        } else if !self.late.is_empty() {
            self.schedule.move_late(&self.late, sorting);
            self.debt.late += self.late.len();
            self.is_settled = false;
        }
        self.late.clear();
        self.schedule.lines
    }

    /// Poses everybody into the beginning of `out`. After it has been called a few times for a crowd
    /// that has not grown, it allocates nothing.
    ///
    /// # Errors
    /// WriteMode that is too small.
    pub fn pose(&mut self, out: &mut [F32x16]) -> Result<(), PoseError> {
        let needed = self.output_len();
        let found = out.len();
        if found < needed {
            return Err(PoseError::TooSmall { needed, found });
        }
        let mut parts = [(); MOST_THREADS].map(|()| Part::none());
        let mut rest = out;
        for (part, pieces) in parts.iter_mut().zip(self.schedule.parts()) {
            let lines = pieces.iter().map(|piece| piece.lines.len()).sum();
            let (out, others) = rest.split_at_mut(lines);
            *part = Part(Mutex::new(out));
            rest = others;
        }
        let apart = AtomicUsize::new(0);
        let (schedule, now) = (&self.schedule, self.now);
        let (animations, settings) = (&*self.animations, &self.settings);
        let scratch = &self.scratch;
        let (frame, is_settled) = (self.frame, self.is_settled);
        self.pool.run(&|thread: usize| {
            let mut out: &mut [F32x16] = &mut lock(&parts[thread].0);
            for piece in schedule.part(thread) {
                let (own, others) = out.split_at_mut(piece.lines.len());
                out = others;
                let level = piece.kind.level;
                let run = Run {
                    bank: &animations.banks[level.index()],
                    level: Level {
                        number: f32::from(level.0),
                        steps: &animations.steps[level.index()],
                    },
                    turn: match settings.hold {
                        hold if is_settled && level >= hold.from => {
                            let step = usize::from(hold.frames) + 1;
                            ((frame + step - piece.groups.start % step) % step, step)
                        }
                        _ => (0, 1),
                    },
                    near: piece.kind.near.map(|clip| animations.range(clip)),
                    fading: piece.kind.is_fading,
                    groups: &schedule.groups[piece.groups.clone()],
                    cold: &schedule.cold[piece.groups.clone()],
                    now,
                    output: settings.output,
                    out: own,
                    scratch: &mut lock(&scratch[thread]),
                };
                apart.fetch_add(run.on(settings.isa), Ordering::Relaxed);
            }
        });
        self.debt.of_a_frame(apart.into_inner());
        self.frame = self.frame.wrapping_add(1);
        self.is_settled = true;
        Ok(())
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
        let (group, lane) = split(slot);
        let cold = &self.schedule.cold[group];
        Ok(PoseSlice {
            offset: cold.offset,
            lane,
            joints: self.animations.joints(cold.kind.level),
            level: cold.kind.level,
            output: self.settings.output,
        })
    }

    fn check(&self, id: CharacterId) -> Result<(), CrowdError> {
        if id.index() < self.states.len() {
            Ok(())
        } else {
            Err(self.no_such(id))
        }
    }

    fn no_such(&self, id: CharacterId) -> CrowdError {
        CrowdError::NoSuchCharacter {
            id: id.0,
            characters: self.len(),
        }
    }

    /// Changes a character who is there, and what its lane shows, or its group.
    fn change(&mut self, id: CharacterId, change: impl FnOnce(&mut CharacterState)) {
        let state = &mut self.states[id.index()];
        let before = state.level();
        change(state);
        let slot = self.slots[id.index()];
        if slot == NOWHERE {
            self.late.push(id.0);
            return;
        }
        let (group, lane) = split(slot);
        if !state.is_inactive && self.schedule.cold[group].kind.takes(state) {
            let [before, after] =
                [before, state.level()].map(|level| self.animations.joints(level));
            self.debt.joints += before as isize - after as isize;
            self.schedule.write((group, lane), state, &self.animations);
        } else {
            self.late.push(id.0);
        }
    }

    fn state(&self, character: &Character) -> Result<CharacterState, CrowdError> {
        let clips = self.animations.clips();
        let known = |clip: ClipId| match clip.index() < clips {
            true => Ok(clip),
            false => Err(CrowdError::NoSuchClip {
                clip: clip.0,
                clips,
            }),
        };
        known(character.clip)?;
        character.fade.map(|fade| known(fade.clip)).transpose()?;
        let range = |clip| self.animations.range(clip);
        Ok(CharacterState::new(
            character,
            range,
            (self.animations.last(), self.now),
        ))
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
