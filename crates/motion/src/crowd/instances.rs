//! The characters of a crowd: adding and changing them, their clock, and their groups.

use std::sync::{Arc, Mutex};

use super::animation_set::AnimationSet;
use super::character::{Character, CharacterState, MemberId, Placement, clamped};
use super::error::CrowdError;
use super::history::History;
use super::level_pass::FrameScratch;
use super::rebuild::Rebuild;
use super::schedule::Schedule;
use super::scratch::Scratch;
use super::settings::CrowdSettings;
use super::slot::{self, NOWHERE};
use super::stale_cost::StaleCost;
use crate::anim::ClipId;
use crate::lod::LevelId;
use crate::math::parallel::WorkerPool;
use crate::math::thread_count;

/// Characters that are posed together.
pub struct Crowd {
    pub(super) animations: Arc<AnimationSet>,
    pub(super) settings: CrowdSettings,
    pub(super) pool: WorkerPool,
    /// One scratch for each thread.
    pub(super) scratch: Vec<Mutex<Scratch>>,
    pub(super) states: Vec<CharacterState>,
    /// Group and lane of each character, as one number.
    pub(super) slots: Vec<u32>,
    pub(super) schedule: Schedule,
    pub(super) rebuild: Rebuild,
    /// Characters that wait for another group.
    pub(super) late: Vec<u32>,
    /// The crowd's time, in seconds.
    pub(super) time: f64,
    /// The time at which the groups' clock stands at 0, in seconds.
    pub(super) base: f64,
    pub(super) stale_cost: StaleCost,
    /// Number of frames that were posed.
    pub(super) frame: usize,
    /// Positions of recent poses; used only with [`CrowdSettings::keeps_previous`].
    pub(super) history: History,
    /// Number of characters that there is memory for.
    pub(super) capacity: usize,
    /// Whether the groups have not been sorted since the last poses. Those that were made since stand behind the others.
    pub(super) is_settled: bool,
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
        let scratch = |_| Mutex::new(Scratch::of(&animations));
        Self {
            scratch: (0..pool.threads()).map(scratch).collect(),
            animations,
            settings,
            pool,
            states: Vec::new(),
            slots: Vec::new(),
            schedule: Schedule::default(),
            rebuild: Rebuild::default(),
            late: Vec::new(),
            time: 0.0,
            base: 0.0,
            stale_cost: StaleCost::default(),
            frame: 0,
            history: History::default(),
            capacity: 0,
            is_settled: false,
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
        if settings.keeps_previous {
            crowd.history.reserve(characters);
        }
        crowd.capacity = characters;
        crowd.schedule.reserve(characters, MOST_CHUNKS);
        crowd.rebuild.reserve(characters, MOST_CHUNKS);
        crowd
    }

    /// The clips that the crowd's characters can play.
    #[must_use]
    pub fn animations(&self) -> &AnimationSet {
        &self.animations
    }

    /// The settings of the crowd, with the instruction set that is actually used: see
    /// [`Isa::or_best`](crate::math::Isa::or_best).
    #[must_use]
    pub fn settings(&self) -> &CrowdSettings {
        &self.settings
    }

    /// Number of characters, [inactive](Crowd::deactivate) ones included.
    #[must_use]
    pub fn len(&self) -> usize {
        self.states.len()
    }

    /// Whether there is no character.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.states.is_empty()
    }

    /// Adds a character.
    ///
    /// # Errors
    /// A clip that does not exist; a crowd that is full.
    pub fn add(&mut self, character: &Character) -> Result<MemberId, CrowdError> {
        if self.states.len() >= slot::MOST {
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
        let detail = f32::from(level.0) + clamped(blend, 0.0);
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
    #[must_use]
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
        if !(0.0..=LONGEST_RUN).contains(&(self.time - self.rebuild.base)) {
            self.rebuild.abort();
        }
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
        let (clips, layers) = (animations.clips(), animations.layers());
        let is_clip = |clip: ClipId| clip.index() < clips;
        let is_layer = |clip: ClipId| (clips..clips + layers).contains(&clip.index());
        let fade = character.fade.map(|fade| fade.clip);
        let layer = character.layer.map(|layer| layer.clip);
        let unknown = [Some(character.clip), fade]
            .into_iter()
            .flatten()
            .find(|&clip| !is_clip(clip))
            .or(layer.filter(|&clip| !is_layer(clip)));
        match unknown {
            Some(clip) if is_clip(clip) => Err(CrowdError::NotALayer { clip: clip.0 }),
            Some(clip) if is_layer(clip) => Err(CrowdError::IsALayer { clip: clip.0 }),
            Some(clip) => Err(CrowdError::NoSuchClip {
                clip: clip.0,
                clips,
            }),
            None => Ok(CharacterState::new(character, animations, self.time)),
        }
    }
}
