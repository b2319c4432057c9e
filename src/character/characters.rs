use std::sync::{Arc, Mutex, PoisonError};

use glam::{Quat, Vec3};

use super::error::{ANY, CharacterError, FURTHEST, shorter, within};
use super::event::{CharacterEvent, CharacterId, ThreatId};
use super::flights::Flights;
use super::goal::{Goal, StrikeAt};
use super::kind::{Kind, KindId};
use super::obstacles::find_bodies;
use super::settings::CharacterSettings;
use super::slot::{Due, Slot, Urgent, each, each_urgent, most_urgent, share_searches};
use super::state::CharacterState;
use super::threat::Threat;
use super::world::{KnownThreat, OtherBody, Worker, World};
use crate::anim::{JointId, JointTransform, Pose, forward_kinematics};
use crate::graph::{Motion, Playhead};
use crate::maps::BakedGraph;
use crate::math::parallel::{WorkerPool, lock};
use crate::math::{Rigid2, thread_count};
use crate::query::Obstacle;

/// Longest time of one step, in seconds.
const LONGEST_STEP: f32 = 1.0;

/// How far blends and warps move a root up or down, in metres.
const MOVED: f32 = 1.0;

/// The characters of a game: steered, threatened, and stepped together.
pub struct Characters {
    pub(super) kinds: Vec<Kind>,
    pub(super) slots: Vec<Mutex<Slot>>,
    pub(super) free: Vec<u32>,
    pub(super) threats: Vec<KnownThreat>,
    /// Memory of limbs that were threats.
    pub(super) unused_limbs: Vec<KnownThreat>,
    pub(super) next_threat: u64,
    pub(super) now: f64,
    pub(super) pool: WorkerPool,
    pub(super) workers: Vec<Mutex<Worker>>,
    flights: Flights,
    bodies: Vec<OtherBody>,
    urgent: Vec<Urgent>,
    due: Vec<Due>,
}

impl Characters {
    /// Creates a game without characters, for those of one kind. It computes the tables for steering and prepares the graph
    /// ([`BakedGraph::prepare`]), so that no step has to.
    ///
    /// # Errors
    /// A graph whose every moment has an event; a setting out of range.
    pub fn new(
        baked: Arc<BakedGraph>,
        settings: CharacterSettings,
    ) -> Result<Self, CharacterError> {
        let kind = Kind::new(KindId::default(), baked, settings)?;
        let pool = WorkerPool::new(thread_count(settings.threads));
        let workers = (0..pool.threads()).map(|_| Mutex::default()).collect();
        Ok(Self {
            kinds: vec![kind],
            flights: Flights::default(),
            slots: Vec::new(),
            free: Vec::new(),
            threats: Vec::new(),
            unused_limbs: Vec::new(),
            next_threat: 0,
            now: 0.0,
            pool,
            workers,
            bodies: Vec::new(),
            urgent: Vec::new(),
            due: Vec::new(),
        })
    }

    /// Adds a kind of character: another graph, or the same one with other settings. Characters of all kinds share threats, obstacles and each
    /// step, avoid each other and strike each other. The limits of a step ([`CharacterSettings::threads`], `searches_per_step`,
    /// `plans_per_step` and `plan_milliseconds`) are those of the first kind.
    ///
    /// # Errors
    /// The errors of [`Characters::new`]; more than 65,536 kinds.
    pub fn add_kind(
        &mut self,
        baked: Arc<BakedGraph>,
        settings: CharacterSettings,
    ) -> Result<KindId, CharacterError> {
        let id = u16::try_from(self.kinds.len()).map_err(|_| CharacterError::TooManyKinds)?;
        self.kinds.push(Kind::new(KindId(id), baked, settings)?);
        Ok(KindId(id))
    }

    /// The graph of the first kind.
    pub fn baked(&self) -> &Arc<BakedGraph> {
        &self.kinds[0].baked
    }

