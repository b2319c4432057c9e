use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::event::CharacterEvent;
use super::goal::Goal;
use super::ids::{CharacterId, ThreatId};
use super::scratch::Worker;
use super::settings::CharacterSettings;
use super::state::CharacterState;
use super::steer::Steering;
use super::threat::Threat;
use super::world::{KnownThreat, World};
use crate::anim::{JointTransform, Pose, forward_kinematics};
use crate::graph::{Motion, Playhead};
use crate::maps::BakedGraph;
use crate::math::{Rigid2, WorkerPool, thread_count};

/// Why a call to [`Characters`] is refused.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CharacterError {
    /// There is no such character, or no longer.
    #[error("there is no character {index} of generation {generation}")]
    NoSuchCharacter {
        /// Index of its place.
        index: u32,
        /// Number of characters that had this place before it.
        generation: u32,
    },
    /// There is no such threat, or no longer.
    #[error("there is no threat {}", .0.0)]
    NoSuchThreat(ThreatId),
    /// The graph has no moment without a labelled event.
    #[error("the graph has no moment without an event, in which a character could stand")]
    NothingToPlay,
    /// A number is not finite or out of range.
    #[error("{0} has a number that is not finite or out of range")]
    Value(&'static str),
    /// A saved state that is damaged or belongs to another graph.
    #[error("the saved state {0}")]
    Saved(&'static str),
    /// The buffer for the joints has another length than the skeleton.
    #[error("the buffer has room for {found} joints; the skeleton has {needed}")]
    Joints {
        /// Number of joints of the skeleton.
        needed: usize,
        /// Length of the buffer.
        found: usize,
    },
}

/// The characters of a game: steered, threatened, and stepped together.
pub struct Characters {
    pub(super) baked: Arc<BakedGraph>,
    settings: CharacterSettings,
    steering: Steering,
    slots: Vec<Mutex<Slot>>,
    free: Vec<u32>,
    threats: Vec<KnownThreat>,
    next_threat: u64,
    now: f64,
    pool: WorkerPool,
    workers: Vec<Mutex<Worker>>,
    pose: Pose,
    joints: Vec<JointTransform>,
}

/// A place for a character.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Slot {
    generation: u32,
    state: Option<Box<CharacterState>>,
    /// Time until a new threat may reach the body, during a step.
    #[serde(skip)]
    urgency: Option<f32>,
}

/// Everything about characters and threats but the graph and the settings. Saved and restored, it goes on to the same bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CharactersState {
    slots: Vec<Slot>,
    free: Vec<u32>,
    threats: Vec<KnownThreat>,
    next_threat: u64,
    now: f64,
}

impl Characters {
    /// No characters yet. The tables for steering are made of the graph's clips.
    ///
    /// # Errors
    /// A graph whose every moment has an event; a query setting out of range.
    pub fn new(
        baked: Arc<BakedGraph>,
        settings: CharacterSettings,
    ) -> Result<Self, CharacterError> {
        if settings.query.check().is_err() {
            return Err(CharacterError::Value("a query setting"));
        }
        let steering = Steering::new(baked.graph());
        if steering.len() == 0 {
            return Err(CharacterError::NothingToPlay);
        }
        let pool = WorkerPool::new(thread_count(settings.threads));
        let workers = (0..pool.threads()).map(|_| Mutex::default()).collect();
        Ok(Self {
            baked,
            settings,
            steering,
            slots: Vec::new(),
            free: Vec::new(),
            threats: Vec::new(),
            next_threat: 0,
            now: 0.0,
            pool,
            workers,
            pose: Pose::default(),
            joints: Vec::new(),
        })
    }

    /// The graph.
    #[must_use]
    pub fn baked(&self) -> &Arc<BakedGraph> {
        &self.baked
    }

    /// Time since the beginning, in seconds: the sum of all steps.
    #[must_use]
    pub fn now(&self) -> f64 {
        self.now
    }

    /// Sets [`CharacterSettings::delay`], for example when answers come from a slower device.
    pub fn set_delay(&mut self, frames: u32) {
        self.settings.delay = frames;
    }

    /// Adds a character that stands at a place.
    ///
    /// # Errors
    /// A place that is not finite or too far away.
    pub fn spawn(&mut self, place: Rigid2) -> Result<CharacterId, CharacterError> {
        if !place.is_sound(5_000.0) {
            return Err(CharacterError::Value("the place"));
        }
        let (edge, frame) = self.steering.start().ok_or(CharacterError::NothingToPlay)?;
        let playhead = Playhead::at(self.baked.graph(), edge, frame, place);
        let motion = Motion::new(self.baked.graph(), playhead, &[]);
        let state = Some(Box::new(CharacterState::new(motion)));
        let index = match self.free.pop() {
            Some(index) => index,
            None => {
                let slot = Slot {
                    generation: 0,
                    state: None,
                    urgency: None,
                };
                self.slots.push(Mutex::new(slot));
                self.slots.len() as u32 - 1
            }
        };
        let slot = self.slot_mut(index);
        slot.state = state;
        Ok(CharacterId {
            index,
            generation: slot.generation,
        })
    }

