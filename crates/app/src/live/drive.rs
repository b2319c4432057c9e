//! A character that is driven by keys in a room, among opponents who throw at it from all sides.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use sabaki::anim::JointTransform;
use sabaki::character::{
    CharacterError, CharacterEvent, CharacterEventKind, CharacterId, CharacterSettings, Characters,
    Goal, Threat, ThreatId,
};
use sabaki::internal::closest;
use sabaki::maps::BakedGraph;
use sabaki::math::{Rigid2, Sphere};
use sabaki::query::Obstacle;
use sabaki_draw::scene::{Camera, Capsule, Figure, Light, Look, Mesh, Outfit, Shot, SkinnedBody};

use super::Event;
use super::room::{HALF_SIDE, add_room, obstacles};
use super::sight_line::{FADED, SightLine};
use crate::play::PlayError;
use sabaki_fixtures::throw::generator;

const OPPONENTS: usize = 3;
/// Half of the width of an opponent, in metres.
const OPPONENT: f32 = 0.3;
/// Speeds of walking and running, in metres per second.
const SPEEDS: [f32; 2] = [1.4, 3.0];
/// Radius of a ball, in metres.
const BALL: f32 = 0.1;
/// Time between two throws, and from the announcement to the throw, in seconds.
const PAUSE: (f32, f32) = (1.8, 0.5);
/// Longest step of the simulation, in seconds.
const STEP: f32 = 1.0 / 60.0;

const FLYING: [f32; 4] = [0.85, 0.12, 0.08, 1.0];
const OTHERS: Vec3 = Vec3::new(0.30, 0.36, 0.62);

/// Results so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DriveScore {
    /// Number of balls that touched the body.
    pub hits: u32,
    /// Number of balls that passed without touching it.
    pub missed: u32,
    /// Smallest distance of the last ball that passed, in metres; 0 or less for a hit.
    pub last: Option<f32>,
    /// Smallest distance of all that missed, in metres.
    pub closest: Option<f32>,
}

/// A ball on its way.
struct Ball {
    number: u32,
    threat: Threat,
    /// Id of the threat, if the character knows of it.
    known: Option<ThreatId>,
    nearest: f32,
    pictures: u32,
}

/// The room, the driven character and its opponents.
pub struct Drive {
    /// Whether the character dodges by itself; otherwise when the key is pressed.
    pub dodges_alone: bool,
    characters: Characters,
    me: CharacterId,
    opponents: Vec<CharacterId>,
    obstacles: Vec<Obstacle>,
    figures: [Figure; 2],
    outfit: Option<Arc<Outfit>>,
    random: Pcg64Mcg,
    /// Keys that are down: forwards, backwards, left, right, run, turn left, turn right.
    held: [bool; 7],
    /// Direction of the camera on the ground (x, z).
    ahead: Vec2,
    /// Heading that the body keeps while it goes; `None` for that of its way.
    facing: Option<f32>,
    balls: Vec<Ball>,
    thrown: u32,
    next_throw: f64,
    score: DriveScore,
    /// The body's spheres at the end of the last step.
    centres: [Vec<Vec3>; 2],
    joints: Vec<JointTransform>,
    happened: Vec<CharacterEvent>,
    events: Vec<Event>,
    is_cornered: bool,
}

/// The keys that are held, in the order of [`Drive::held`].
const HELD: [&str; 7] = ["w", "s", "a", "d", "shift", "q", "e"];

