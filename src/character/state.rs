use glam::{Vec3, Vec3Swizzles};
use serde::{Deserialize, Serialize};

use super::event::{CharacterEventKind, CharacterId, ThreatId};
use super::goal::Goal;
use super::keep_out::Squeezed;
use super::plan::{GivenUp, Progress};
use super::playing::Playing;
use super::steer::{Reach, Recent, SteerState, SteerStep};
use super::strike::Strike;
use super::threat::Window;
use super::world::{KnownThreat, PlanScratch, Worker, World};
use crate::graph::{Motion, MotionGraph};
use crate::maps::BakedGraph;
use crate::math::{Rigid2, Sphere};
use crate::query::clearance::AdditiveLayer;

/// Complete state of one character.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct CharacterState {
    pub playing: Playing,
    pub goal: Goal,
    /// Height of the ground on which it stands, in metres. The motion, and everything that it is tested against, is above that ground.
    pub height: f32,
    /// What the host adds to the pose.
    pub additive: AdditiveLayer,
    /// How far the host has moved it since its motion was tested, in metres.
    pub moved: f32,
    pub steer: SteerState,
    /// Whether something else moves the body.
    pub is_released: bool,
    /// Motion that takes over at a later time.
    pub pending: Option<Pending>,
    /// Time until which steering waits, in seconds.
    pub held_until: f64,
    /// Time at which the threats that the plan avoids have passed, in seconds.
    pub passed_at: f64,
    /// Whether the played motion is a plan that avoids threats.
    pub has_plan: bool,
    /// Hash of the threats of the last plan or test; 0 for none.
    pub seen: u64,
    /// Hash of the threats of the next plan or test.
    pub next_seen: u64,
    /// Time at which the same threats are tested again, in seconds; `None` if they are not.
    pub retry_at: Option<f64>,
    /// Threats that could not be avoided.
    pub given_up: Vec<GivenUp>,
    /// Where a plan goes on for which the last step had no time.
    pub progress: Progress,
    /// Hash of the ids of the threats that were last reported as avoided; 0 for none.
    pub avoided: u64,
    /// Whether the character reached the point of its goal.
    pub has_arrived: bool,
    /// Side on which the character passes an obstacle.
    pub side: Side,
    /// Time at which the plan is tested against the obstacles again, in seconds.
    pub look_at: f64,
    pub squeezed: Squeezed,
    /// The attack that it plays.
    pub strike: Option<Strike>,
    /// From where an attack reaches what its goal strikes, once it was searched.
    pub reach: Option<Reach>,
    /// The attacks that it has begun.
    pub struck: Recent,
    /// Threats that are near, with the smallest distance so far.
    pub watched: Vec<Watched>,
    /// Centres of the body's spheres at the end of the last step, in metres. Updated while a threat is near.
    pub centres: Vec<Vec3>,
    #[serde(skip)]
    pub events: Vec<(f64, CharacterEventKind)>,
}

/// A threat that came near, with the smallest distance so far.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Watched {
    pub id: ThreatId,
    /// Smallest distance so far, in metres; `f32::MAX` until it is measured.
    pub metres: f32,
    pub is_hit: bool,
    /// Whether its miss was reported.
    pub is_missed: bool,
}

/// A motion that takes over.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Pending {
    pub motion: Motion,
    /// Time of the takeover, in seconds.
    pub at: f64,
}

/// The side on which an obstacle is passed. It is kept until the way is free.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Side {
    #[default]
    None,
    Left,
    Right,
}

impl CharacterState {
    pub(super) fn new(motion: Motion) -> Self {
        Self {
            playing: Playing::new(motion),
            goal: Goal::default(),
            height: 0.0,
            additive: AdditiveLayer::default(),
            moved: 0.0,
            steer: SteerState::default(),
            is_released: false,
            pending: None,
            held_until: 0.0,
            passed_at: 0.0,
            has_plan: false,
            seen: 0,
            next_seen: 0,
            retry_at: None,
            given_up: Vec::new(),
            progress: Progress::default(),
            avoided: 0,
            has_arrived: false,
            side: Side::default(),
            look_at: 0.0,
            squeezed: Squeezed::Free,
            strike: None,
            reach: None,
            struck: [u32::MAX; 3],
            watched: Vec::new(),
            centres: Vec::new(),
            events: Vec::new(),
        }
    }

    /// Velocity of the root, in metres per second.
    pub(super) fn velocity(&self, baked: &BakedGraph) -> Vec3 {
        /// Time over which it is measured, in seconds.
        const MOMENT: f32 = 0.1;
        let playing = &self.playing;
        let root = |seconds: f32| playing.motion.root(baked.graph(), seconds);
        let moved = root(playing.seconds + MOMENT) - root(playing.seconds);
        moved * (playing.rate / MOMENT) + Vec3::new(playing.drift.x, 0.0, playing.drift.y)
    }

    /// Begins a pending motion whose time has come. Returns [`CharacterState::urgency`].
    pub(super) fn begin(
        &mut self,
        id: CharacterId,
        world: &World<'_>,
        worker: &mut Worker,
    ) -> Option<f32> {
        if self.is_released {
            return None;
        }
        self.take_over(world.now, &mut worker.plan);
        self.look_for_obstacles(id, world, worker);
        self.urgency(id, world, &mut worker.threats)
    }

