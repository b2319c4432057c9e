//! Balls that are thrown at characters that walk or stand.

use std::f32::consts::TAU;
use std::sync::{Arc, Mutex, PoisonError};

use glam::Vec3;
use rand::{Rng, RngExt};
use sabaki::anim::JointTransform;
use sabaki::character::{
    CharacterError, CharacterEvent, CharacterEventKind, CharacterId, CharacterSettings, Characters,
    CharactersState, Goal, Threat, ThreatId,
};
use sabaki::maps::BakedGraph;
use sabaki::math::Rigid2;
use sabaki::query::Obstacle;

use super::obstacles::{ScenarioObstacles, Surroundings};
use super::{FRAME, PlayError, WatchedBody, joints_of};
use sabaki_fixtures::throw::{ThrowSettings, generator};

/// The part of the balls' flight that the character knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sight {
    /// The whole flight, from the announcement on: 0.4 to 1.5 s before the throw.
    Known,
    /// The last 3 m of the flight.
    Flying,
    /// The flight with a random error of the position in each frame: 3 cm standard deviation on each axis.
    Noisy,
    /// The flight of balls that change their course half a second before the contact, to where the body will be by its plan.
    Feint,
    /// The same balls as [`Sight::Feint`], whose last course is known from the announcement on.
    FeintKnown,
}

/// One kind of attack.
#[derive(Clone, Copy, Debug)]
pub struct Scenario {
    /// Number of balls.
    pub balls: usize,
    /// The part of the flight that the character knows.
    pub sight: Sight,
    /// Frames from a query to the takeover of its answer.
    pub delay: u32,
    /// Obstacles around the character.
    pub around: Surroundings,
}

/// How an attack ended.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outcome {
    /// Whether no ball touched the body.
    pub avoided: bool,
    /// Plans that were made.
    pub plans: u32,
    /// Plans that replaced another one.
    pub changes: u32,
    /// Largest distance that a joint goes within 20 microseconds, in metres.
    pub largest_pop: f32,
    /// Number of frames in which a joint goes more than 5 mm within that time.
    pub pops: u32,
    /// Number of takeovers.
    pub takeovers: u32,
    /// Deepest entry of a sphere of the body into an obstacle at the end of a frame, in metres; 0 for none.
    pub entered: f32,
    /// Number of times that it was said that no motion avoids both threats and obstacles.
    pub cornered: u32,
}

/// The part of a flight that is seen by [`Sight::Flying`], in metres.
const LAST: f32 = 3.0;

/// Random attacks and steering on one graph.
pub struct Scenarios {
    pub(super) baked: Arc<BakedGraph>,
    pub(super) seed: u64,
    /// Characters that no thread uses: those of the game, and those that look ahead.
    idle: Mutex<Vec<[Characters; 2]>>,
    blank: CharactersState,
}

/// A ball as it flies, and the threat that the characters know.
struct Ball {
    id: ThreatId,
    truth: Threat,
    contact: f64,
    turned: bool,
}

/// State of one run of a scenario.
struct Run<'a> {
    game: &'a mut Characters,
    ahead: &'a mut Characters,
    id: CharacterId,
    scenario: Scenario,
    balls: Vec<Ball>,
    outcome: Outcome,
    body: WatchedBody,
    later: Vec<JointTransform>,
    around: ScenarioObstacles,
    obstacles: Vec<Obstacle>,
}

impl Scenarios {
    /// # Errors
    /// A graph in which nothing can be played.
    pub fn new(baked: &Arc<BakedGraph>, seed: u64) -> Result<Self, CharacterError> {
        let blank = Characters::new(Arc::clone(baked), CharacterSettings::default())?.state();
        Ok(Self {
            baked: Arc::clone(baked),
            seed,
            idle: Mutex::default(),
            blank,
        })
    }

    /// The `index`th attack of the seed.
    ///
    /// # Errors
    /// Those of the characters.
    pub fn run(&self, scenario: Scenario, index: u64) -> Result<Outcome, PlayError> {
        let new = || Characters::new(Arc::clone(&self.baked), CharacterSettings::default());
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let kept = idle().pop();
        let mut pair = match kept {
            Some(pair) => pair,
            None => [new()?, new()?],
        };
        let outcome = self.run_with(&mut pair, scenario, index);
        idle().push(pair);
        outcome
    }

