//! A character that walks its graph without end and dodges the thrown balls.
//!
//! Source: Masaoka & Oshita, section 5: their test program.

use std::collections::VecDeque;
use std::sync::Arc;

use glam::Vec3;

use super::aim::{BallSettings, Click};
use super::event::Event;
use super::map_choices::{MapChoice, MapChoices};
use super::query_worker::QueryWorker;
use super::throw::{OpenThrow, Throw};
use super::walker::Walker;
use super::worker_request::{WorkerRequest, WorkerResponse};
use sabaki::anim::{JointTransform, Pose, forward_kinematics};
use sabaki::graph::{EdgeId, Motion, Playhead};
use sabaki::maps::BakedGraph;
use sabaki::math::{Rigid2, Sphere, smooth_step};
use sabaki::query::{AttackError, CullPath, QuerySettings};
use sabaki_draw::scene::{
    Camera, Figure, Light, Look, MapStyle, Mesh, Nearest, Outfit, Shot, Skin, SkinnedBody,
};

/// Settings that may change while the simulation runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FighterSettings {
    /// Settings of the balls that clicks throw.
    pub ball: BallSettings,
    /// Settings of the queries.
    pub query: QuerySettings,
    /// Culling path.
    pub culling: CullPath,
    /// Shows the motion without the dodge, too. Default: true.
    pub ghost: bool,
    /// How the maps of the chosen evasion are shown. Default: `None`, they are not.
    pub maps: Option<MapStyle>,
    /// Speed of time while the ball is near. Default: 0.35; 1 is real time.
    pub near_speed: f32,
    /// Waits for answers, so that every run is the same. Default: false; time goes on up to the next node.
    pub waits: bool,
}

impl Default for FighterSettings {
    fn default() -> Self {
        Self {
            ball: BallSettings::default(),
            query: QuerySettings::default(),
            culling: CullPath::default(),
            ghost: true,
            maps: None,
            near_speed: 0.35,
            waits: false,
        }
    }
}

/// The state of the fighter.
enum FighterState {
    Walking,
    /// A ball was thrown this many seconds ago; the answer is missing.
    Querying {
        open: Box<OpenThrow>,
        since: f32,
    },
    /// Shows the last throw, this many seconds after its click.
    Dodging {
        t: f32,
        seen: BallProgress,
    },
}

/// The part of a ball's flight that has been shown.
#[derive(Clone, Copy)]
struct BallProgress {
    nearest: f32,
    pictures: u32,
    passed: bool,
}

/// The fighter and the last throw.
pub struct Fighter<'a> {
    /// May change at any time; a query uses the settings of the moment of the throw.
    pub settings: FighterSettings,
    baked: &'a BakedGraph,
    choices: &'a MapChoices<'a>,
    chosen: MapChoice,
    worker: QueryWorker,
    figure: Figure,
    other: Figure,
    outfit: Option<Arc<Outfit>>,
    walker: Walker,
    playhead: Playhead,
    state: FighterState,
    last: Option<Throw<'a>>,
    throws: u32,
    replay: Option<f32>,
    /// A candidate of the last throw, and its motion.
    picked: Option<(usize, Motion)>,
    times: VecDeque<f32>,
    events: Vec<Event>,
}

/// Number of queries whose times are kept.
const TIMES: usize = 60;
/// Colour of a candidate that was not chosen.
const OTHER: Vec3 = Vec3::new(0.95, 0.42, 0.02);
/// Approximate height of the root, in metres.
const HIPS: f32 = 0.92;