    /// The graph of a kind.
    ///
    /// # Errors
    /// An unknown kind.
    pub fn baked_of_kind(&self, kind: KindId) -> Result<&Arc<BakedGraph>, CharacterError> {
        Ok(&self.known_kind(kind)?.baked)
    }

    /// The graph of a character.
    ///
    /// # Errors
    /// An unknown character.
    pub fn baked_of(&self, id: CharacterId) -> Result<&Arc<BakedGraph>, CharacterError> {
        Ok(&self.kind(id)?.of(&self.kinds).baked)
    }

    /// The kind of a character.
    ///
    /// # Errors
    /// An unknown character.
    pub fn kind(&self, id: CharacterId) -> Result<KindId, CharacterError> {
        self.with_state(id, |kind, _| kind.id)
    }

    /// Time since the beginning, in seconds: the sum of all steps.
    pub fn now(&self) -> f64 {
        self.now
    }

    /// Sets [`CharacterSettings::delay`] of all kinds.
    ///
    /// # Errors
    /// A delay of more than [`CharacterSettings::MOST_DELAY`].
    pub fn set_delay(&mut self, frames: u32) -> Result<(), CharacterError> {
        for kind in &mut self.kinds {
            let settings = CharacterSettings {
                delay: frames,
                ..kind.settings
            };
            settings.check()?;
            kind.settings = settings;
        }
        Ok(())
    }

    /// Adds a character of the first kind that stands at a place.
    ///
    /// # Errors
    /// A place that is not finite or more than 5 km from the origin.
    pub fn spawn(&mut self, place: Rigid2) -> Result<CharacterId, CharacterError> {
        self.spawn_kind(KindId::default(), place)
    }

    /// Adds a character of a kind that stands at a place.
    ///
    /// # Errors
    /// An unknown kind; a place that is not finite or more than 5 km from the origin.
    pub fn spawn_kind(
        &mut self,
        kind: KindId,
        place: Rigid2,
    ) -> Result<CharacterId, CharacterError> {
        let ground = Vec3::new(place.x, 0.0, place.z);
        shorter("the place's distance from the origin", ground, FURTHEST)?;
        within("the place's heading", place.heading(), ANY)?;
        let index = self.free.last().copied();
        let index = index.unwrap_or(self.slots.len() as u32);
        let Kind {
            baked, steering, ..
        } = self.known_kind(kind)?;
        let start = steering.start(index);
        let (edge, frame) = start.ok_or(CharacterError::NothingToPlay)?;
        let playhead = Playhead::at(baked.graph(), edge, frame, place);
        let motion = Motion::new(baked.graph(), playhead, &[]);
        let state = Some(Box::new(CharacterState::new(motion)));
        if self.free.pop().is_none() {
            self.slots.push(Mutex::default());
        }
        let slot = self.slot_mut(index);
        (slot.kind, slot.state) = (kind, state);
        Ok(slot.id(index as usize))
    }

    /// Removes a character.
    ///
    /// # Errors
    /// An unknown character.
    pub fn despawn(&mut self, id: CharacterId) -> Result<(), CharacterError> {
        self.character_mut(id)?;
        let slot = self.slot_mut(id.index);
        slot.generation += 1;
        slot.state = None;
        self.free.push(id.index);
        Ok(())
    }

    /// Number of characters.
    pub fn len(&self) -> usize {
        self.slots.len() - self.free.len()
    }

