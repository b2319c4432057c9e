//! Measures how near threats come to a body, and reports hits and misses.
//!
//! Body and threat are assumed to move straight from the start of a step to its end. The flight of a falling threat is cut into short pieces.

use glam::{Vec3, Vec3Swizzles};

use super::event::{CharacterEventKind, CharacterId, ThreatId};
use super::state::{CharacterState, Watched};
use super::threat::Threat;
use super::world::{KnownThreat, Worker, World};
use crate::query::clearance::closest;

/// The part of a step in which a threat exists.
struct Pass<'a> {
    known: &'a KnownThreat,
    /// Start, as a time of the game, in seconds.
    start: f64,
    /// End, in seconds.
    end: f64,
}

impl<'a> Pass<'a> {
    fn new(known: &'a KnownThreat, world: &World<'_>) -> Option<Self> {
        let threat = &known.threat;
        let start = world.now.max(threat.time);
        let end = world.end().min(threat.time + f64::from(threat.seconds));
        // A limb that begins at the end of a step has no speed in it.
        let begins_later = known.limb.is_some() && start == end;
        (start <= end && !begins_later).then_some(Self { known, start, end })
    }

    /// Whether the threat may touch a body whose root is at `root` at one end of the step, and which reaches `reach` metres far.
    fn comes_near(&self, root: Vec3, reach: f32, world: &World<'_>) -> bool {
        let threat = &self.known.threat;
        let apart = [self.start, self.end].map(|time| threat.at(time) - root);
        let reach = reach + threat.radius();
        closest(apart, [reach; 2]).1 < range_in_step(threat, world.dt)
    }

    /// Intervals in which the threat moves nearly in a straight line, in seconds.
    fn pieces(&self) -> impl Iterator<Item = [f64; 2]> + use<'_> {
        /// Duration of a piece of a curved flight, in seconds.
        const PIECE: f64 = 0.02;
        let count = match self.known.threat.gravity {
            0.0 if self.known.limb.is_none() => 1.0,
            _ => ((self.end - self.start) / PIECE).ceil().max(1.0),
        };
        let at = move |index: f64| self.start + (self.end - self.start) * index / count;
        (0..count as u32).map(move |index| [at(f64::from(index)), at(f64::from(index + 1))])
    }
}

/// How near the straight line between the places of a threat at both ends of a step may come to what a body reaches, so that they may touch, in metres.
pub(super) fn range_in_step(threat: &Threat, dt: f32) -> f32 {
    /// Maximum speed of a root, in metres per second.
    const FASTEST: f32 = 12.0;
    const RESERVE: f32 = 0.3;
    // Largest distance of a flight from the line between its ends.
    let bulge = 0.125 * threat.gravity.abs() * dt * dt;
    RESERVE + FASTEST * dt + bulge
}

impl CharacterState {
    /// Poses the body at the start of a step in which the first threat comes near.
    pub(super) fn look_out(&mut self, id: CharacterId, world: &World<'_>, worker: &mut Worker) {
        let is_new = self.centres.is_empty() && !world.threats.is_empty();
        if is_new && self.has_to_measure(id, world, &mut worker.threats) {
            self.pose_centres(world, worker);
            self.centres.clone_from(&worker.centres);
        }
    }

    /// Measures how near the threats came in this step, and reports which touched the body and which have passed.
    pub(super) fn watch(&mut self, id: CharacterId, world: &World<'_>, worker: &mut Worker) {
        if world.threats.is_empty() {
            self.watched.clear();
            self.centres.clear();
            return;
        }
        let later = World {
            now: world.end(),
            ..*world
        };
        self.find_passing(world, &mut worker.threats);
        for known in world.threats_of(id, &worker.threats) {
            let is_watched = self.watched.iter().any(|one| one.id == known.id);
            if !is_watched && self.window(&later, later.now, known).is_some() {
                self.watch_for(known.id);
            }
        }
        match self.has_to_measure(id, world, &mut worker.threats) {
            true => self.measure(id, world, worker),
            false => self.centres.clear(),
        }
        self.report_passed(id, &later);
    }

    /// Lists the threats that come near the body, and those that are watched.
    fn find_passing(&self, world: &World<'_>, out: &mut Vec<u32>) {
        world.flights.near(self.root(world).xz(), out);
        let watched = self.watched.iter();
        let watched = watched.filter_map(|one| world.threat_index(one.id));
        out.extend(watched.map(|index| index as u32));
        out.sort_unstable();
        out.dedup();
    }

