//! The characters of a crowd: adding and changing them, the crowd's time, their groups, and where their poses are.

use std::sync::{Arc, Mutex};

use super::character::{Character, CharacterState, MemberId, Placement, clamped};
use super::error::{CrowdError, MOST_CHARACTERS};
use super::frame_input::FrameReport;
use super::kernel::batches::Scratch;
use super::keys::animation_set::AnimationSet;
use super::levels::FrameScratch;
use super::output::{Layout, Output, PoseSlice};
use super::sort::group::{MOST_LATE, NOWHERE, Slot};
use super::sort::schedule::{Schedule, Sorting, StaleCost};
use crate::lod::LevelId;
use crate::math::parallel::WorkerPool;
use crate::math::{Isa, thread_count};

/// Characters that are posed together.
pub struct Crowd {
    pub(super) animations: Arc<AnimationSet>,
    pub(super) settings: CrowdSettings,
    pub(super) pool: WorkerPool,
    pub(super) scratch: Vec<Mutex<Scratch>>,
    pub(super) states: Vec<CharacterState>,
    /// Group and lane of each character, as one number.
    pub(super) slots: Vec<u32>,
    pub(super) schedule: Schedule,
    /// Characters that wait for another group.
    pub(super) late: Vec<u32>,
    /// The crowd's time, in seconds.
    pub(super) time: f64,
    /// The time at which the groups' clock stands at 0, in seconds.
    pub(super) base: f64,
    pub(super) stale_cost: StaleCost,
    /// Number of characters that there is memory for.
    pub(super) capacity: usize,
    pub(super) scratch_of_frames: FrameScratch,
}

/// The longest time on the groups' clock, in seconds: single precision then still resolves a ten-thousandth of a frame.
pub(super) const LONGEST_RUN: f64 = 8.0;

/// Number of chunks for each thread, if there are several. With more chunks, the others wait less for a thread whose core
/// another process uses.
pub(super) const CHUNKS_OF_A_THREAD: usize = 8;

pub(super) const MOST_CHUNKS: usize = 256;

impl Crowd {
    /// A crowd without characters.
    #[must_use]
    pub fn new(animations: Arc<AnimationSet>, mut settings: CrowdSettings) -> Self {
        settings.isa = settings.isa.or_best();
        let pool = WorkerPool::new(thread_count(settings.threads).min(CrowdSettings::MOST_THREADS));
        let scratch = |_| Mutex::new(Scratch::new(&animations));
        Self {
            scratch: (0..pool.threads()).map(scratch).collect(),
            animations,
            settings,
            pool,
            states: Vec::new(),
            slots: Vec::new(),
            schedule: Schedule::default(),
            late: Vec::new(),
            time: 0.0,
            base: 0.0,
            stale_cost: StaleCost::default(),
            capacity: 0,
            scratch_of_frames: FrameScratch::default(),
        }
    }

    /// A crowd without characters, with memory for `characters` of them.
    #[must_use]
    pub fn with_capacity(
        animations: Arc<AnimationSet>,
        settings: CrowdSettings,
        characters: usize,
    ) -> Self {
        let mut crowd = Self::new(animations, settings);
        crowd.states.reserve(characters);
        crowd.slots.reserve(characters);
        crowd.late.reserve(characters);
        crowd.capacity = characters;
        crowd.schedule.reserve(characters, MOST_CHUNKS);
        crowd
    }

    /// The clips that the crowd's characters can play.
    pub fn animations(&self) -> &AnimationSet {
        &self.animations
    }

    /// The settings of the crowd, with the instruction set that is actually used: see
    /// [`Isa::or_best`](crate::math::Isa::or_best).
    pub fn settings(&self) -> &CrowdSettings {
        &self.settings
    }

    /// Number of characters, [inactive](Crowd::deactivate) ones included.
    pub fn len(&self) -> usize {
        self.states.len()
    }

    /// Whether there is no character.
    pub fn is_empty(&self) -> bool {
        self.states.is_empty()
    }

    /// Adds a character.
    ///
    /// # Errors
    /// A clip that does not exist; a crowd that is full.
    pub fn add(&mut self, character: &Character) -> Result<MemberId, CrowdError> {
        if self.states.len() >= MOST_CHARACTERS {
            return Err(CrowdError::Full);
        }
        let mut state = self.state(character)?;
        state.is_late = true;
        let id = self.states.len() as u32;
        self.states.push(state);
        self.slots.push(NOWHERE);
        self.late.push(id);
        if self.states.len() > self.capacity {
            // Capacity grows geometrically, so this is rare.
            self.capacity = (2 * self.capacity).max(self.states.len());
        }
        Ok(MemberId(id))
    }