impl Drive {
    /// A character in the middle of a room. `seed` determines the opponents.
    ///
    /// # Errors
    /// A graph in which nothing can be played.
    pub fn new(baked: &BakedGraph, seed: u64) -> Result<Self, PlayError> {
        let settings = CharacterSettings {
            body_radius: 0.3,
            ..CharacterSettings::default()
        };
        let (skeleton, body) = (baked.graph().skeleton(), baked.body());
        let figure = Figure::of(skeleton, body, &Look::default());
        let other = figure.clone().coloured(OTHERS);
        let mut characters = Characters::new(Arc::new(baked.clone()), settings)?;
        let me = characters.spawn(Rigid2::IDENTITY)?;
        let mut opponents = Vec::new();
        for index in 0..OPPONENTS {
            let place = Vec2::from_angle(0.6 + index as f32 * 2.1) * 4.0;
            let inward = Rigid2::facing(-place, place.x, place.y);
            opponents.push(characters.spawn(inward)?);
        }
        let obstacles = obstacles()?;
        Ok(Self {
            dodges_alone: true,
            characters,
            me,
            opponents,
            obstacles,
            figures: [figure, other],
            outfit: None,
            random: generator(seed, 0),
            held: [false; 7],
            ahead: Vec2::Y,
            facing: None,
            balls: Vec::new(),
            thrown: 0,
            next_throw: 2.0,
            score: DriveScore::default(),
            centres: [Vec::new(), Vec::new()],
            joints: Vec::new(),
            happened: Vec::new(),
            events: Vec::new(),
            is_cornered: false,
        })
    }

    /// Presses or releases a key. Returns whether it is one of the room's.
    pub fn hold(&mut self, key: &str, is_down: bool) -> bool {
        if let Some(index) = HELD.iter().position(|held| *held == key) {
            self.held[index] = is_down;
            return true;
        }
        match key {
            "space" if is_down => self.dodge_now(),
            "f" if is_down => self.dodges_alone = !self.dodges_alone,
            "space" | "f" => {}
            _ => return false,
        }
        true
    }

    /// The direction in which the camera looks, in which the keys lead.
    pub fn look(&mut self, camera: &Camera) {
        let ahead = camera.target - camera.eye;
        self.ahead = Vec2::new(ahead.x, ahead.z).normalize_or(self.ahead);
    }

    /// Lets the character know of all balls that fly.
    fn dodge_now(&mut self) {
        for ball in &mut self.balls {
            if ball.known.is_none() {
                ball.known = self.characters.threaten(ball.threat.clone()).ok();
            }
        }
    }

    /// Lets time pass.
    ///
    /// # Errors
    /// Those of the characters.
    pub fn advance(&mut self, seconds: f32) -> Result<(), CharacterError> {
        let steps = (seconds / STEP).ceil().max(1.0);
        for _ in 0..steps as usize {
            self.step(seconds / steps)?;
        }
        Ok(())
    }

    fn step(&mut self, dt: f32) -> Result<(), CharacterError> {
        self.steer(dt)?;
        if self.characters.now() >= self.next_throw {
            self.throw()?;
        }
        let from = self.characters.now();
        self.happened.clear();
        let events = &mut self.happened;
        self.characters.step(dt, &self.obstacles, events);
        for event in &self.happened {
            if event.character == self.me {
                match event.kind {
                    CharacterEventKind::Cornered { .. } => self.is_cornered = true,
                    CharacterEventKind::Began => self.is_cornered = false,
                    _ => {}
                }
            }
        }
        self.measure(from)
    }

    fn steer(&mut self, dt: f32) -> Result<(), CharacterError> {
        /// Speed of turning, in radians per second.
        const TURN: f32 = 2.2;
        let axis = |positive: usize, negative: usize| {
            f32::from(u8::from(self.held[positive])) - f32::from(u8::from(self.held[negative]))
        };
        let (ahead, left, turn) = (axis(0, 1), axis(2, 3), axis(5, 6));
        let right = Vec2::new(-self.ahead.y, self.ahead.x);
        let way = (self.ahead * ahead - right * left).normalize_or_zero();
        if turn != 0.0 {
            let heading = match self.facing {
                Some(heading) => heading,
                None => self.characters.place(self.me)?.heading(),
            };
            self.facing = Some(heading + turn * TURN * dt);
        }
        let goal = match (way == Vec2::ZERO, self.facing) {
            (true, Some(heading)) => Goal::Face { heading },
            (true, None) => Goal::Idle,
            (false, _) => {
                if turn == 0.0 {
                    self.facing = None;
                }
                let velocity = way * SPEEDS[usize::from(self.held[4])];
                Goal::Walk {
                    velocity: Vec3::new(velocity.x, 0.0, velocity.y),
                    facing: self.facing,
                }
            }
        };
        self.characters.steer(self.me, goal)
    }