    /// Those of the threats that exist in this step.
    fn passes<'w, 'l>(
        id: CharacterId,
        world: &'l World<'w>,
        threats: &'l [u32],
    ) -> impl Iterator<Item = Pass<'w>> + use<'w, 'l> {
        let threats = world.threats_of(id, threats);
        threats.filter_map(|known| Pass::new(known, world))
    }

    /// Whether anything has to be measured in this step. Lists the threats for it.
    fn has_to_measure(&self, id: CharacterId, world: &World<'_>, threats: &mut Vec<u32>) -> bool {
        self.find_passing(world, threats);
        let root = self.root(world);
        Self::passes(id, world, threats).any(|pass| self.has_to_be_measured(&pass, root, world))
    }

    /// Whether a threat may touch the body in this step, or passes at a distance that is not measured yet.
    fn has_to_be_measured(&self, pass: &Pass<'_>, root: Vec3, world: &World<'_>) -> bool {
        pass.comes_near(root, self.reach(world.baked), world) || self.is_missed(pass, root, world)
    }

    /// Whether a threat that is watched passes without having come near.
    fn is_missed(&self, pass: &Pass<'_>, root: Vec3, world: &World<'_>) -> bool {
        let id = pass.known.id;
        let is_unmeasured = |one: &Watched| one.id == id && one.metres == f32::MAX;
        self.watched.iter().any(is_unmeasured) && pass.known.has_passed(world.end(), root)
    }

    fn watch_for(&mut self, id: ThreatId) -> &mut Watched {
        let place = self.watched.iter().position(|one| one.id == id);
        let place = place.unwrap_or_else(|| {
            self.watched.push(Watched {
                id,
                metres: f32::MAX,
                is_hit: false,
                is_missed: false,
            });
            self.watched.len() - 1
        });
        &mut self.watched[place]
    }

    fn root(&self, world: &World<'_>) -> Vec3 {
        let playing = &self.playing;
        let root = playing.motion.root(world.baked.graph(), playing.seconds);
        root + Vec3::Y * self.height
    }

    fn pose_centres(&self, world: &World<'_>, worker: &mut Worker) {
        let playing = &self.playing;
        worker.pose_body(
            world.baked,
            playing.motion.moment_at(playing.seconds),
            &self.additive,
        );
    }

    /// Measures the distance of body and threats between the start and the end of the step.
    fn measure(&mut self, id: CharacterId, world: &World<'_>, worker: &mut Worker) {
        self.pose_centres(world, worker);
        if self.centres.len() != worker.centres.len() {
            self.centres.clone_from(&worker.centres);
        }
        let root = self.root(world);
        for pass in Self::passes(id, world, &worker.threats) {
            if !self.has_to_be_measured(&pass, root, world) {
                continue;
            }
            let body = [&self.centres[..], &worker.centres[..]];
            let nearest = pass.nearest(world, body, self.height);
            let watched = self.watch_for(pass.known.id);
            watched.metres = watched.metres.min(nearest.metres);
            if nearest.metres < 0.0 && !watched.is_hit {
                watched.is_hit = true;
                let part = &world.baked.body().spheres[nearest.part];
                let normal = nearest.apart.try_normalize();
                let normal = normal.unwrap_or(-pass.known.threat.velocity);
                let normal = normal.normalize_or(Vec3::Y);
                let (threat, joint) = (pass.known.id, part.joint);
                let point = nearest.centre + normal * part.radius + Vec3::Y * self.height;
                let hit = match &pass.known.limb {
                    Some(limb) => CharacterEventKind::Struck {
                        by: limb.by,
                        threat,
                        joint,
                        point,
                        depth: -nearest.metres,
                        speed: nearest.speed,
                    },
                    None => CharacterEventKind::Hit {
                        threat,
                        joint,
                        point,
                        depth: -nearest.metres,
                        normal,
                    },
                };
                self.events.push((world.end(), hit));
            }
        }
        self.centres.clone_from(&worker.centres);
    }

    /// Stops watching threats that have ended, and reports once how near a miss came.
    fn report_passed(&mut self, me: CharacterId, later: &World<'_>) {
        let root = self.root(later);
        let mut place = 0;
        while let Some(&watched) = self.watched.get(place) {
            let Watched {
                id, metres, is_hit, ..
            } = watched;
            let index = later.threat_index(id).map(|index| index as u32);
            let known = later.threats_of(me, index.as_slice()).next();
            if known.is_none() {
                self.watched.swap_remove(place);
                continue;
            }
            let is_near = known.is_some_and(|known| {
                let window = self.window(later, later.now, known);
                window.is_some() || !known.has_passed(later.now, root)
            });
            if !is_near && !is_hit && !watched.is_missed && metres < f32::MAX {
                self.watched[place].is_missed = true;
                let missed = CharacterEventKind::MissedBy { threat: id, metres };
                self.events.push((later.now, missed));
            }
            place += 1;
        }
    }
}

impl Pass<'_> {
    /// Where it is nearest to a body whose sphere centres are given at the start and at the end of the step, above a ground at a height.
    fn nearest(&self, world: &World<'_>, [before, after]: [&[Vec3]; 2], height: f32) -> Contact {
        let ground = Vec3::Y * height;
        let share = |time: f64| match world.dt > 0.0 {
            true => ((time - world.now) as f32 / world.dt).clamp(0.0, 1.0),
            false => 1.0,
        };
        let mut nearest = Contact {
            metres: f32::INFINITY,
            part: 0,
            centre: Vec3::ZERO,
            apart: Vec3::ZERO,
            speed: 0.0,
        };
        for times in self.pieces() {
            let shares = times.map(share);
            for index in 0..self.known.spheres() {
                let [from, to] = times.map(|time| self.known.sphere(index, time));
                let places = [from, to].map(|sphere| sphere.centre - ground);
                let radius = from.radius;
                let ends = before.iter().zip(after).zip(&world.baked.body().spheres);
                for (part, ((from, to), body)) in ends.enumerate() {
                    let centres = shares.map(|share| from.lerp(*to, share));
                    let apart = [0, 1].map(|end| places[end] - centres[end]);
                    let (at, metres) = closest(apart, [radius + body.radius; 2]);
                    if metres < nearest.metres {
                        nearest = Contact {
                            metres,
                            part,
                            centre: centres[0].lerp(centres[1], at),
                            apart: apart[0].lerp(apart[1], at),
                            speed: apart[0].distance(apart[1])
                                / ((times[1] - times[0]) as f32).max(1e-6),
                        };
                    }
                }
            }
        }
        nearest
    }
}

/// The moment in which a threat is nearest to a body.
struct Contact {
    /// Distance of the surfaces, in metres; negative for a hit.
    metres: f32,
    /// Index of the body's sphere.
    part: usize,
    /// Its centre.
    centre: Vec3,
    /// Way from there to the centre of the threat's sphere.
    apart: Vec3,
    /// Speed of the one relative to the other, in metres per second.
    speed: f32,
}