    /// Replaces everything about a character, and activates it.
    ///
    /// # Errors
    /// A clip or a character that does not exist.
    pub fn set(&mut self, id: MemberId, character: &Character) -> Result<(), CrowdError> {
        self.check(id)?;
        let state = self.state(character)?;
        self.change(id, |old| {
            let is_late = old.is_late;
            *old = state;
            old.is_late = is_late;
        });
        Ok(())
    }

    /// Moves a character. [`Crowd::place_all`] is faster for many characters.
    ///
    /// # Errors
    /// A character that does not exist.
    pub fn place(&mut self, id: MemberId, placement: &Placement) -> Result<(), CrowdError> {
        self.check(id)?;
        self.change(id, |state| state.place(placement));
        Ok(())
    }

    /// Changes a character's level; its motion goes on.
    ///
    /// # Errors
    /// A character that does not exist.
    pub fn set_level(&mut self, id: MemberId, level: LevelId) -> Result<(), CrowdError> {
        self.set_detail(id, level, 0.0)
    }

    /// Changes a character's level and its progress towards the next level: see [`Character::blend`]. [`Crowd::frame`] does
    /// this for all characters at once.
    ///
    /// # Errors
    /// A character that does not exist.
    pub fn set_detail(
        &mut self,
        id: MemberId,
        level: LevelId,
        blend: f32,
    ) -> Result<(), CrowdError> {
        self.check(id)?;
        let last = self.animations.last();
        let detail = f32::from(level.0) + clamped(blend);
        self.change(id, |state| state.set_detail(detail, last));
        Ok(())
    }

    /// A character is not posed until it is [set](Crowd::set) again.
    ///
    /// # Errors
    /// A character that does not exist.
    pub fn deactivate(&mut self, id: MemberId) -> Result<(), CrowdError> {
        self.check(id)?;
        self.change(id, |state| state.is_inactive = true);
        Ok(())
    }

    /// The present description of a character: its time in the clip is the present one, its level that of the last frame.
    ///
    /// # Errors
    /// A character that does not exist.
    pub fn character(&self, id: MemberId) -> Result<Character, CrowdError> {
        self.check(id)?;
        let mut state = self.states[id.index()];
        self.store_detail(id, &mut state);
        Ok(state.character(&self.animations, self.time))
    }

    /// The crowd's time, in seconds; 0 at first.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Advances the crowd's time, in seconds. Negative and not finite values are ignored.
    pub fn advance(&mut self, seconds: f64) {
        if seconds > 0.0 {
            self.set_time(self.time + seconds);
        }
    }

    /// Sets the crowd's time, in seconds: each character is where it comes to at that time. Not finite values are ignored.
    pub fn set_time(&mut self, seconds: f64) {
        if !seconds.is_finite() {
            return;
        }
        self.time = seconds;
        if !(0.0..=LONGEST_RUN).contains(&(self.time - self.base)) {
            self.base = self.time;
            let (schedule, sorting) = self.sorting();
            schedule.rebase(&sorting);
        }
    }

    /// The groups' clock, in seconds.
    pub(super) fn now(&self) -> f32 {
        (self.time - self.base) as f32
    }

    pub(super) fn check(&self, id: MemberId) -> Result<(), CrowdError> {
        if id.index() < self.states.len() {
            Ok(())
        } else {
            Err(self.no_such(id))
        }
    }

    pub(super) fn no_such(&self, id: MemberId) -> CrowdError {
        CrowdError::NoSuchCharacter {
            id: id.0,
            characters: self.len(),
        }
    }

    fn state(&self, character: &Character) -> Result<CharacterState, CrowdError> {
        let animations = &*self.animations;
        let clips = animations.clips();
        let fade = character.fade.map(|fade| fade.clip);
        let mut played = [Some(character.clip), fade].into_iter().flatten();
        match played.find(|clip| clip.index() >= clips) {
            Some(clip) => Err(CrowdError::NoSuchClip {
                clip: clip.0,
                clips,
            }),
            None => Ok(CharacterState::new(character, animations, self.time)),
        }
    }
}

impl Crowd {
    /// Changes a character that exists, and its lane or its group.
    pub(super) fn change(&mut self, id: MemberId, change: impl FnOnce(&mut CharacterState)) {
        let mut state = self.states[id.index()];
        self.store_detail(id, &mut state);
        let before = state.level();
        change(&mut state);
        let slot = self.slots[id.index()];
        // An inactive character without a group needs none.
        let is_out = slot == NOWHERE && state.is_inactive;
        if state.is_late || is_out {
            self.states[id.index()] = state;
            return;
        }
        let cold = self.schedule.cold.get(Slot::from_number(slot).group);
        let fits = !state.is_inactive && cold.is_some_and(|cold| cold.kind.takes(&state));
        if slot != NOWHERE && fits {
            let [before, after] =
                [before, state.level()].map(|level| self.animations.joints(level));
            self.stale_cost.joints += before as isize - after as isize;
            self.schedule
                .write(Slot::from_number(slot), &state, &self.animations, self.base);
        } else {
            state.is_late = true;
            self.late.push(id.0);
        }
        self.states[id.index()] = state;
    }