    /// Whether there are no characters.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Sets what a character does while nothing threatens it.
    ///
    /// # Errors
    /// An unknown character, also as what a goal strikes; one that strikes itself; attacks that the graph does not have; the errors of [`Goal::check`].
    pub fn steer(&mut self, id: CharacterId, goal: Goal) -> Result<(), CharacterError> {
        goal.check()?;
        if let Goal::Strike { at, kind } = goal {
            if let StrikeAt::Character(other) = at {
                self.kind(other)?;
            }
            let can = |own: &Kind, _: &_| own.steering.strikes.has(kind);
            if at == StrikeAt::Character(id) || !self.with_state(id, can)? {
                return Err(CharacterError::CannotStrike);
            }
        }
        let (own, state) = self.character_mut(id)?;
        let place = state.playing.ground(own.baked.graph());
        let [before, aim] = [state.goal, goal].map(|goal| goal.aim(place, &mut false));
        if aim.differs(&before) {
            state.steer.search_soon();
        }
        let is_same = state.goal == goal;
        state.has_arrived &= is_same;
        state.reach = state.reach.filter(|_| is_same);
        state.goal = goal;
        Ok(())
    }

    /// Moves a character in the world, for example with a platform, or to where a character controller wants it. It goes on with what it plays
    /// from there; a plan is tested again once it has been moved by more than [`CharacterSettings::margin`].
    ///
    /// # Errors
    /// An unknown character; numbers that are not finite; a place more than 5 km from the origin.
    pub fn move_by(&mut self, id: CharacterId, by: Rigid2) -> Result<(), CharacterError> {
        let now = self.now;
        let (kind, state) = self.character_mut(id)?;
        let graph = kind.baked.graph();
        let place = state.playing.ground(graph);
        let there = by.point(Vec3::new(place.x, 0.0, place.y));
        shorter("the place's distance from the origin", there, FURTHEST)?;
        within("the heading", by.heading(), ANY)?;
        state.move_by(by, now, kind.settings.margin, graph);
        Ok(())
    }

    /// Sets the height of the ground on which a character stands, in metres, for example on stairs. Default 0. Threats, obstacles and poses stay in
    /// the world; characters avoid each other only on grounds that are less than 1.8 m apart.
    ///
    /// # Errors
    /// An unknown character; a height that is not finite or beyond 5 km.
    pub fn set_height(&mut self, id: CharacterId, height: f32) -> Result<(), CharacterError> {
        within("the height of the ground", height, -FURTHEST..=FURTHEST)?;
        self.character_mut(id)?.1.height = height;
        Ok(())
    }

    /// Adds rotations to joints of what a character plays, for example to aim or to react to a hit: each in the joint's own frame. They replace
    /// those of the last call; none at first. Poses, hits and plans have them; a plan expects that they stay as they are. A motion is tested again
    /// once they have turned by more than [`CharacterSettings::margin`] in radians. Plans take longer with them, as all is posed.
    ///
    /// # Errors
    /// An unknown character; a joint that its skeleton does not have; rotations that are not of unit length.
    pub fn set_additive(
        &mut self,
        id: CharacterId,
        joints: &[(JointId, Quat)],
    ) -> Result<(), CharacterError> {
        let now = self.now;
        let (kind, state) = self.character_mut(id)?;
        let needed = kind.baked.graph().skeleton().len();
        for (joint, rotation) in joints {
            let last = needed.saturating_sub(1) as f32;
            within("the number of the joint", f32::from(joint.0), 0.0..=last)?;
            check_rotation(*rotation)?;
        }
        let turned = state.additive.set(joints, kind.baked.reach());
        state.has_moved(turned, now, kind.settings.margin);
        Ok(())
    }

    /// Hands the body to another system, such as a ragdoll. The character stays in place and ignores threats until
    /// [`Characters::resume`].
    ///
    /// # Errors
    /// An unknown character.
    pub fn release(&mut self, id: CharacterId) -> Result<(), CharacterError> {
        let now = self.now;
        let (_, state) = self.character_mut(id)?;
        state.is_released = true;
        state.pending = None;
        state.end_strike(now, false);
        Ok(())
    }