    /// Removes a character.
    ///
    /// # Errors
    /// An unknown character.
    pub fn despawn(&mut self, id: CharacterId) -> Result<(), CharacterError> {
        self.state_mut(id)?;
        let slot = self.slot_mut(id.index);
        slot.generation += 1;
        slot.state = None;
        self.free.push(id.index);
        Ok(())
    }

    /// Number of characters.
    #[must_use]
    pub fn len(&self) -> usize {
        self.slots.len() - self.free.len()
    }

    /// Whether there are no characters.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Sets what a character does while nothing threatens it.
    ///
    /// # Errors
    /// An unknown character; a goal with a number that is not finite.
    pub fn steer(&mut self, id: CharacterId, goal: Goal) -> Result<(), CharacterError> {
        if !goal.is_sound() {
            return Err(CharacterError::Value("the goal"));
        }
        self.state_mut(id)?.goal = goal;
        Ok(())
    }

    /// Hands the body to something else, such as a ragdoll. The character stays where it is until [`Characters::resume`]; threats do not
    /// concern it.
    ///
    /// # Errors
    /// An unknown character.
    pub fn release(&mut self, id: CharacterId) -> Result<(), CharacterError> {
        let state = self.state_mut(id)?;
        state.is_released = true;
        state.pending = None;
        Ok(())
    }

    /// Takes the body back: the character goes on from the second of two poses in the world, which were seen `seconds` apart, with their
    /// speed, at the nearest moment of the clips. It keeps its goal.
    ///
    /// # Errors
    /// An unknown character; poses of another skeleton or with numbers that are not finite; no time between them.
    pub fn resume(
        &mut self,
        id: CharacterId,
        poses: [&Pose; 2],
        seconds: f32,
    ) -> Result<(), CharacterError> {
        let joints = self.baked.graph().skeleton().len();
        let sound = |pose: &&Pose| {
            pose.root.is_finite()
                && pose.root.length() < 5_000.0
                && pose.rotations.len() == joints
                && pose
                    .rotations
                    .iter()
                    .all(|rotation| rotation.is_normalized())
        };
        if !poses.iter().all(sound) || !(1e-4..=1.0).contains(&seconds) {
            return Err(CharacterError::Value("a pose"));
        }
        let goal = self.state_mut(id)?.goal;
        let found = self.steering.resume(&self.baked, poses, seconds);
        let motion = found.ok_or(CharacterError::NothingToPlay)?;
        let mut state = CharacterState::new(motion);
        state.goal = goal;
        *self.state_mut(id)? = state;
        Ok(())
    }

    /// Adds a threat.
    ///
    /// # Errors
    /// A threat with a number that is not finite or out of range.
    pub fn threaten(&mut self, threat: Threat) -> Result<ThreatId, CharacterError> {
        if !threat.is_sound() {
            return Err(CharacterError::Value("the threat"));
        }
        let id = ThreatId(self.next_threat);
        self.next_threat += 1;
        self.threats.push(KnownThreat {
            id,
            version: 0,
            threat,
        });
        Ok(id)
    }

    /// Changes a threat: its course, or what is known of it.
    ///
    /// # Errors
    /// An unknown threat; a number that is not finite or out of range.
    pub fn update(&mut self, id: ThreatId, threat: Threat) -> Result<(), CharacterError> {
        if !threat.is_sound() {
            return Err(CharacterError::Value("the threat"));
        }
        let index = self.threat_index(id)?;
        let known = &mut self.threats[index];
        known.version = known.version.wrapping_add(1);
        known.threat = threat;
        Ok(())
    }

    /// Removes a threat. Threats also end by themselves after [`Threat::seconds`].
    ///
    /// # Errors
    /// An unknown threat.
    pub fn remove(&mut self, id: ThreatId) -> Result<(), CharacterError> {
        let index = self.threat_index(id)?;
        self.threats.remove(index);
        Ok(())
    }

    /// The threats that exist or are announced, by id.
    pub fn threats(&self) -> impl Iterator<Item = (ThreatId, &Threat)> {
        self.threats.iter().map(|known| (known.id, &known.threat))
    }