    fn run_with(
        &self,
        [game, ahead]: &mut [Characters; 2],
        scenario: Scenario,
        index: u64,
    ) -> Result<Outcome, PlayError> {
        let mut random = generator(self.seed, index);
        game.restore(self.blank.clone())?;
        game.set_delay(scenario.delay)?;
        ahead.set_delay(scenario.delay)?;
        let id = game.spawn(Rigid2::IDENTITY)?;
        let around =
            ScenarioObstacles::new(scenario.around, &mut generator(self.seed ^ 0x5eed, index))?;
        let heading = random.random::<f32>() * TAU;
        let speed = 0.8 + 1.2 * random.random::<f32>();
        if random.random::<f32>() < 0.6 {
            let velocity = Vec3::new(heading.sin(), 0.0, heading.cos()) * speed;
            let facing = None;
            game.steer(id, Goal::Walk { velocity, facing })?;
        }
        let mut run = Run {
            game,
            ahead,
            id,
            scenario,
            balls: Vec::new(),
            outcome: Outcome::default(),
            body: WatchedBody::default(),
            later: Vec::new(),
            around,
            obstacles: Vec::new(),
        };
        run.pass(random.random_range(30..150), &mut random)?;
        let mut known = Vec::new();
        for _ in 0..scenario.balls {
            let first = known.first().map(|(_, contact)| *contact);
            known.push(run.aim(first, &mut random)?);
        }
        if scenario.sight == Sight::FeintKnown {
            let start = run.game.state();
            let feint = Scenario {
                sight: Sight::Feint,
                ..scenario
            };
            run.scenario = feint;
            run.throw(known)?;
            run.finish(&mut random)?;
            known = run
                .balls
                .drain(..)
                .map(|ball| (ball.truth, ball.contact))
                .collect();
            run.game.restore(start)?;
            (run.scenario, run.outcome) = (scenario, Outcome::default());
        }
        run.throw(known)?;
        run.finish(&mut random)?;
        Ok(run.outcome)
    }
}