    /// Reads the level that a frame has chosen from the character's lane.
    pub(super) fn store_detail(&self, id: MemberId, state: &mut CharacterState) {
        let slot = self.slots[id.index()];
        if slot != NOWHERE && !state.is_late {
            let slot = Slot::from_number(slot);
            state.detail = self.schedule.groups[slot.group].detail.0[slot.lane];
        }
    }
}

impl Crowd {
    /// Length of the output of [`Crowd::pose`], in `F32x16`s. Moves characters to other groups where that is due: a
    /// [`PoseSlice`] from before this call may be another character's.
    pub fn output_len(&mut self) -> usize {
        self.prepare(usize::MAX);
        self.needed_len()
    }

    /// Length of the output for the present groups, in `F32x16`s.
    pub(super) fn needed_len(&self) -> usize {
        match self.settings.output.layout {
            Layout::Instances => self.row_len() * self.states.len(),
            Layout::Blocks => self.schedule.lines,
        }
    }

    /// A length in `F32x16`s that [`Crowd::output_len`] never exceeds for `characters` characters, however their levels
    /// change: the size to allocate. The length for [`Crowd::capacity`] characters stays the same as long as the crowd does
    /// not outgrow it.
    pub fn max_output_len(&self, characters: usize) -> usize {
        let output = self.settings.output;
        let group = output.group_len(self.animations.joints(LevelId(0)));
        match output.layout {
            Layout::Instances => self.row_len() * characters,
            Layout::Blocks => Schedule::most_groups(characters) * group,
        }
    }

    /// Number of characters that the crowd has memory for. It grows only where characters are added beyond it.
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    /// Length of a character's row in [`Layout::Instances`], in `F32x16`s.
    pub(super) fn row_len(&self) -> usize {
        let joints = self.animations.joints(LevelId(0));
        self.settings.output.row_len(joints)
    }

    /// Puts all characters into groups. Sorts all of them if many are in none; and if the present groups have cost as much as sorting
    /// does, and the new ones surely fit into an output of `most` `F32x16`s.
    pub(super) fn prepare(&mut self, most: usize) -> FrameReport {
        let characters = self.states.len();
        let moved = self.late.len();
        let sorted = MOST_LATE * (moved + self.stale_cost.late) > characters
            || self.stale_cost.exceeds_sorting(characters)
                && characters > 0
                && self.sorted_len() <= most;
        if sorted {
            self.schedule.store_details(&mut self.states);
            let (schedule, sorting) = self.sorting();
            schedule.sort(sorting);
            self.stale_cost = StaleCost::default();
            self.scratch_of_frames.sorted_levels = None;
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

    /// A length that new groups do not exceed, in `F32x16`s. Groups of one level are full. The others are filled in the order of
    /// levels, so that each list of them takes at most a group of the finest level more than its characters need.
    fn sorted_len(&self) -> usize {
        let each = self
            .settings
            .output
            .group_len(self.animations.joints(LevelId(0)));
        match self.settings.output.layout {
            Layout::Instances => self.needed_len(),
            Layout::Blocks => self.needed_len() + (2 + self.late.len()) * each,
        }
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
    /// [`CrowdError::NoSuchCharacter`] for one that does not exist, is [inactive](Crowd::deactivate) or was added since.
    pub fn pose_slice(&self, id: MemberId) -> Result<PoseSlice, CrowdError> {
        self.check(id)?;
        let slot = self.slots[id.index()];
        if slot == NOWHERE {
            return Err(self.no_such(id));
        }
        let Slot { group, lane } = Slot::from_number(slot);
        let cold = &self.schedule.cold[group];
        let (offset, lane) = match self.settings.output.layout {
            Layout::Instances => (self.row_len() * cold.ids[lane] as usize, 0),
            Layout::Blocks => (cold.offset, lane),
        };
        let (output, level) = (self.settings.output, cold.kind.level);
        let joints = self.animations.joints(level);
        Ok(PoseSlice::new(output, level, joints, offset, lane))
    }
}

/// Settings of a crowd.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrowdSettings {
    /// Layout and write mode of the output.
    pub output: Output,
    /// Instruction set of the kernels. Default: the widest one of the machine.
    pub isa: Isa,
    /// Number of threads, including the caller's; 0 for as many as the machine has. At most [`Self::MOST_THREADS`] are
    /// started. They end when the crowd is dropped. Default 1.
    pub threads: usize,
}

impl CrowdSettings {
    /// Largest number of threads of a crowd.
    pub const MOST_THREADS: usize = 64;
}

impl Default for CrowdSettings {
    /// The widest instruction set of the machine, one thread.
    fn default() -> Self {
        Self {
            output: Output::default(),
            isa: Isa::best(),
            threads: 1,
        }
    }
}
