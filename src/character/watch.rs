//! Measures how near threats come to a body, and reports hits and misses.
//!
//! Body and threat are assumed to move straight from the start of a step to its end. The flight of a falling threat is cut into short pieces.

use glam::Vec3;

use super::event::{CharacterEventKind, CharacterId, ThreatId};
use super::state::{CharacterState, Watched};
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
        (start <= end).then_some(Self { known, start, end })
    }

    /// Whether the threat may touch a body whose root is at `root` at one end of the step.
    fn comes_near(&self, root: Vec3, world: &World<'_>) -> bool {
        /// Maximum speed of a root, in metres per second.
        const FASTEST: f32 = 12.0;
        const RESERVE: f32 = 0.3;
        let threat = &self.known.threat;
        let apart = [self.start, self.end].map(|time| threat.at(time) - root);
        // Largest distance of a flight from the line between its ends.
        let bulge = 0.125 * threat.gravity.abs() * world.dt * world.dt;
        let reach = world.baked.reach() + threat.radius();
        closest(apart, [reach; 2]).1 < RESERVE + FASTEST * world.dt + bulge
    }

    /// Intervals in which the threat moves nearly in a straight line, in seconds.
    fn pieces(&self) -> impl Iterator<Item = [f64; 2]> + use<'_> {
        /// Duration of a piece of a curved flight, in seconds.
        const PIECE: f64 = 0.02;
        let count = match self.known.threat.gravity {
            0.0 => 1.0,
            _ => ((self.end - self.start) / PIECE).ceil().max(1.0),
        };
        let at = move |index: f64| self.start + (self.end - self.start) * index / count;
        (0..count as u32).map(move |index| [at(f64::from(index)), at(f64::from(index + 1))])
    }
}

impl CharacterState {
    /// Poses the body at the start of a step in which the first threat comes near.
    pub(super) fn look_out(&mut self, id: CharacterId, world: &World<'_>, worker: &mut Worker) {
        let is_new = self.centres.is_empty() && !world.threats.is_empty();
        if is_new && self.has_to_measure(id, world) {
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
        for known in world.threats_of(id) {
            let is_watched = self.watched.iter().any(|one| one.id == known.id);
            if !is_watched && self.window(&later, later.now, &known.threat).is_some() {
                self.watch_for(known.id);
            }
        }
        match self.has_to_measure(id, world) {
            true => self.measure(id, world, worker),
            false => self.centres.clear(),
        }
        self.report_passed(id, &later);
    }

    /// The threats that exist in this step.
    fn passes<'w>(id: CharacterId, world: &'w World<'_>) -> impl Iterator<Item = Pass<'w>> {
        let threats = world.threats_of(id);
        threats.filter_map(|known| Pass::new(known, world))
    }

    /// Whether anything has to be measured in this step.
    fn has_to_measure(&self, id: CharacterId, world: &World<'_>) -> bool {
        let root = self.root(world);
        Self::passes(id, world).any(|pass| self.has_to_be_measured(&pass, root, world))
    }

    /// Whether a threat may touch the body in this step, or passes at a distance that is not measured yet.
    fn has_to_be_measured(&self, pass: &Pass<'_>, root: Vec3, world: &World<'_>) -> bool {
        pass.comes_near(root, world) || self.is_missed(pass, root, world)
    }

    /// Whether a threat that is watched passes without having come near.
    fn is_missed(&self, pass: &Pass<'_>, root: Vec3, world: &World<'_>) -> bool {
        let id = pass.known.id;
        let is_unmeasured = |one: &Watched| one.id == id && one.metres == f32::MAX;
        self.watched.iter().any(is_unmeasured) && pass.known.threat.has_passed(world.end(), root)
    }

    fn watch_for(&mut self, id: ThreatId) -> &mut Watched {
        let place = self.watched.iter().position(|one| one.id == id);
        let place = place.unwrap_or_else(|| {
            self.watched.push(Watched {
                id,
                metres: f32::MAX,
                is_hit: false,
            });
            self.watched.len() - 1
        });
        &mut self.watched[place]
    }

    fn root(&self, world: &World<'_>) -> Vec3 {
        let playing = &self.playing;
        playing.motion.root(world.baked.graph(), playing.seconds)
    }

    fn pose_centres(&self, world: &World<'_>, worker: &mut Worker) {
        let playing = &self.playing;
        worker.pose_body(world.baked, playing.motion.moment_at(playing.seconds));
    }

    /// Measures the distance of body and threats between the start and the end of the step.
    fn measure(&mut self, id: CharacterId, world: &World<'_>, worker: &mut Worker) {
        self.pose_centres(world, worker);
        if self.centres.len() != worker.centres.len() {
            self.centres.clone_from(&worker.centres);
        }
        let root = self.root(world);
        for pass in Self::passes(id, world) {
            if !self.has_to_be_measured(&pass, root, world) {
                continue;
            }
            let body = [&self.centres[..], &worker.centres[..]];
            let metres = pass.distance(world, body);
            let watched = self.watch_for(pass.known.id);
            watched.metres = watched.metres.min(metres);
            if metres < 0.0 && !watched.is_hit {
                watched.is_hit = true;
                let threat = pass.known.id;
                self.events
                    .push((world.end(), CharacterEventKind::Hit { threat }));
            }
        }
        self.centres.clone_from(&worker.centres);
    }

    /// Stops watching threats that have ended or passed, and reports how near a miss came.
    fn report_passed(&mut self, me: CharacterId, later: &World<'_>) {
        let root = self.root(later);
        let mut place = 0;
        while let Some(&Watched { id, metres, is_hit }) = self.watched.get(place) {
            let known = later.threats_of(me).find(|known| known.id == id);
            let is_near = known.is_some_and(|known| {
                let window = self.window(later, later.now, &known.threat);
                window.is_some() || !known.threat.has_passed(later.now, root)
            });
            if is_near {
                place += 1;
                continue;
            }
            self.watched.swap_remove(place);
            if known.is_some() && !is_hit && metres < f32::MAX {
                let missed = CharacterEventKind::MissedBy { threat: id, metres };
                self.events.push((later.now, missed));
            }
        }
    }
}

impl Pass<'_> {
    /// Smallest distance from a body whose sphere centres are given at the start and at the end of the step, in metres; negative for a hit.
    fn distance(&self, world: &World<'_>, [before, after]: [&[Vec3]; 2]) -> f32 {
        let threat = &self.known.threat;
        let share = |time: f64| match world.dt > 0.0 {
            true => ((time - world.now) as f32 / world.dt).clamp(0.0, 1.0),
            false => 1.0,
        };
        let mut least = f32::INFINITY;
        for times in self.pieces() {
            let (places, shares) = (times.map(|time| threat.at(time)), times.map(share));
            for sphere in &threat.spheres {
                let ends = before.iter().zip(after).zip(&world.baked.body().spheres);
                for ((from, to), part) in ends {
                    let radii = sphere.radius + part.radius;
                    let apart =
                        [0, 1].map(|end| places[end] + sphere.centre - from.lerp(*to, shares[end]));
                    least = least.min(closest(apart, [radii; 2]).1);
                }
            }
        }
        least
    }
}