    /// One of the opponents throws, and goes elsewhere.
    fn throw(&mut self) -> Result<(), CharacterError> {
        self.thrown += 1;
        self.next_throw = self.characters.now() + f64::from(PAUSE.0);
        let mut between = |low: f32, high: f32| low + (high - low) * self.random.random::<f32>();
        let (speed, height) = (between(6.0, 10.0), between(-0.3, 0.6));
        let point = Vec3::new(between(-4.5, 4.5), 0.0, between(-4.5, 4.5));
        let thrower = self.opponents[self.thrown as usize % OPPONENTS];
        let root = |characters: &mut Characters, id, joints: &mut Vec<JointTransform>| {
            characters.pose(id, joints).map(|()| joints[0].translation)
        };
        let mut joints = self.joints_of_size();
        let from = root(&mut self.characters, thrower, &mut joints)? + Vec3::Y * 0.4;
        let mine = root(&mut self.characters, self.me, &mut joints)?;
        let flight = (mine.distance(from) / speed).max(0.3);
        let playing = self.characters.velocity(self.me)?;
        let target = mine + playing * (PAUSE.1 + flight) + Vec3::Y * height;
        let time = self.characters.now() + f64::from(PAUSE.1);
        let threat = Threat {
            seconds: flight + 1.0,
            target: Some(self.me),
            ..Threat::ball(time, from, (target - from) / flight, BALL)
        };
        let known = match self.dodges_alone {
            true => Some(self.characters.threaten(threat.clone())?),
            false => None,
        };
        self.events.push(Event::Throw {
            number: self.thrown,
            from: from.to_array(),
            target: target.to_array(),
            at_body: true,
            lead: PAUSE.1,
            speed,
            radius: BALL,
        });
        self.balls.push(Ball {
            number: self.thrown,
            threat,
            known,
            nearest: f32::INFINITY,
            pictures: 0,
        });
        let speed = 1.2;
        self.characters.steer(thrower, Goal::GoTo { point, speed })
    }

    fn joints_of_size(&self) -> Vec<JointTransform> {
        let count = self.characters.baked().graph().skeleton().len();
        vec![JointTransform::IDENTITY; count]
    }

    /// Measures how near the balls came in a step, and counts those that have passed.
    fn measure(&mut self, from: f64) -> Result<(), CharacterError> {
        let mut joints = std::mem::take(&mut self.joints);
        joints.resize(
            self.characters.baked().graph().skeleton().len(),
            JointTransform::IDENTITY,
        );
        let posed = self.characters.pose(self.me, &mut joints);
        let body = self.characters.baked().body();
        self.centres.swap(0, 1);
        body.centres(&joints, &mut self.centres[1]);
        if self.centres[0].len() != self.centres[1].len() {
            self.centres[0] = self.centres[1].clone();
        }
        self.joints = joints;
        posed?;
        let now = self.characters.now();
        let [before, after] = &self.centres;
        for ball in &mut self.balls {
            if ball.threat.time > from {
                continue;
            }
            ball.pictures += 1;
            let ends = [ball.threat.at(from), ball.threat.at(now)];
            for ((a, b), sphere) in before.iter().zip(after).zip(&body.spheres) {
                let radii = [BALL + sphere.radius; 2];
                let apart = closest([ends[0] - *a, ends[1] - *b], radii).1;
                ball.nearest = ball.nearest.min(apart);
            }
        }
        let over = |ball: &Ball| {
            ball.threat.time + f64::from(ball.threat.seconds) < now || {
                let at = ball.threat.at(now);
                at.x.abs().max(at.z.abs()) > HALF_SIDE && ball.threat.time < now - 0.5
            }
        };
        let score = &mut self.score;
        let events = &mut self.events;
        self.balls.retain(|ball| {
            if !over(ball) {
                return true;
            }
            score.last = Some(ball.nearest);
            if ball.nearest < 0.0 {
                score.hits += 1;
            } else {
                score.missed += 1;
                let least = score
                    .closest
                    .map_or(ball.nearest, |least| least.min(ball.nearest));
                score.closest = Some(least);
            }
            events.push(Event::Passed {
                number: ball.number,
                nearest: ball.nearest,
                pictures: ball.pictures,
            });
            false
        });
        Ok(())
    }

