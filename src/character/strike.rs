//! Strikes: a character plays an attack of the clips, and its limb is a threat to all others.
//!
//! The limb is posed once, when the strike is announced, from the motion that the character plays: blend and all. What moves the character
//! later (obstacles, the host) moves the limb with it; a strike that is broken off is no threat any more.

use glam::{Vec2, Vec3, Vec3Swizzles};
use serde::{Deserialize, Serialize};

use super::characters::Characters;
use super::error::CharacterError;
use super::event::{CharacterEventKind, CharacterId, ThreatId};
use super::goal::{Aim, Goal, StrikeAt};
use super::kind::KindId;
use super::state::CharacterState;
use super::steer::{SteerStep, StrikeTable, Target, Times};
use super::threat::{Threat, Window};
use super::world::{KnownThreat, OtherBody, Worker, World};
use crate::graph::MotionGraph;
use crate::maps::{BakedGraph, SphereKey};
use crate::math::parallel::lock;
use crate::math::{Rigid2, Sphere};
use crate::query::Attack;

/// Poses of a limb per second.
const RATE: f32 = 120.0;

/// Speed at which a character comes into reach, in metres per second.
const APPROACH: f32 = 1.4;

/// An attack that a character plays.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Strike {
    /// Index of the attack.
    pub attack: u32,
    /// Time of the game at which the attack begins, in seconds. The character comes into it before.
    pub from: f64,
    /// Time of the game at which the limb has reached furthest, in seconds.
    pub contact: f64,
    /// Time of the game at which the attack has ended, in seconds.
    pub until: f64,
    /// The limb as a threat, once it is announced.
    pub threat: Option<ThreatId>,
}

/// The spheres of a striking limb, from the start of the attack on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Limb {
    /// The character that strikes.
    pub by: CharacterId,
    radii: Vec<f32>,
    /// Centres of all spheres at each time, in the world, in metres.
    centres: Vec<Vec3>,
    /// Time between two of these times, in seconds.
    step: f32,
    /// Place and ground of the motion that it was posed from.
    place: Rigid2,
    height: f32,
}

impl Limb {
    fn empty(by: CharacterId) -> Self {
        Self {
            by,
            radii: Vec::new(),
            centres: Vec::new(),
            step: 0.0,
            place: Rigid2::IDENTITY,
            height: 0.0,
        }
    }

    /// A sphere of it at a time since its start, in seconds.
    fn sphere(&self, index: usize, seconds: f32) -> Sphere {
        let at = (seconds / self.step).clamp(0.0, (self.times() - 1) as f32);
        let before = (at as usize).min(self.times().saturating_sub(2));
        let centre = |time: usize| self.centres[time * self.radii.len() + index];
        let share = at - before as f32;
        Sphere::new(
            centre(before).lerp(centre(before + 1), share),
            self.radii[index],
        )
    }

    /// Number of times at which it is posed, at least 2.
    fn times(&self) -> usize {
        self.centres.len() / self.radii.len().max(1)
    }

    /// Whether it is one that a strike leads to, with a threat around it.
    pub(super) fn is_sound(&self, threat: &Threat) -> bool {
        let lasts = (self.times().saturating_sub(1)) as f32 * self.step;
        let is_whole = self.times() * self.radii.len() == self.centres.len();
        let is_near = |centre: &Vec3| threat.position.distance(*centre) <= 50.0;
        let is_placed = self.place.is_sound(1e7) && self.height.is_finite();
        self.times() >= 2
            && is_whole
            && self.step > 1e-4
            && (lasts - threat.seconds).abs() < 1e-2
            && self
                .radii
                .iter()
                .all(|radius| (1e-6..=50.0).contains(radius))
            && self.centres.iter().all(is_near)
            && is_placed
    }
}

impl KnownThreat {
    fn empty(id: ThreatId) -> Self {
        Self {
            id,
            version: 0,
            threat: Threat::ball(0.0, Vec3::ZERO, Vec3::ZERO, 1.0),
            limb: None,
        }
    }

    /// Whether a character has to avoid it.
    pub(super) fn is_for(&self, id: CharacterId) -> bool {
        match &self.limb {
            Some(limb) => limb.by != id,
            None => self.threat.is_for(id),
        }
    }

    /// Number of its spheres.
    pub(super) fn spheres(&self) -> usize {
        let limb = self.limb.as_ref().map(|limb| limb.radii.len());
        limb.unwrap_or(self.threat.spheres.len())
    }