    /// Lets `dt` seconds pass: plans what must be planned, steers, and measures how near threats come. Events are appended to `events`,
    /// by character. A negative or infinite time counts as 0.
    pub fn step(&mut self, dt: f32, events: &mut Vec<CharacterEvent>) {
        let dt = if dt.is_finite() { dt.max(0.0) } else { 0.0 };
        let world = World {
            baked: &self.baked,
            settings: &self.settings,
            steering: &self.steering,
            threats: &self.threats,
            now: self.now,
            dt,
        };
        let shared = (&self.slots[..], &self.workers[..]);
        on_all(&mut self.pool, shared, |index, slot, _| {
            let state = slot.state.as_deref_mut();
            slot.urgency = state.and_then(|state| state.begin(index as u32, &world));
        });
        let urgent = most_urgent(shared.0, self.settings.plans_per_step);
        on_all(&mut self.pool, shared, |index, slot, worker| {
            if let Some(state) = &mut slot.state {
                let plans = slot
                    .urgency
                    .is_some_and(|seconds| (seconds, index) <= urgent);
                state.step((index as u32, plans), &world, worker);
            }
        });
        self.now += f64::from(dt);
        for (index, slot) in self.slots.iter_mut().enumerate() {
            let slot = slot.get_mut().unwrap_or_else(PoisonError::into_inner);
            let character = CharacterId {
                index: index as u32,
                generation: slot.generation,
            };
            let Some(state) = &mut slot.state else {
                continue;
            };
            let happened = state.events.drain(..);
            events.extend(happened.map(|(time, kind)| CharacterEvent {
                character,
                time,
                kind,
            }));
        }
        let now = self.now;
        let lasts = |known: &KnownThreat| {
            known.threat.time + f64::from(known.threat.seconds) + f64::from(dt) >= now
        };
        self.threats.retain(lasts);
    }

    /// Writes the joints of a character in the world to `joints`, which has the length of the skeleton.
    ///
    /// # Errors
    /// An unknown character; a buffer of another length.
    pub fn pose(
        &mut self,
        id: CharacterId,
        joints: &mut [JointTransform],
    ) -> Result<(), CharacterError> {
        let needed = self.baked.graph().skeleton().len();
        if joints.len() != needed {
            let found = joints.len();
            return Err(CharacterError::Joints { needed, found });
        }
        let mut pose = std::mem::take(&mut self.pose);
        let written = self.local_pose(id, &mut pose);
        self.pose = pose;
        written?;
        forward_kinematics(self.baked.graph().skeleton(), &self.pose, &mut self.joints);
        joints.copy_from_slice(&self.joints);
        Ok(())
    }

    /// Writes the root in the world and the rotations of the joints relative to their parents.
    ///
    /// # Errors
    /// An unknown character.
    pub fn local_pose(&self, id: CharacterId, pose: &mut Pose) -> Result<(), CharacterError> {
        self.with_state(id, |state| {
            let playing = &state.playing;
            playing
                .motion
                .sample(self.baked.graph(), playing.seconds, pose);
        })
    }

    /// Position in the graph, for example to name the clip that is played. While a blend lasts, the pose differs from it.
    ///
    /// # Errors
    /// An unknown character.
    pub fn playhead(&self, id: CharacterId) -> Result<Playhead, CharacterError> {
        self.with_state(id, |state| {
            let playing = &state.playing;
            playing.motion.playhead(self.baked.graph(), playing.seconds)
        })
    }

    /// The character's frame: root on the ground, facing direction.
    ///
    /// # Errors
    /// An unknown character.
    pub fn place(&self, id: CharacterId) -> Result<Rigid2, CharacterError> {
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        self.local_pose(id, &mut pose)?;
        forward_kinematics(self.baked.graph().skeleton(), &pose, &mut joints);
        Ok(self.baked.stance(&joints).placement)
    }

    /// Everything that can be saved. Serialize it in any format that keeps floats to the bit.
    #[must_use]
    pub fn state(&self) -> CharactersState {
        CharactersState {
            slots: self.slots.iter().map(|slot| lock(slot).clone()).collect(),
            free: self.free.clone(),
            threats: self.threats.clone(),
            next_threat: self.next_threat,
            now: self.now,
        }
    }

    /// Goes on from a saved state of the same graph.
    ///
    /// # Errors
    /// A state that is damaged or belongs to another graph. The characters then stay as they are.
    pub fn restore(&mut self, state: CharactersState) -> Result<(), CharacterError> {
        state.check(&self.baked)?;
        self.slots = state.slots.into_iter().map(Mutex::new).collect();
        self.free = state.free;
        self.threats = state.threats;
        self.next_threat = state.next_threat;
        self.now = state.now;
        Ok(())
    }

    /// [`Characters::state`] as bytes.
    ///
    /// # Errors
    /// Memory is exhausted.
    pub fn save(&self) -> Result<Vec<u8>, CharacterError> {
        postcard::to_stdvec(&self.state())
            .map_err(|_| CharacterError::Saved("needs too much memory"))
    }