    /// Takes the body back. `poses` are its last two poses in the world, `seconds` apart. The character continues from the second pose and its
    /// speed, at the nearest moment of the clips, and keeps its goal; what was added to its joints is in the poses, and is forgotten. A character
    /// that was not released continues from there, too.
    ///
    /// # Errors
    /// An unknown character; poses of another skeleton, with numbers that are not finite, rotations that are not of unit length, or a place
    /// more than 5 km from the origin or a joint from its parent; a time between them of less than 0.1 ms or more than 1 s.
    pub fn resume(
        &mut self,
        id: CharacterId,
        poses: [&Pose; 2],
        seconds: f32,
    ) -> Result<(), CharacterError> {
        let game_time = self.now;
        let (kind, state) = self.character_mut(id)?;
        for pose in poses {
            check_pose(kind.baked.graph().skeleton().len(), pose)?;
        }
        within("the time between the poses", seconds, 1e-4..=1.0)?;
        let CharacterState { goal, height, .. } = *state;
        let [mut before, mut now] = poses.map(Pose::clone);
        before.root.y -= height;
        now.root.y -= height;
        let poses = [&before, &now];
        let found = kind.steering.resume(&kind.baked, poses, seconds);
        let motion = found.ok_or(CharacterError::NothingToPlay)?;
        state.end_strike(game_time, false);
        let events = std::mem::take(&mut state.events);
        *state = CharacterState {
            goal,
            height,
            events,
            ..CharacterState::new(motion)
        };
        Ok(())
    }

    /// Adds a threat.
    ///
    /// # Errors
    /// A threat with a number that is not finite or out of range (see [`Threat`]); an unknown target.
    pub fn threaten(&mut self, threat: Threat) -> Result<ThreatId, CharacterError> {
        threat.check(self.now)?;
        if let Some(target) = threat.target {
            self.kind(target)?;
        }
        let id = ThreatId(self.next_threat);
        self.next_threat += 1;
        self.threats.push(KnownThreat {
            id,
            version: 0,
            threat,
            limb: None,
        });
        Ok(id)
    }