    /// One of its spheres at a time of the game, in the world.
    pub(super) fn sphere(&self, index: usize, time: f64) -> Sphere {
        match &self.limb {
            Some(limb) => limb.sphere(index, (time - self.threat.time) as f32),
            None => {
                let sphere = &self.threat.spheres[index];
                Sphere::new(self.threat.at(time) + sphere.centre, sphere.radius)
            }
        }
    }

    /// [`Threat::has_passed`]; a limb has when it ends.
    pub(super) fn has_passed(&self, time: f64, point: Vec3) -> bool {
        match &self.limb {
            Some(_) => time >= self.threat.time + f64::from(self.threat.seconds),
            None => self.threat.has_passed(time, point),
        }
    }

    /// [`Threat::window`].
    pub(super) fn window(&self, from: f64, body: Sphere) -> Option<Window> {
        let Some(limb) = &self.limb else {
            return self.threat.window(from, body);
        };
        // The threat is a ball around all of the limb's way.
        let around = self.threat.window(from, body)?;
        let first = (self.threat.time - from).max(0.0) as f32;
        let end = (self.threat.time + f64::from(self.threat.seconds) - from) as f32;
        let since = (from - self.threat.time) as f32;
        let begun = ((first + since) / limb.step).max(0.0) as usize;
        let (mut nearest, mut metres) = (first, f32::INFINITY);
        for time in begun..limb.times() {
            let at = limb.centres[time * limb.radii.len()..]
                .iter()
                .zip(&limb.radii);
            let apart = at.map(|(centre, radius)| centre.distance(body.centre) - radius);
            let apart = apart.fold(f32::INFINITY, f32::min);
            if apart < metres {
                metres = apart;
                nearest = (time as f32 * limb.step - since).clamp(first, end);
            }
        }
        (metres <= body.radius + Window::ROOM).then_some(Window {
            start: first,
            nearest,
            end,
            metres,
            ..around
        })
    }

    /// [`Threat::add_to`].
    pub(super) fn add_to(&self, out: &mut Attack, window: &Window, height: f32, margin: f32) {
        let Some(limb) = &self.limb else {
            self.threat.add_to(out, window, height, margin);
            return;
        };
        /// Shortest time between two keys, in seconds.
        const APART: f32 = 1e-4;
        let since = (window.from - self.threat.time) as f32;
        for index in 0..limb.radii.len() {
            let key = |t: f32| {
                let sphere = limb.sphere(index, since + t);
                SphereKey {
                    t,
                    center: sphere.centre - Vec3::Y * height,
                    radius: sphere.radius + margin,
                }
            };
            let times = (0..limb.times()).map(|time| time as f32 * limb.step - since);
            let between = times.filter(|&t| t > window.start + APART && t < window.end - APART);
            let ends = [window.start, window.end].map(key);
            let [first, last] = ends.map(std::iter::once);
            out.push(first.chain(between.map(key)).chain(last));
        }
    }

    /// Moves a limb with the character that strikes.
    fn follow(&mut self, state: &CharacterState, graph: &MotionGraph) {
        let (Some(limb), place) = (&mut self.limb, state.clip_to_world(graph)) else {
            return;
        };
        if limb.place == place && limb.height == state.height {
            return;
        }
        let by = place * limb.place.inverse();
        let up = Vec3::Y * (state.height - limb.height);
        for centre in limb.centres.iter_mut().chain([&mut self.threat.position]) {
            *centre = by.point(*centre) + up;
        }
        (limb.place, limb.height) = (place, state.height);
        self.version = self.version.wrapping_add(1);
    }

