//! A character that is driven by keys in a room, among opponents who throw at it from all sides.

use std::sync::Arc;

use egui::{Color32, RichText};
use glam::{Vec2, Vec3};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use sabaki::character::{
    CharacterError, CharacterEvent, CharacterEventKind, CharacterId, CharacterSettings, Characters,
    Goal, Threat, ThreatId,
};
use sabaki::maps::BakedGraph;
use sabaki::math::{F32x16, Rigid2, Sphere};
use sabaki::query::{Obstacle, ObstacleError};
use sabaki_draw::scene::{Actor, Camera, Capsule, Light, Look, Mesh, Outfit, Shot};

use super::gui::write_in_corner;
use super::{Drawn, Event, Scene, Seen};
use crate::play::{PlayError, WatchedBody, joints_of};
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
/// Half of the side of the room, in metres.
const HALF_SIDE: f32 = 6.0;
/// Pillars: place (x, z) and radius, in metres.
const PILLARS: [(Vec2, f32); 3] = [
    (Vec2::new(2.5, 2.0), 0.35),
    (Vec2::new(-3.0, 1.0), 0.35),
    (Vec2::new(0.5, -3.2), 0.5),
];

const FLYING: [f32; 4] = [0.85, 0.12, 0.08, 1.0];
const OTHERS: Vec3 = Vec3::new(0.30, 0.36, 0.62);
const ROOM: [f32; 3] = [0.34, 0.38, 0.45];
/// Opacity of what hides the character.
const FADED: f32 = 0.2;
const AVOIDED: Color32 = Color32::from_rgb(60, 150, 80);
const HIT: Color32 = Color32::from_rgb(200, 60, 50);

const KEYS: [(&str, &str); 5] = [
    ("w a s d", "walk, seen from the camera"),
    ("shift", "run"),
    ("q e", "turn"),
    ("space", "dodge what flies, if it does not by itself"),
    ("f", "dodge by itself, or by the key"),
];

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

struct Ball {
    number: u32,
    threat: Threat,
    /// Id of the threat, if the character knows of it.
    known: Option<ThreatId>,
    nearest: f32,
    pictures: u32,
}

/// The room, the driven character and its opponents.
pub struct DriveScene {
    /// Whether the character dodges by itself; otherwise when the key is pressed.
    pub dodges_alone: bool,
    characters: Characters,
    me: CharacterId,
    opponents: Vec<CharacterId>,
    obstacles: Vec<Obstacle>,
    /// The driven character and an opponent.
    actors: [Actor; 2],
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
    body: WatchedBody,
    happened: Vec<CharacterEvent>,
    events: Vec<Event>,
    is_cornered: bool,
    /// Reason why the simulation has stopped.
    failed: Option<String>,
}

/// The keys that are held, in the order of [`DriveScene::held`].
const HELD: [&str; 7] = ["w", "s", "a", "d", "shift", "q", "e"];