impl Run<'_> {
    /// A ball at a part of the body, at the place where it will be if nothing happens. `first` is the contact of another ball: this one
    /// comes within 0.3 s after it.
    fn aim(
        &mut self,
        first: Option<f64>,
        random: &mut impl Rng,
    ) -> Result<(Threat, f64), CharacterError> {
        let throws = ThrowSettings::default();
        let mut between = |(low, high): (f32, f32)| low + (high - low) * random.random::<f32>();
        let (lead, speed) = (between(throws.lead), between(throws.speed));
        let (radius, distance) = (between(throws.radius), between(throws.distance));
        let around = between((0.0, TAU));
        let up = between((-throws.slope, throws.slope));
        let (part, later) = (between((0.0, 1.0)), between((0.0, 0.3)));
        let (lead, distance) = match (first, self.scenario.sight) {
            (None, Sight::Flying) => (0.0, LAST),
            (None, _) => (lead, distance),
            (Some(first), sight) => {
                let wait = (first - self.game.now()) as f32 + later;
                let distance = if sight == Sight::Flying {
                    LAST
                } else {
                    distance
                };
                let distance = distance.min(wait * speed);
                (wait - distance / speed, distance)
            }
        };
        let flight = Vec3::new(around.sin() * up.cos(), up.sin(), around.cos() * up.cos());
        let wait = lead + distance / speed;
        let target = self.part_at(wait, part)?;
        let now = self.game.now();
        let time = now + f64::from(lead);
        let ball = Threat::ball(time, target - flight * distance, flight * speed, radius);
        let seconds = (distance + throws.beyond) / speed;
        Ok((Threat { seconds, ..ball }, now + f64::from(wait)))
    }

    /// Where a part of the body will be after `seconds`, as far as is known.
    fn part_at(&mut self, seconds: f32, part: f32) -> Result<Vec3, CharacterError> {
        let mut events = Vec::new();
        self.ahead.restore(self.game.state())?;
        let frames = (seconds / FRAME) as usize;
        for _ in 0..frames {
            self.around.at(self.ahead.now(), &mut self.obstacles);
            self.ahead.step(FRAME, &self.obstacles, &mut events);
        }
        self.around.at(self.ahead.now(), &mut self.obstacles);
        let rest = seconds - frames as f32 * FRAME;
        self.ahead.step(rest, &self.obstacles, &mut events);
        joints_of(self.ahead, self.id, &mut self.later)?;
        let body = self.game.baked().body();
        let index = (part * body.spheres.len() as f32) as usize;
        Ok(body.spheres[index.min(body.spheres.len() - 1)].centre(&self.later))
    }

    fn throw(&mut self, balls: Vec<(Threat, f64)>) -> Result<(), CharacterError> {
        for (truth, contact) in balls {
            self.balls.push(Ball {
                id: self.game.threaten(truth.clone())?,
                truth,
                contact,
                turned: false,
            });
        }
        Ok(())
    }

    /// Plays on until all balls have passed.
    fn finish(&mut self, random: &mut impl Rng) -> Result<(), CharacterError> {
        self.outcome.avoided = true;
        let last = self
            .balls
            .iter()
            .map(|ball| ball.contact)
            .fold(0.0, f64::max);
        let frames = ((last + 0.7 - self.game.now()) / f64::from(FRAME))
            .ceil()
            .max(0.0);
        self.pass(frames as usize, random)
    }

    fn pass(&mut self, frames: usize, random: &mut impl Rng) -> Result<(), CharacterError> {
        let mut events = Vec::new();
        self.body.look(self.game, self.id)?;
        for _ in 0..frames {
            self.see(random)?;
            let before = self.game.state();
            let from = self.game.now();
            events.clear();
            self.around.at(from, &mut self.obstacles);
            self.game.step(FRAME, &self.obstacles, &mut events);
            self.count(&events);
            self.look_for_pops(before, from)?;
            self.body.look(self.game, self.id)?;
            self.touch(from);
            self.around.at(self.game.now(), &mut self.obstacles);
            let depth = self.body.depth(self.game, &self.obstacles);
            self.outcome.entered = self.outcome.entered.max(depth);
        }
        Ok(())
    }

    fn count(&mut self, events: &[CharacterEvent]) {
        for event in events {
            match event.kind {
                CharacterEventKind::Planned { is_change, .. } => {
                    self.outcome.plans += 1;
                    self.outcome.changes += u32::from(is_change);
                }
                CharacterEventKind::Began => self.outcome.takeovers += 1,
                CharacterEventKind::Cornered { .. } => self.outcome.cornered += 1,
                _ => {}
            }
        }
    }

    /// Updates the threats that the characters know to the part of the flight that is visible in this frame.
    fn see(&mut self, random: &mut impl Rng) -> Result<(), CharacterError> {
        /// Standard deviation of the position's error on each axis, in metres.
        const NOISE: f32 = 0.03;
        /// Time before the contact at which a ball changes its course, in seconds.
        const TURNS: f64 = 0.5;
        let now = self.game.now();
        for index in 0..self.balls.len() {
            let Ball {
                id,
                truth,
                contact,
                turned,
            } = &self.balls[index];
            let (id, contact) = (*id, *contact);
            if truth.time + f64::from(truth.seconds) <= now {
                continue;
            }
            match self.scenario.sight {
                Sight::Noisy => {
                    // Four uniform numbers, nearly a normal one.
                    let mut off = || {
                        let sum: f32 = (0..4).map(|_| random.random::<f32>()).sum();
                        (sum - 2.0) * 3f32.sqrt() * NOISE
                    };
                    let position = truth.position + Vec3::new(off(), off(), off());
                    let seen = Threat {
                        position,
                        ..truth.clone()
                    };
                    self.game.update(id, seen)?;
                }
                Sight::Feint if !turned && now >= contact - TURNS => {
                    let time = now.max(truth.time);
                    let position = truth.at(time);
                    let left = ((contact - time) as f32).max(0.05);
                    let part = random.random::<f32>();
                    let target = self.part_at((contact - now) as f32, part)?;
                    let truth = &mut self.balls[index].truth;
                    let velocity = (target - position) / left;
                    let seconds = left + 1.0 / velocity.length().max(1.0);
                    *truth = Threat {
                        time,
                        position,
                        velocity,
                        seconds,
                        ..truth.clone()
                    };
                    let seen = truth.clone();
                    self.balls[index].turned = true;
                    self.game.update(id, seen)?;
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Measures how far the joints move within a moment from the start of the frame.
    fn look_for_pops(&mut self, before: CharactersState, from: f64) -> Result<(), CharacterError> {
        const MOMENT: f32 = 2e-5;
        const POP: f32 = 0.005;
        let mut events = Vec::new();
        self.ahead.restore(before)?;
        self.around.at(from, &mut self.obstacles);
        self.ahead.step(MOMENT, &self.obstacles, &mut events);
        joints_of(self.ahead, self.id, &mut self.later)?;
        let both = self.body.joints.iter().zip(&self.later);
        let apart = both.map(|(a, b)| a.translation.distance(b.translation));
        let largest = apart.fold(0.0, f32::max);
        self.outcome.largest_pop = self.outcome.largest_pop.max(largest);
        self.outcome.pops += u32::from(largest > POP);
        Ok(())
    }

    /// Whether a ball touches the body in the frame that began at `from`.
    fn touch(&mut self, from: f64) {
        let now = self.game.now();
        let flies = |ball: &&Ball| {
            let truth = &ball.truth;
            truth.time <= from && truth.time + f64::from(truth.seconds) >= now
        };
        let touches = |ball: &Ball| self.body.nearest(self.game, &ball.truth, from) < 0.0;
        self.outcome.avoided &= !self.balls.iter().filter(flies).any(touches);
    }
}