    /// Replaces a threat, for example after a new observation. A target that no longer exists is allowed; no character then avoids the threat.
    ///
    /// # Errors
    /// An unknown threat; a number that is not finite or out of range.
    pub fn update(&mut self, id: ThreatId, threat: Threat) -> Result<(), CharacterError> {
        threat.check(self.now)?;
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

    /// The present and announced threats, by id, without the limbs of characters that strike.
    pub fn threats(&self) -> impl Iterator<Item = (ThreatId, &Threat)> {
        let given = self.threats.iter().filter(|known| known.limb.is_none());
        given.map(|known| (known.id, &known.threat))
    }

    /// Advances time by `dt` seconds: plans, steers, and measures how near threats come. Events are appended to `events`, by character. A
    /// negative or infinite `dt` counts as 0, and one above a second as one second, so that a paused game continues smoothly.
    ///
    /// `obstacles` are given at their current positions; no character enters them. Pass every obstacle within 10 m of a character, plus the distance that a moving
    /// one covers within the horizon.
    pub fn step(&mut self, dt: f32, obstacles: &[Obstacle], events: &mut Vec<CharacterEvent>) {
        let _span = tracing::trace_span!("characters: step").entered();
        let dt = if dt.is_finite() {
            dt.clamp(0.0, LONGEST_STEP)
        } else {
            0.0
        };
        self.announce_strikes();
        self.bodies.clear();
        let avoids = |kind: &Kind| kind.settings.body_radius > 0.0;
        if self.kinds.iter().any(avoids) || self.strikes() {
            find_bodies(&self.kinds, &self.slots, &mut self.bodies);
        }
        let settings = &self.kinds[0].settings;
        let searches = settings.searches_per_step;
        share_searches(&self.kinds, &mut self.slots, dt, searches, &mut self.due);
        let mut reach = 0.0f32;
        let heights = self.slots.iter_mut().filter_map(|slot| {
            let slot = slot.get_mut().unwrap_or_else(PoisonError::into_inner);
            let (state, kind) = (slot.state.as_deref()?, slot.kind.of(&self.kinds));
            reach = reach.max(state.reach(&kind.baked));
            let (height, [low, high]) = (state.height, kind.roots);
            Some([height + low, height + high])
        });
        let heights = heights.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], one| {
            [low.min(one[0]), high.max(one[1])]
        });
        self.flights.find(
            &self.threats,
            [self.now, f64::from(dt)],
            [heights[0] - MOVED, heights[1] + MOVED],
            reach,
        );
        let (kinds, slots, workers) = (&self.kinds, &self.slots, &self.workers);
        let world = |kind: KindId| {
            let kind = kind.of(kinds);
            World {
                baked: &kind.baked,
                settings: &kind.settings,
                steering: &kind.steering,
                threats: &self.threats,
                flights: &self.flights,
                obstacles,
                bodies: &self.bodies,
                now: self.now,
                dt,
            }
        };
        each(slots, workers, &mut self.pool, |index, slot, worker| {
            let (id, world) = (slot.id(index), world(slot.kind));
            let state = slot.state.as_deref_mut();
            slot.urgency = state.and_then(|state| state.begin(id, &world, worker));
            slot.is_unfinished &= slot.urgency.is_some();
        });
        most_urgent(slots, settings.plans_per_step, &mut self.urgent);
        let plan = |index: usize, slot: &mut Slot, worker: &mut Worker| {
            let _span = tracing::trace_span!("character: plan", character = index).entered();
            let (id, world) = (slot.id(index), world(slot.kind));
            let state = slot.state.as_deref_mut();
            state.is_none_or(|state| state.avoid(id, &world, worker))
        };
        let seconds = 1e-3 * settings.plan_milliseconds;
        each_urgent(slots, workers, &mut self.pool, &self.urgent, seconds, plan);
        each(slots, workers, &mut self.pool, |index, slot, worker| {
            let (id, world) = (slot.id(index), world(slot.kind));
            if let Some(state) = &mut slot.state {
                state.step(id, &world, worker, slot.may_search);
            }
        });
        self.now += f64::from(dt);
        for (index, slot) in self.slots.iter_mut().enumerate() {
            let slot = slot.get_mut().unwrap_or_else(PoisonError::into_inner);
            let character = slot.id(index);
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
            let end = known.threat.time + f64::from(known.threat.seconds);
            known.limb.is_some() || end + f64::from(dt) >= now
        };
        self.threats.retain(lasts);
    }

    /// Writes the joints of a character in the world to `joints`, which has the length of the skeleton.
    ///
    /// # Errors
    /// An unknown character; a buffer of another length.
    pub fn pose(
        &self,
        id: CharacterId,
        joints: &mut [JointTransform],
    ) -> Result<(), CharacterError> {
        let skeleton = self.baked_of(id)?.graph().skeleton();
        let (needed, found) = (skeleton.len(), joints.len());
        if found != needed {
            return Err(CharacterError::Joints { needed, found });
        }
        let free = self.workers.iter().find_map(|one| one.try_lock().ok());
        let mut worker = free.unwrap_or_else(|| lock(&self.workers[0]));
        let Worker {
            pose, joints: own, ..
        } = &mut *worker;
        self.local_pose(id, pose)?;
        forward_kinematics(skeleton, pose, own);
        joints.copy_from_slice(own);
        Ok(())
    }

    /// Writes the root in the world and the rotations of the joints relative to their parents.
    ///
    /// # Errors
    /// An unknown character.
    pub fn local_pose(&self, id: CharacterId, pose: &mut Pose) -> Result<(), CharacterError> {
        self.with_state(id, |kind, state| {
            let playing = &state.playing;
            playing
                .motion
                .sample(kind.baked.graph(), playing.seconds, pose);
            state.additive.apply(pose);
            pose.root.y += state.height;
        })
    }

    /// Position in the graph, for example to name the clip that is played. While a blend lasts, the pose differs from it.
    ///
    /// # Errors
    /// An unknown character.
    pub fn playhead(&self, id: CharacterId) -> Result<Playhead, CharacterError> {
        self.with_state(id, |kind, state| {
            let playing = &state.playing;
            playing.motion.playhead(kind.baked.graph(), playing.seconds)
        })
    }

    /// The character's frame: root on the ground, facing direction.
    ///
    /// # Errors
    /// An unknown character.
    pub fn place(&self, id: CharacterId) -> Result<Rigid2, CharacterError> {
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        self.local_pose(id, &mut pose)?;
        let baked = self.baked_of(id)?;
        forward_kinematics(baked.graph().skeleton(), &pose, &mut joints);
        Ok(baked.stance(&joints).placement)
    }

    /// Velocity of the root as it is played, in metres per second.
    ///
    /// # Errors
    /// An unknown character.
    pub fn velocity(&self, id: CharacterId) -> Result<Vec3, CharacterError> {
        self.with_state(id, |kind, state| state.velocity(&kind.baked))
    }

    fn threat_index(&self, id: ThreatId) -> Result<usize, CharacterError> {
        let found = self.threats.binary_search_by_key(&id, |known| known.id);
        let given = found.ok().filter(|&at| self.threats[at].limb.is_none());
        given.ok_or(CharacterError::NoSuchThreat(id))
    }

    fn slot_mut(&mut self, index: u32) -> &mut Slot {
        let slot = self.slots[index as usize].get_mut();
        slot.unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn known_kind(&self, kind: KindId) -> Result<&Kind, CharacterError> {
        let known = self.kinds.get(usize::from(kind.0));
        known.ok_or(CharacterError::NoSuchKind(kind))
    }

    pub(super) fn character_mut(
        &mut self,
        id: CharacterId,
    ) -> Result<(&Kind, &mut CharacterState), CharacterError> {
        let slot = self.slots.get_mut(id.index as usize);
        let slot = slot.map(|slot| slot.get_mut().unwrap_or_else(PoisonError::into_inner));
        let slot = slot.filter(|slot| slot.generation == id.generation);
        let slot = slot.ok_or_else(|| unknown(id))?;
        let state = slot.state.as_deref_mut().ok_or_else(|| unknown(id))?;
        Ok((slot.kind.of(&self.kinds), state))
    }

    pub(super) fn with_state<T>(
        &self,
        id: CharacterId,
        read: impl FnOnce(&Kind, &CharacterState) -> T,
    ) -> Result<T, CharacterError> {
        let slot = self.slots.get(id.index as usize).map(lock);
        let slot = slot.filter(|slot| slot.generation == id.generation);
        let slot = slot.ok_or_else(|| unknown(id))?;
        let state = slot.state.as_deref().ok_or_else(|| unknown(id))?;
        Ok(read(slot.kind.of(&self.kinds), state))
    }
}

fn unknown(id: CharacterId) -> CharacterError {
    let CharacterId { index, generation } = id;
    CharacterError::NoSuchCharacter { index, generation }
}

fn check_rotation(rotation: Quat) -> Result<(), CharacterError> {
    let squared = rotation.length_squared();
    within("the squared length of a rotation", squared, 0.9998..=1.0002)
}

/// Refuses poses of another number of joints than `needed`, and those that no body has.
fn check_pose(needed: usize, pose: &Pose) -> Result<(), CharacterError> {
    let translations = match pose.translations.len() {
        0 => needed,
        count => count,
    };
    for found in [pose.rotations.len(), translations] {
        if found != needed {
            return Err(CharacterError::Joints { needed, found });
        }
    }
    let root = "the distance of a pose's root from the origin";
    shorter(root, pose.root, FURTHEST)?;
    for rotation in &pose.rotations {
        check_rotation(*rotation)?;
    }
    for place in &pose.translations {
        shorter("the distance of a joint from its parent", *place, FURTHEST)?;
    }
    Ok(())
}