    /// [`Characters::restore`] from bytes.
    ///
    /// # Errors
    /// Those of [`Characters::restore`]; bytes that are none of [`Characters::save`].
    pub fn load(&mut self, bytes: &[u8]) -> Result<(), CharacterError> {
        let damaged = |_| CharacterError::Saved("is damaged");
        let (state, rest) = postcard::take_from_bytes(bytes).map_err(damaged)?;
        if !rest.is_empty() {
            return Err(CharacterError::Saved("is longer than it should be"));
        }
        self.restore(state)
    }

    fn threat_index(&self, id: ThreatId) -> Result<usize, CharacterError> {
        let found = self.threats.binary_search_by_key(&id, |known| known.id);
        found.map_err(|_| CharacterError::NoSuchThreat(id))
    }

    fn slot_mut(&mut self, index: u32) -> &mut Slot {
        let slot = self.slots[index as usize].get_mut();
        slot.unwrap_or_else(PoisonError::into_inner)
    }

    fn state_mut(&mut self, id: CharacterId) -> Result<&mut CharacterState, CharacterError> {
        let CharacterId { index, generation } = id;
        let unknown = CharacterError::NoSuchCharacter { index, generation };
        let slot = self.slots.get_mut(index as usize);
        let slot = slot.map(|slot| slot.get_mut().unwrap_or_else(PoisonError::into_inner));
        slot.filter(|slot| slot.generation == generation)
            .and_then(|slot| slot.state.as_deref_mut())
            .ok_or(unknown)
    }

    fn with_state<T>(
        &self,
        id: CharacterId,
        read: impl FnOnce(&CharacterState) -> T,
    ) -> Result<T, CharacterError> {
        let CharacterId { index, generation } = id;
        let unknown = CharacterError::NoSuchCharacter { index, generation };
        let Some(slot) = self.slots.get(index as usize) else {
            return Err(unknown);
        };
        let slot = lock(slot);
        match &slot.state {
            Some(state) if slot.generation == generation => Ok(read(state)),
            _ => Err(unknown),
        }
    }
}

impl CharactersState {
    fn check(&self, baked: &BakedGraph) -> Result<(), CharacterError> {
        let graph = baked.graph();
        let plays = |motion: &Motion| !motion.is_empty() && motion.is_sound(graph);
        let sound = |state: &CharacterState| {
            let playing = &state.playing;
            let times =
                (0.0..=600.0).contains(&playing.seconds) && (0.01..=100.0).contains(&playing.rate);
            let pending = state.pending.as_ref();
            times
                && plays(&playing.motion)
                && pending.is_none_or(|pending| plays(&pending.motion) && pending.at.is_finite())
                && state.goal.is_sound()
        };
        let states = self.slots.iter().filter_map(|slot| slot.state.as_deref());
        let empty = |index: &u32| {
            { self.slots.get(*index as usize) }.is_some_and(|slot| slot.state.is_none())
        };
        let vacant = self
            .slots
            .iter()
            .filter(|slot| slot.state.is_none())
            .count();
        let fits = self.now.is_finite()
            && states.into_iter().all(sound)
            && self.free.iter().all(empty)
            && self.free.len() == vacant
            && self.threats.iter().all(|known| known.threat.is_sound())
            && self.threats.is_sorted_by(|a, b| a.id < b.id)
            && self
                .threats
                .iter()
                .all(|known| known.id.0 < self.next_threat);
        match fits {
            true => Ok(()),
            false => Err(CharacterError::Saved("does not fit this graph")),
        }
    }
}

/// Calls `work` for each place, on all threads.
fn on_all(
    pool: &mut WorkerPool,
    (slots, workers): (&[Mutex<Slot>], &[Mutex<Worker>]),
    work: impl Fn(usize, &mut Slot, &mut Worker) + Sync,
) {
    let next = AtomicUsize::new(0);
    pool.run(&|thread: usize| {
        let mut worker = lock(&workers[thread]);
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(slot) = slots.get(index) else {
                return;
            };
            work(index, &mut lock(slot), &mut worker);
        }
    });
}

/// The last character of `most` that may plan in a step, by the time until a threat may reach it and its index.
fn most_urgent(slots: &[Mutex<Slot>], most: usize) -> (f32, usize) {
    const ALL: (f32, usize) = (f32::INFINITY, usize::MAX);
    if most >= slots.len() {
        return ALL;
    }
    let slots = slots.iter().enumerate();
    let urgency = |(index, slot): (usize, &Mutex<Slot>)| Some((lock(slot).urgency?, index));
    let mut all: Vec<(f32, usize)> = slots.filter_map(urgency).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    match most.checked_sub(1).map(|last| all.get(last)) {
        Some(Some(&last)) => last,
        Some(None) => ALL,
        None => (f32::NEG_INFINITY, 0),
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