impl DriveScene {
    /// A character in the middle of a room. `seed` determines the opponents.
    ///
    /// # Errors
    /// A graph in which nothing can be played.
    pub fn new(
        baked: &BakedGraph,
        outfit: Option<Arc<Outfit>>,
        seed: u64,
    ) -> Result<Self, PlayError> {
        let settings = CharacterSettings {
            body_radius: 0.3,
            ..CharacterSettings::default()
        };
        let skins = outfit.as_ref().map(|outfit| outfit.skins.clone());
        let [mine, others] = skins.map_or([None, None], |skins| skins.map(Some));
        let look = Look {
            clothes: OTHERS,
            skin: OTHERS,
            ..Look::default()
        };
        let other = Actor::new(baked, &look, others);
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
            actors: [Actor::new(baked, &Look::default(), mine), other],
            outfit,
            random: generator(seed, 0),
            held: [false; 7],
            ahead: Vec2::Y,
            facing: None,
            balls: Vec::new(),
            thrown: 0,
            next_throw: 2.0,
            score: DriveScore::default(),
            body: WatchedBody::default(),
            happened: Vec::new(),
            events: Vec::new(),
            is_cornered: false,
            failed: None,
        })
    }

    /// Lets the character know of all balls that fly.
    fn dodge_now(&mut self) {
        for ball in &mut self.balls {
            if ball.known.is_none() {
                ball.known = self.characters.threaten(ball.threat.clone()).ok();
            }
        }
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
        let mut joints = Vec::new();
        joints_of(&mut self.characters, thrower, &mut joints)?;
        let from = joints[0].translation + Vec3::Y * 0.4;
        joints_of(&mut self.characters, self.me, &mut joints)?;
        let mine = joints[0].translation;
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

    /// Measures how near the balls came in a step, and counts those that have passed.
    fn measure(&mut self, from: f64) -> Result<(), CharacterError> {
        self.body.look(&mut self.characters, self.me)?;
        let now = self.characters.now();
        for ball in self
            .balls
            .iter_mut()
            .filter(|ball| ball.threat.time <= from)
        {
            ball.pictures += 1;
            let apart = self.body.nearest(&self.characters, &ball.threat, from);
            ball.nearest = ball.nearest.min(apart);
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
    pub fn score(&self) -> DriveScore {
        self.score
    }

    /// The driven character's frame: root on the ground and heading.
    ///
    /// # Errors
    /// Those of the characters.
    pub fn place(&self) -> Result<Rigid2, CharacterError> {
        self.characters.place(self.me)
    }

    /// Largest depth of the driven body in a wall or pillar, in metres.
    pub fn depth(&self) -> f32 {
        self.body.depth(&self.characters, &self.obstacles)
    }

    /// The score, and the distance of the last ball, with its colour.
    fn line(&self) -> (String, Color32) {
        let DriveScore {
            hits, missed, last, ..
        } = self.score;
        let counts = format!("{missed} avoided : {hits} hit");
        match last {
            Some(metres) if metres > 0.0 => {
                (format!("{counts}, the last by {metres:.2} m"), AVOIDED)
            }
            Some(_) => (format!("{counts}, the last hit"), HIT),
            None => (counts, AVOIDED),
        }
    }

    /// The picture that `camera` sees. What hides the driven character from it is translucent. From then on the keys lead in the direction in
    /// which the camera looks.
    ///
    /// # Errors
    /// Those of the characters.
    pub fn shot(&mut self, camera: Camera) -> Result<Shot, CharacterError> {
        let (focus, ahead) = (self.focus(), camera.target - camera.eye);
        self.ahead = Vec2::new(ahead.x, ahead.z).normalize_or(self.ahead);
        let light = Light {
            shadow: Sphere::new(focus.with_y(0.0), 6.0),
            ..Light::default()
        };
        let mut shot = Shot::new(camera, light);
        let mut joints = Vec::new();
        joints_of(&mut self.characters, self.me, &mut joints)?;
        self.actors[0].add(&joints, None, 1.0, &mut shot);
        for &id in &self.opponents {
            joints_of(&mut self.characters, id, &mut joints)?;
            let root = joints[0].translation;
            let alpha = match hides(&camera, focus, Vec2::new(root.x, root.z), OPPONENT) {
                true => FADED,
                false => 1.0,
            };
            self.actors[1].add(&joints, None, alpha, &mut shot);
        }
        let now = self.characters.now();
        for ball in &self.balls {
            let at = ball.threat.at(now.max(ball.threat.time));
            let ball = Capsule::ball(Sphere::new(at, BALL), FLYING);
            shot.solids.push(ball);
        }
        add_room(&camera, focus, &mut shot);
        Ok(shot)
    }
}

impl Scene for DriveScene {
    fn meshes(&self) -> &[Mesh] {
        self.outfit.as_ref().map_or(&[], |outfit| &outfit.meshes)
    }

    fn advance(&mut self, seconds: f32) {
        let steps = (seconds / STEP).ceil().max(1.0);
        for _ in 0..steps as usize {
            if self.failed.is_none() {
                let stepped = self.step(seconds / steps);
                self.failed = stepped.err().map(|error| error.to_string());
            }
        }
    }

    fn focus(&self) -> Vec3 {
        let root = self.body.joints.first();
        root.map_or(Vec3::ZERO, |joint| joint.translation)
            .with_y(0.92)
    }

    fn distance(&self) -> f32 {
        6.5
    }

    fn draw(&mut self, camera: Camera, _: [u32; 2], _: &mut [F32x16]) -> Drawn {
        let shot = self.shot(camera).unwrap_or_else(|error| {
            self.failed = Some(error.to_string());
            Shot::new(camera, Light::default())
        });
        Ok((shot, None))
    }

    fn key(&mut self, key: &str, is_down: bool) -> bool {
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

    fn keys(&self) -> &'static [(&'static str, &'static str)] {
        &KEYS
    }

    fn panel(&mut self, ui: &mut egui::Ui) {
        let (line, colour) = self.line();
        ui.label(RichText::new(line).strong().color(colour));
        if let Some(closest) = self.score.closest {
            ui.label(format!("the closest that missed: {closest:.3} m"));
        }
        ui.checkbox(&mut self.dodges_alone, "it dodges by itself");
        if self.is_cornered {
            ui.label(RichText::new("cornered: no way avoids balls and walls").color(HIT));
        }
        if let Some(failed) = &self.failed {
            ui.label(RichText::new(failed).color(HIT));
        }
        ui.separator();
        for (key, what) in KEYS {
            ui.label(format!("{key}: {what}"));
        }
    }

    fn label(&self, painter: &egui::Painter, _: Seen<'_>) {
        let (line, colour) = self.line();
        write_in_corner(painter, line, colour);
    }

    fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }
}

/// The walls and pillars as obstacles.
fn obstacles() -> Result<Vec<Obstacle>, ObstacleError> {
    let mut all = Vec::new();
    for out in [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z] {
        all.push(Obstacle::half_space(out * HALF_SIDE, -out)?);
    }
    for (place, radius) in PILLARS {
        all.push(Obstacle::disc(place, radius)?);
    }
    Ok(all)
}

/// Adds the walls as rails and the pillars as columns. A pillar that hides the character is translucent.
fn add_room(camera: &Camera, focus: Vec3, shot: &mut Shot) {
    const THICK: f32 = 0.06;
    let [r, g, b] = ROOM;
    for height in [0.1, 0.6, 1.1] {
        let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)];
        let corner = |index: usize| {
            let (x, z): (f32, f32) = corners[index % 4];
            Vec3::new(x * (HALF_SIDE + THICK), height, z * (HALF_SIDE + THICK))
        };
        for index in 0..4 {
            let end = |index| Sphere::new(corner(index), THICK);
            let rail = Capsule::new(end(index), end(index + 1), [r, g, b, 1.0]);
            shot.solids.push(rail);
        }
    }
    for (place, radius) in PILLARS {
        let at = |height: f32| Sphere::new(Vec3::new(place.x, height, place.y), radius);
        let pillar = |alpha| Capsule::new(at(0.0), at(1.8), [r, g, b, alpha]);
        match hides(camera, focus, place, radius) {
            true => shot.ghosts.push(pillar(FADED)),
            false => shot.solids.push(pillar(1.0)),
        }
    }
}