    /// Poses the limb of a character that strikes, in the memory of an earlier one.
    pub(super) fn pose_limb(
        &mut self,
        (by, state): (CharacterId, &CharacterState),
        world: (&BakedGraph, &StrikeTable),
        now: f64,
        worker: &mut Worker,
    ) {
        let (Some(strike), (baked, strikes)) = (&state.strike, world) else {
            return;
        };
        let spheres = strikes.limb(strike.attack);
        // What is over of the attack is no threat.
        let from = strike.from.max(now);
        let seconds = (strike.until - from) as f32;
        let steps = (seconds * RATE).ceil().max(1.0);
        let mut limb = self.limb.take().unwrap_or_else(|| Limb::empty(by));
        limb.by = by;
        limb.step = seconds / steps;
        (limb.place, limb.height) = (state.clip_to_world(baked.graph()), state.height);
        limb.radii.clear();
        limb.radii
            .extend(spheres.iter().map(|sphere| sphere.radius));
        limb.centres.clear();
        let playing = &state.playing;
        for step in 0..=steps as usize {
            let later = (from - now) as f32 + step as f32 * limb.step;
            worker.pose_body(
                baked,
                playing
                    .motion
                    .moment_at(playing.seconds + later * playing.rate),
                &state.additive,
            );
            let centres = spheres.iter().map(|sphere| sphere.centre(&worker.joints));
            limb.centres
                .extend(centres.map(|centre| centre + Vec3::Y * state.height));
        }
        let sum: Vec3 = limb.centres.iter().sum();
        let middle = sum / limb.centres.len().max(1) as f32;
        let reach = limb.centres.iter().map(|centre| centre.distance(middle));
        let widest = limb.radii.iter().copied().fold(1e-6, f32::max);
        let threat = &mut self.threat;
        (threat.time, threat.seconds) = (from, seconds);
        (threat.position, threat.velocity, threat.gravity) = (middle, Vec3::ZERO, 0.0);
        threat.spheres.clear();
        let radius = reach.fold(0.0, f32::max) + widest;
        threat.spheres.push(Sphere::new(Vec3::ZERO, radius));
        self.limb = Some(limb);
    }
}

impl Characters {
    /// Lets the limbs of strikes follow their characters, removes those of strikes that are over, and announces new ones.
    pub(super) fn announce_strikes(&mut self) {
        /// What is left of a strike is announced if it lasts longer, in seconds.
        const SHORTEST: f64 = 0.02;
        let now = self.now;
        for index in (0..self.threats.len()).rev() {
            let known = &mut self.threats[index];
            let Some(by) = known.limb.as_ref().map(|limb| limb.by) else {
                continue;
            };
            let slot = self.slots.get(by.index as usize).map(lock);
            let slot = slot.filter(|slot| slot.generation == by.generation);
            let state = slot
                .as_ref()
                .and_then(|slot| Some((slot.kind, slot.state.as_deref()?)));
            let is_on = |(_, state): &(KindId, &CharacterState)| {
                let strike = state.strike.as_ref();
                strike.is_some_and(|strike| strike.threat == Some(known.id))
            };
            match state.filter(is_on) {
                Some((kind, state)) => {
                    let kind = kind.of(&self.kinds);
                    known.follow(state, kind.baked.graph());
                }
                None => self.unused_limbs.push(self.threats.remove(index)),
            }
        }
        for (index, slot) in self.slots.iter().enumerate() {
            let mut slot = lock(slot);
            let by = slot.id(index);
            let kind = slot.kind.of(&self.kinds);
            let Some(state) = slot.state.as_deref_mut() else {
                continue;
            };
            let is_new = |strike: &Strike| strike.threat.is_none() && strike.until > now + SHORTEST;
            let Some(strike) = state.strike.filter(is_new) else {
                continue;
            };
            let id = ThreatId(self.next_threat);
            self.next_threat += 1;
            let known = self.unused_limbs.pop();
            let mut known = known.unwrap_or_else(|| KnownThreat::empty(id));
            (known.id, known.version) = (id, 0);
            let strikes = &kind.steering.strikes;
            let worker = &mut lock(&self.workers[0]);
            known.pose_limb((by, state), (&kind.baked, strikes), now, worker);
            self.threats.push(known);
            state.strike = Some(Strike {
                threat: Some(id),
                ..strike
            });
            let edge = strikes.edge(strike.attack);
            state.events.extend(edge.map(|attack| {
                let strikes = CharacterEventKind::Strikes {
                    threat: id,
                    attack,
                    contact: strike.contact,
                };
                (now, strikes)
            }));
        }
    }

    /// Whether any character's goal is to strike.
    pub(super) fn strikes(&self) -> bool {
        self.slots.iter().any(|slot| {
            let slot = lock(slot);
            let goal = slot.state.as_deref().map(|state| state.goal);
            matches!(goal, Some(Goal::Strike { .. }))
        })
    }

    /// Times of the game at which the attack of a strike begins and ends, in seconds. `threat` is that of [`CharacterEventKind::Strikes`].
    ///
    /// # Errors
    /// A threat that is no limb, or no longer.
    pub fn limb_times(&self, threat: ThreatId) -> Result<[f64; 2], CharacterError> {
        let threat = &self.known_limb(threat)?.threat;
        Ok([threat.time, threat.time + f64::from(threat.seconds)])
    }