    /// Moves the body, and has its motion tested again once it has been moved by more than `most` metres.
    pub(super) fn move_by(&mut self, by: Rigid2, now: f64, most: f32, graph: &MotionGraph) {
        let from = self.playing.motion.root(graph, self.playing.seconds);
        self.playing.motion.transform(by);
        if let Some(pending) = &mut self.pending {
            pending.motion.transform(by);
        }
        for centre in &mut self.centres {
            *centre = by.point(*centre);
        }
        self.steer.move_by(by);
        let drift = self.playing.drift;
        self.playing.drift = by.vector(Vec3::new(drift.x, 0.0, drift.y)).xz();
        let way = from.distance(by.point(from)) + by.heading().abs();
        self.has_moved(way, now, most);
    }

    /// Has the motion tested again once the host has moved the body by more than `most` metres.
    pub(super) fn has_moved(&mut self, way: f32, now: f64, most: f32) {
        self.moved += way;
        if self.moved > most {
            self.moved = 0.0;
            self.retry_at = self.retry_at.map(|_| now);
            self.given_up.clear();
            self.look_at = now;
        }
    }

    /// How far the body reaches from its root, in metres.
    pub(super) fn reach(&self, baked: &BakedGraph) -> f32 {
        baked.reach() + self.additive.moves()
    }

    /// Whether steering may search: it never cuts a blend, but a strike may.
    pub(super) fn may_search(&self) -> bool {
        let blends = || self.playing.motion.is_blending_body(self.playing.seconds);
        matches!(self.goal, Goal::Strike { .. }) || !blends()
    }

    /// Steers once the threats that a plan avoids have passed. A walking character leaves its evasion then.
    fn steer(&mut self, world: &World<'_>, worker: &mut Worker, may_search: bool) {
        // What steering adds to the motion ends with it.
        let drift = std::mem::take(&mut self.playing.drift);
        let strike = self.strike;
        if let Some(strike) = strike {
            if world.now < strike.until {
                return;
            }
            self.end_strike(world.now, true);
            self.steer.search_now();
        }
        let is_evading = world.now < self.held_until;
        if self.pending.is_some() || is_evading && world.now < self.passed_at {
            return;
        }
        let step = SteerStep {
            baked: world.baked,
            settings: &world.settings.steer,
            aim: self.steer_around(world, &worker.obstacles),
            may_search,
            dt: world.dt,
        };
        let steering = world.steering;
        let (playing, state) = (&mut self.playing, &mut self.steer);
        if is_evading {
            let scratch = &mut worker.steer;
            if !step.aim.stands() && steering.leave(&step, playing, state, scratch) {
                self.held_until = world.now;
                self.retry_at = self.retry_at.map(|_| world.now);
                self.has_plan = false;
                self.events.push((world.now, CharacterEventKind::Ended));
            }
            return;
        }
        if self.has_plan {
            self.has_plan = false;
            self.events.push((world.now, CharacterEventKind::Ended));
            state.search_now();
        }
        // The host may set another goal once a strike has ended.
        if may_search && strike.is_none() && self.begin_strike(world, worker) {
            return;
        }
        let (playing, state) = (&mut self.playing, &mut self.steer);
        let before = playing.seconds;
        playing.drift = drift;
        steering.step(&step, playing, state, &mut worker.steer);
        if matches!(self.goal, Goal::Strike { .. }) {
            state.stay_ready(world.settings.steer.interval, may_search);
        }
        if playing.seconds < before {
            // Another motion is tested at once.
            self.retry_at = self.retry_at.map(|_| world.now);
        }
    }

    /// Steers, and lets `dt` pass. `may_search` says whether the step may search for a motion.
    pub(super) fn step(
        &mut self,
        id: CharacterId,
        world: &World<'_>,
        worker: &mut Worker,
        may_search: bool,
    ) {
        if self.is_released {
            return;
        }
        self.look_out(id, world, worker);
        self.near_obstacles(id, world, &mut worker.obstacles);
        self.steer(world, worker, may_search);
        let end = world.now + f64::from(world.dt);
        let graph = world.baked.graph();
        match self.pending.as_ref().map(|pending| pending.at) {
            Some(at) if at < end - 1e-6 => {
                self.playing
                    .advance(graph, (at - world.now).max(0.0) as f32);
                self.take_over(at, &mut worker.plan);
                self.playing.advance(graph, (end - at) as f32);
            }
            _ => self.playing.advance(graph, world.dt),
        }
        self.keep_out(world, worker);
        self.watch(id, world, worker);
    }

    /// Begins the pending motion if its time has come.
    pub(super) fn take_over(&mut self, now: f64, scratch: &mut PlanScratch) {
        if let Some(pending) = self.pending.take_if(|pending| pending.at <= now + 1e-6) {
            self.end_strike(now, false);
            let left = std::mem::replace(&mut self.playing, Playing::new(pending.motion));
            scratch.keep_memory(left.motion);
            self.events.push((now, CharacterEventKind::Began));
        }
    }

    /// When a threat may reach this character, counted from `from`.
    pub(super) fn window(
        &self,
        world: &World<'_>,
        from: f64,
        threat: &KnownThreat,
    ) -> Option<Window> {
        let (graph, reach) = (world.baked.graph(), self.reach(world.baked));
        let ahead = (from - world.now) as f32 * self.playing.rate;
        let root = |t: f32| {
            self.playing
                .motion
                .root(graph, self.playing.seconds + ahead + t)
                + Vec3::Y * self.height
        };
        let first = threat.window(from, Sphere::new(root(0.0), reach + Window::ROOM))?;
        threat.window(from, Sphere::new(root(first.nearest), reach))
    }
}