/// Whether an upright cylinder on the ground, its place (x, z) and radius in metres, hides a part of a character from a camera.
fn hides(camera: &Camera, character: Vec3, place: Vec2, radius: f32) -> bool {
    /// Half of the width of the character, in metres.
    const CHARACTER: f32 = 0.45;
    let eye = Vec2::new(camera.eye.x, camera.eye.z);
    let (way, to) = (Vec2::new(character.x, character.z) - eye, place - eye);
    let along = to.dot(way.normalize_or_zero());
    let aside = (to.length_squared() - along * along).max(0.0).sqrt();
    (0.0..way.length()).contains(&along) && aside < radius + CHARACTER
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_between_camera_and_character_alone_hides_it() {
        let camera = Camera {
            eye: Vec3::new(0.0, 2.0, 6.0),
            target: Vec3::new(0.0, 0.9, 0.0),
            field: 0.8,
        };
        let hides = |x: f32, z: f32| hides(&camera, camera.target, Vec2::new(x, z), 0.3);
        assert!(hides(0.0, 3.0) && hides(0.7, 3.0) && hides(-0.7, 1.0));
        assert!(!hides(0.8, 3.0), "beside the line");
        assert!(!hides(0.0, -0.5), "behind the character");
        assert!(!hides(0.0, 6.5), "behind the camera");
    }
}