    /// Writes the spheres of a striking limb at a time of the game, in the world; before the attack where it begins, and after it where it ends.
    ///
    /// # Errors
    /// A threat that is no limb, or no longer.
    pub fn limb(
        &self,
        threat: ThreatId,
        time: f64,
        out: &mut Vec<Sphere>,
    ) -> Result<(), CharacterError> {
        let known = self.known_limb(threat)?;
        out.clear();
        out.extend((0..known.spheres()).map(|index| known.sphere(index, time)));
        Ok(())
    }

    fn known_limb(&self, threat: ThreatId) -> Result<&KnownThreat, CharacterError> {
        let known = self.threats.iter().find(|known| known.id == threat);
        let known = known.filter(|known| known.limb.is_some());
        known.ok_or(CharacterError::NoSuchThreat(threat))
    }
}

impl CharacterState {
    /// What its goal strikes, if that exists.
    fn target(&self, world: &World<'_>) -> Option<Target> {
        /// Where the trunk begins and ends, in parts of the root's height.
        const TRUNK: [f32; 2] = [0.85, 1.55];
        let Goal::Strike { at, .. } = self.goal else {
            return None;
        };
        match at {
            StrikeAt::Place(place) => Some(Target {
                place: place.xz(),
                heights: [place.y - self.height; 2],
                velocity: Vec2::ZERO,
            }),
            StrikeAt::Character(id) => {
                let bodies = world.bodies;
                let found = bodies.binary_search_by_key(&id, |body| body.id);
                let body: &OtherBody = bodies.get(found.ok()?)?;
                Some(Target {
                    place: body.place,
                    heights: TRUNK.map(|part| part * body.root + body.height - self.height),
                    velocity: body.velocity,
                })
            }
        }
    }

    /// Aim of a character that comes into reach of what its goal strikes, and whether that is near. What is near is not gone around.
    pub(super) fn aim_to_strike(&self, world: &World<'_>) -> (Aim, bool) {
        /// In metres.
        const NEAR: f32 = 1.5;
        let target = self.target(world);
        let Some((target, reach)) = target.zip(self.reach) else {
            return (Aim::default(), true);
        };
        let place = self.playing.ground(world.baked.graph());
        let is_near = place.distance(target.place) < reach.distance + NEAR;
        (reach.aim(place, target.place, APPROACH), is_near)
    }

    /// Begins a strike if its goal is one, and an attack reaches. Returns whether it did.
    pub(super) fn begin_strike(&mut self, world: &World<'_>, worker: &mut Worker) -> bool {
        let Goal::Strike { kind, .. } = self.goal else {
            return false;
        };
        let Some(target) = self.target(world) else {
            self.reach = None;
            return false;
        };
        /// A blend of the body is not cut before, in seconds: the pushes of both would add up.
        const BLENDED: f32 = 0.2;
        let playing = &self.playing;
        let age = playing.motion.blend_age(playing.seconds);
        let blends = playing.motion.is_blending_body(playing.seconds);
        if blends && age.is_some_and(|age| age < BLENDED) {
            return false;
        }
        let step = SteerStep {
            baked: world.baked,
            settings: &world.settings.steer,
            aim: Aim::default(),
            may_search: true,
            dt: world.dt,
        };
        let memory = (&self.struck, &mut self.reach);
        let (playing, scratch) = (&mut self.playing, &mut worker.steer);
        let begun = world
            .steering
            .strike(&step, (&target, kind), memory, playing, scratch);
        let Some(begun) = begun else {
            return false;
        };
        let Times {
            start,
            contact,
            end,
        } = begun.seconds;
        // The rate stays what it is.
        let rate = self.playing.rate;
        let at = |seconds: f32| world.now + f64::from(seconds / rate);
        let motion = &mut self.playing.motion;
        motion.extend(world.baked.graph(), end + 0.1);
        self.strike = Some(Strike {
            attack: begun.attack,
            from: at(start),
            contact: at(contact),
            until: at(end),
            threat: None,
        });
        self.struck.rotate_right(1);
        self.struck[0] = begun.attack;
        // Another motion is tested at once.
        self.retry_at = self.retry_at.map(|_| world.now);
        true
    }

    /// Ends a strike. `is_whole` says whether the attack was played to its end.
    pub(super) fn end_strike(&mut self, now: f64, is_whole: bool) {
        if self.strike.take().is_some() {
            let ended = CharacterEventKind::StrikeEnded { is_whole };
            self.events.push((now, ended));
        }
    }

    fn clip_to_world(&self, graph: &MotionGraph) -> Rigid2 {
        let playing = &self.playing;
        playing
            .motion
            .playhead(graph, playing.seconds)
            .clip_to_world
    }
}