impl<'a> Fighter<'a> {
    /// Creates a fighter in the graph's first pose, at the origin.
    #[must_use]
    pub fn new(
        choices: &'a MapChoices<'a>,
        worker: QueryWorker,
        settings: FighterSettings,
    ) -> Self {
        let baked = choices.baked();
        let graph = baked.graph();
        let figure = Figure::of(graph.skeleton(), baked.body(), &Look::default());
        Self {
            settings,
            baked,
            choices,
            chosen: MapChoice::default(),
            worker,
            other: figure.clone().coloured(OTHER),
            figure,
            outfit: None,
            walker: Walker::new(0),
            playhead: Playhead::at(graph, EdgeId(0), 0.0, Rigid2::IDENTITY),
            state: FighterState::Walking,
            last: None,
            throws: 0,
            replay: None,
            picked: None,
            times: VecDeque::new(),
            events: Vec::new(),
        }
    }

    /// Sets the seed that determines its walk. Default: 0.
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.walker = Walker::new(seed);
        self
    }

    /// The fighter's graph.
    #[must_use]
    pub fn baked(&self) -> &'a BakedGraph {
        self.baked
    }

    /// The maps that queries may use.
    #[must_use]
    pub fn map_choices(&self) -> &'a MapChoices<'a> {
        self.choices
    }

    /// The maps of the next query.
    #[must_use]
    pub fn maps(&self) -> MapChoice {
        self.chosen
    }

    /// Sets the maps from the next throw on. They are drawn in the background.
    pub fn choose_maps(&mut self, maps: MapChoice) {
        self.chosen = maps;
        self.worker.draw(maps);
    }

    /// The last answered throw.
    #[must_use]
    pub fn last(&self) -> Option<&Throw<'a>> {
        self.last.as_ref()
    }

    /// Milliseconds of the last queries, the latest one last.
    pub fn query_times(&self) -> impl ExactSizeIterator<Item = f32> + '_ {
        self.times.iter().copied()
    }

    /// Takes the events since the last call.
    pub fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }

    /// Whether a query has no answer yet.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        matches!(self.state, FighterState::Querying { .. })
    }

    /// Whether the last throw is replayed.
    #[must_use]
    pub fn is_replaying(&self) -> bool {
        self.replay.is_some()
    }

    /// The shown moment of the last throw, in seconds since its click; `None` while the fighter walks.
    #[must_use]
    pub fn moment(&self) -> Option<f32> {
        match (self.replay, &self.state) {
            (Some(t), _) => Some(t),
            (None, FighterState::Dodging { t, .. }) => Some(*t),
            _ => None,
        }
    }

    /// Starts or stops the replay of the last throw.
    pub fn replay(&mut self) {
        self.replay = match (self.replay, &self.last) {
            (None, Some(last)) => Some(last.dodge.span()[0]),
            _ => None,
        };
    }

    /// The candidate of the last throw that is shown beside the chosen one.
    #[must_use]
    pub fn picked(&self) -> Option<usize> {
        self.picked.as_ref().map(|(index, _)| *index)
    }

    /// Shows a candidate of the last throw in a repeating replay; `None` ends it.
    pub fn pick(&mut self, candidate: Option<usize>) {
        self.picked = candidate.and_then(|index| {
            let last = self.last.as_ref()?;
            let report = last.answer().candidates.get(index)?;
            let answer = last.answer();
            let mut motion = answer.motion_of(self.baked, last.playhead, report)?;
            motion.extend(self.baked.graph(), last.dodge.span()[1]);
            Some((index, motion))
        });
        if self.picked.is_none() {
            self.replay = None;
        } else if self.moment().is_none() {
            self.replay();
        }
    }

    /// Throws a ball in the direction `ray` of `camera`, unless one is flying.
    ///
    /// # Errors
    /// The settings of the ball make no attack.
    pub fn throw(&mut self, camera: &Camera, ray: Vec3) -> Result<(), AttackError> {
        let flies = match (&self.state, &self.last) {
            (FighterState::Querying { .. }, _) => true,
            (FighterState::Dodging { t, .. }, Some(last)) => *t < last.ball.attack.end(),
            _ => false,
        };
        if flies {
            let number = self.throws;
            self.events.push(Event::Ignored { number });
            return Ok(());
        }
        let click = Click {
            baked: self.baked,
            playhead: self.playhead,
            camera,
            ray,
        };
        let ball = click.ball(&self.settings.ball)?;
        (self.replay, self.picked) = (None, None);
        self.throws += 1;
        self.events.push(Event::Throw {
            number: self.throws,
            from: ball.from.to_array(),
            target: ball.target.to_array(),
            at_body: ball.at_body,
            lead: self.settings.ball.lead,
            speed: self.settings.ball.speed,
            radius: self.settings.ball.radius,
        });
        let open = OpenThrow {
            number: self.throws,
            ball,
            playhead: self.playhead,
            settings: self.settings.query,
        };
        self.worker.ask(WorkerRequest {
            number: open.number,
            playhead: open.playhead,
            attack: open.ball.attack.clone(),
            settings: open.settings,
            culling: self.settings.culling,
            maps: self.chosen,
        });
        self.state = FighterState::Querying {
            open: Box::new(open),
            since: 0.0,
        };
        if self.settings.waits
            && let Some(response) = self.worker.wait()
        {
            self.hear(response);
        }
        Ok(())
    }

    /// Advances the simulation by some seconds.
    pub fn advance(&mut self, seconds: f32) {
        while let Some(response) = self.worker.poll() {
            self.hear(response);
        }
        let speed = self.speed();
        if let (Some(t), Some(last)) = (&mut self.replay, &self.last) {
            *t += seconds * speed;
            let [start, end] = last.dodge.span();
            if *t > end {
                self.replay = self.picked.is_some().then_some(start);
            }
            return;
        }
        let graph = self.baked.graph();
        let mut over = None;
        match &mut self.state {
            FighterState::Walking => self.walker.advance(graph, &mut self.playhead, seconds),
            // Beyond the next node the walk might leave the path that the answer starts from.
            FighterState::Querying { since, .. } => {
                let before = self.playhead.frame;
                self.walker
                    .advance_to_node(graph, &mut self.playhead, seconds);
                *since += (self.playhead.frame - before) / graph.frame_rate() as f32;
            }
            FighterState::Dodging { t, .. } => {
                *t += seconds * speed;
                over = Some(*t);
            }
        }
        if let Some(t) = over {
            self.go_on(t);
        }
    }

    /// Advances the dodge to a moment.
    fn go_on(&mut self, t: f32) {
        let graph = self.baked.graph();
        let (Some(last), FighterState::Dodging { seen, .. }) = (&self.last, &mut self.state) else {
            return;
        };
        self.playhead = last.motion.playhead(graph, t);
        if let Some(nearest) = last.dodge.nearest(t) {
            seen.nearest = seen.nearest.min(nearest.metres);
            seen.pictures += 1;
        }
        if t > last.ball.attack.end() && !seen.passed {
            seen.passed = true;
            self.events.push(Event::Passed {
                number: last.number,
                nearest: seen.nearest,
                pictures: seen.pictures,
            });
        }
        if t >= last.dodge.span()[1] {
            self.state = FighterState::Walking;
        }
    }

    /// Starts the dodge of a response, unless it belongs to another throw.
    fn hear(&mut self, response: WorkerResponse) {
        let FighterState::Querying { open, since } = &self.state else {
            return;
        };
        if open.number != response.number {
            return;
        }
        if let Some(why) = &response.trouble {
            self.events.push(Event::Trouble { why: why.clone() });
        }
        self.times.push_back(1e3 * response.seconds as f32);
        if self.times.len() > TIMES {
            self.times.pop_front();
        }
        // The baked maps, if the chosen ones cannot be drawn.
        let baked = self.choices.get(response.maps).unwrap_or(self.baked);
        let mut throw = Throw::new(baked, open, response);
        throw.dodge = throw.dodge.with_skin(self.skin().cloned());
        let t = *since;
        self.events.push(throw.event());
        self.last = Some(throw);
        self.state = FighterState::Dodging {
            t,
            seen: BallProgress {
                nearest: f32::INFINITY,
                pictures: 0,
                passed: false,
            },
        };
    }

    /// Speed of time: slower while the ball is near.
    fn speed(&self) -> f32 {
        let (Some(t), Some(last)) = (self.moment(), &self.last) else {
            return 1.0;
        };
        let slow = self.settings.near_speed.clamp(0.02, 1.0);
        let away = ((t - last.dodge.clearance().time).abs() - 0.10) / 0.25;
        slow + (1.0 - slow) * smooth_step(away)
    }

    /// Joints of the fighter at the shown moment, in the world.
    pub fn joints(&self, out: &mut Vec<JointTransform>) {
        match (self.moment(), &self.last) {
            (Some(t), Some(last)) => last.dodge.joints(t, out),
            _ => {
                let (graph, mut pose) = (self.baked.graph(), Pose::default());
                self.playhead.pose(graph, &mut pose);
                forward_kinematics(graph.skeleton(), &pose, out);
            }
        }
    }

    /// Focus of the camera, in metres.
    #[must_use]
    pub fn focus(&self) -> Vec3 {
        let mut joints = Vec::new();
        self.joints(&mut joints);
        let root = joints[0].translation;
        Vec3::new(root.x, HIPS, root.z)
    }

    /// The nearest points of body and ball at the shown moment; `None` without a ball.
    #[must_use]
    pub fn nearest(&self) -> Option<Nearest> {
        self.last.as_ref()?.dodge.nearest(self.moment()?)
    }

    /// The scene to draw.
    #[must_use]
    pub fn shot(&self, camera: Camera) -> Shot {
        if let (Some(t), Some(last)) = (self.moment(), &self.last) {
            let mut shot = last.dodge.shot(t, camera);
            match &self.picked {
                Some((_, motion)) if t >= 0.0 => self.add_picked(motion, t, &mut shot),
                _ if self.settings.ghost => last.dodge.add_ghost(t, &mut shot),
                _ => {}
            }
            if let Some(style) = self.settings.maps {
                last.dodge.add_maps(t, style, &mut shot);
            }
            return shot;
        }
        let mut joints = Vec::new();
        self.joints(&mut joints);
        let root = joints[0].translation;
        let light = Light {
            shadow: Sphere::new(Vec3::new(root.x, 0.0, root.z), 3.5),
            ..Light::default()
        };
        let mut shot = Shot::new(camera, light);
        match self.skin() {
            Some(skin) => {
                shot.skinned.push(SkinnedBody::new(skin, &joints));
                self.figure.capsules(&joints, 1.0, &mut shot.occluders);
            }
            None => self.figure.capsules(&joints, 1.0, &mut shot.solids),
        }
        shot
    }

    /// Draws the fighter with a mesh that is bound to the graph's skeleton.
    pub fn wear(&mut self, outfit: Option<Arc<Outfit>>) {
        self.outfit = outfit;
    }

    /// Meshes of the fighter.
    #[must_use]
    pub fn meshes(&self) -> &[Mesh] {
        self.outfit.as_ref().map_or(&[], |outfit| &outfit.meshes)
    }

    fn skin(&self) -> Option<&Arc<Skin>> {
        Some(&self.outfit.as_ref()?.skins[0])
    }

    fn add_picked(&self, motion: &Motion, t: f32, shot: &mut Shot) {
        let (graph, mut pose, mut joints) = (self.baked.graph(), Pose::default(), Vec::new());
        motion.sample(graph, t, &mut pose);
        forward_kinematics(graph.skeleton(), &pose, &mut joints);
        match self.skin() {
            Some(skin) => shot.skinned.push(SkinnedBody {
                tint: OTHER.extend(1.0).to_array(),
                alpha: 0.45,
                ..SkinnedBody::new(skin, &joints)
            }),
            None => self.other.capsules(&joints, 0.45, &mut shot.ghosts),
        }
    }
}