    /// The score.
    #[must_use]
    pub fn score(&self) -> DriveScore {
        self.score
    }

    /// Whether it was said last that no motion avoids both balls and walls.
    #[must_use]
    pub fn is_cornered(&self) -> bool {
        self.is_cornered
    }

    /// The driven character's frame: root on the ground and heading.
    ///
    /// # Errors
    /// Those of the characters.
    pub fn place(&self) -> Result<Rigid2, CharacterError> {
        self.characters.place(self.me)
    }

    /// Largest depth of the driven body in a wall or pillar, in metres.
    #[must_use]
    pub fn depth(&self) -> f32 {
        let spheres = &self.characters.baked().body().spheres;
        let each = self.centres[1].iter().zip(spheres);
        each.flat_map(|(centre, sphere)| {
            let depth = |obstacle: &Obstacle| sphere.radius - obstacle.distance(*centre, 0.0);
            self.obstacles.iter().map(depth)
        })
        .fold(f32::NEG_INFINITY, f32::max)
    }

    /// Takes the events since the last call.
    pub fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }

    /// The focus of the camera, in metres.
    #[must_use]
    pub fn focus(&self) -> Vec3 {
        let root = self
            .joints
            .first()
            .map_or(Vec3::ZERO, |joint| joint.translation);
        Vec3::new(root.x, 0.92, root.z)
    }

    /// Draws the characters with meshes that are bound to the graph's skeleton.
    pub fn wear(&mut self, outfit: Option<Arc<Outfit>>) {
        self.outfit = outfit;
    }

    /// Meshes of the characters.
    #[must_use]
    pub fn meshes(&self) -> &[Mesh] {
        self.outfit.as_ref().map_or(&[], |outfit| &outfit.meshes)
    }

    /// Adds a character's body. `alpha` below 1 makes it translucent.
    fn add_body(&self, which: usize, (joints, alpha): (&[JointTransform], f32), shot: &mut Shot) {
        match &self.outfit {
            Some(outfit) => shot.skinned.push(SkinnedBody {
                alpha,
                ..SkinnedBody::new(&outfit.skins[which], joints)
            }),
            None if alpha < 1.0 => self.figures[which].capsules(joints, alpha, &mut shot.ghosts),
            None => self.figures[which].capsules(joints, 1.0, &mut shot.solids),
        }
    }

    /// The picture that `camera` sees. What hides the driven character from it is translucent.
    ///
    /// # Errors
    /// Those of the characters.
    pub fn shot(&mut self, camera: Camera) -> Result<Shot, CharacterError> {
        let focus = self.focus();
        let light = Light {
            shadow: Sphere::new(focus.with_y(0.0), 6.0),
            ..Light::default()
        };
        let mut shot = Shot::new(camera, light);
        let mut joints = self.joints_of_size();
        self.characters.pose(self.me, &mut joints)?;
        self.add_body(0, (&joints, 1.0), &mut shot);
        let sight = SightLine::new(&camera, focus);
        for &id in &self.opponents {
            self.characters.pose(id, &mut joints)?;
            let root = joints[0].translation;
            let alpha = match sight.meets(Vec2::new(root.x, root.z), OPPONENT) {
                true => FADED,
                false => 1.0,
            };
            self.add_body(1, (&joints, alpha), &mut shot);
        }
        let now = self.characters.now();
        for ball in &self.balls {
            let at = ball.threat.at(now.max(ball.threat.time));
            shot.solids
                .push(Capsule::ball(Sphere::new(at, BALL), FLYING));
        }
        add_room(&sight, &mut shot);
        Ok(shot)
    }
}
