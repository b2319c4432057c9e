//! A fighter who walks its graph for ever, and dodges what is thrown.
//!
//! Source: Masaoka & Oshita, section 5: their test program.

use std::collections::VecDeque;

use glam::Vec3;

use super::aim::{Ball, BallSettings, aim};
use super::asker::{Asker, Question, Reply};
use super::event::Event;
use super::map_choices::{MapChoice, MapChoices};
use super::throw::Throw;
use super::walker::Walker;
use sabaki::anim::{JointTransform, Pose, forward_kinematics};
use sabaki::graph::{EdgeId, Motion, Playhead};
use sabaki::maps::BakedGraph;
use sabaki::math::Rigid2;
use sabaki::query::{AttackError, CullPath, QuerySettings};
use sabaki_draw::scene::{Camera, DodgeSettings, Figure, Light, Look, MapStyle, Nearest, Shot};

/// What can be changed while it goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FighterSettings {
    /// What is thrown by a click.
    pub ball: BallSettings,
    /// How queries are made.
    pub query: QuerySettings,
    /// Who culls.
    pub culling: CullPath,
    /// Whether it is shown what would have been without the dodge. Default yes.
    pub ghost: bool,
    /// Maps of the evasion that was chosen, if they are shown. Default not.
    pub maps: Option<MapStyle>,
    /// How fast time goes about the moment at which the ball is nearest. Default 0.35; 1 is as everywhere else.
    pub near_speed: f32,
    /// Whether an answer is waited for, so that everything happens at the same moment each time. Default no: time goes on as
    /// far as to the next node.
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

/// What it is doing.
enum Act {
    Walks,
    /// A ball was thrown, so many seconds ago; the answer is not there yet.
    Asks {
        open: Box<Open>,
        since: f32,
    },
    /// So many seconds after the click of the last throw.
    Dodges {
        t: f32,
        seen: Seen,
    },
}

/// A throw that waits for its answer.
struct Open {
    number: u32,
    ball: Ball,
    playhead: Playhead,
    settings: QuerySettings,
}

/// What was shown of a ball so far.
#[derive(Clone, Copy)]
struct Seen {
    nearest: f32,
    pictures: u32,
    passed: bool,
}

/// The fighter, and the last throw.
pub struct Fighter<'a> {
    /// May be changed at any time; a query takes them as they are when the ball is thrown.
    pub settings: FighterSettings,
    baked: &'a BakedGraph,
    choices: &'a MapChoices<'a>,
    chosen: MapChoice,
    asker: Asker,
    figure: Figure,
    other: Figure,
    walker: Walker,
    playhead: Playhead,
    act: Act,
    last: Option<Throw<'a>>,
    throws: u32,
    replay: Option<f32>,
    /// A candidate of the last throw, and its motion.
    picked: Option<(usize, Motion)>,
    times: VecDeque<f32>,
    events: Vec<Event>,
}

/// So many of the last queries' times are kept.
const TIMES: usize = 60;
/// Of a candidate that was not chosen.
const OTHER: Vec3 = Vec3::new(0.95, 0.42, 0.02);
/// The root is roughly so high, metres.
const HIPS: f32 = 0.92;

impl<'a> Fighter<'a> {
    /// At the graph's first posture, at the origin. `seed`: which way it walks.
    #[must_use]
    pub fn new(
        choices: &'a MapChoices<'a>,
        asker: Asker,
        (settings, seed): (FighterSettings, u64),
    ) -> Self {
        let baked = choices.baked();
        let graph = baked.graph();
        let figure = Figure::of(graph.skeleton(), baked.body(), &Look::default());
        Self {
            settings,
            baked,
            choices,
            chosen: MapChoice::default(),
            asker,
            other: figure.clone().coloured(OTHER),
            figure,
            walker: Walker::new(seed),
            playhead: Playhead::at(graph, EdgeId(0), 0.0, Rigid2::IDENTITY),
            act: Act::Walks,
            last: None,
            throws: 0,
            replay: None,
            picked: None,
            times: VecDeque::new(),
            events: Vec::new(),
        }
    }

    /// The graph that it walks.
    #[must_use]
    pub fn baked(&self) -> &'a BakedGraph {
        self.baked
    }

    /// The maps that queries may use.
    #[must_use]
    pub fn map_choices(&self) -> &'a MapChoices<'a> {
        self.choices
    }

    /// Those that the next query uses.
    #[must_use]
    pub fn maps(&self) -> MapChoice {
        self.chosen
    }

    /// From the next throw on queries use these maps; they are drawn meanwhile.
    pub fn choose_maps(&mut self, maps: MapChoice) {
        self.chosen = maps;
        self.asker.draw(maps);
    }

    /// The last throw that was answered.
    #[must_use]
    pub fn last(&self) -> Option<&Throw<'a>> {
        self.last.as_ref()
    }

    /// Milliseconds of the last queries, the latest one last.
    pub fn query_times(&self) -> impl ExactSizeIterator<Item = f32> + '_ {
        self.times.iter().copied()
    }

    /// What has happened since it was asked last.
    pub fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }

    /// Whether a query is not answered yet.
    #[must_use]
    pub fn is_asking(&self) -> bool {
        matches!(self.act, Act::Asks { .. })
    }

    /// Whether the last throw is shown once more.
    #[must_use]
    pub fn is_replaying(&self) -> bool {
        self.replay.is_some()
    }

    /// The moment of the last throw that is shown, seconds since its click; `None` while it walks.
    #[must_use]
    pub fn moment(&self) -> Option<f32> {
        match (self.replay, &self.act) {
            (Some(t), _) => Some(t),
            (None, Act::Dodges { t, .. }) => Some(*t),
            _ => None,
        }
    }

    /// Shows the last throw once more, from its start; or no longer, where it does.
    pub fn replay(&mut self) {
        self.replay = match (self.replay, &self.last) {
            (None, Some(last)) => Some(last.dodge.span().0),
            _ => None,
        };
    }

    /// Which candidate of the last throw is shown beside what was chosen.
    #[must_use]
    pub fn picked(&self) -> Option<usize> {
        self.picked.as_ref().map(|(index, _)| *index)
    }

    /// Shows a candidate of the last throw, in a replay that goes on until none is shown; or none.
    pub fn pick(&mut self, candidate: Option<usize>) {
        self.picked = candidate.and_then(|index| {
            let last = self.last.as_ref()?;
            let report = last.answer().candidates.get(index)?;
            let (from, until) = ((self.baked, last.playhead), last.dodge.span().1);
            Some((index, last.answer().motion_of(from, report, until)?))
        });
        if self.picked.is_none() {
            self.replay = None;
        } else if self.moment().is_none() {
            self.replay();
        }
    }

    /// Throws a ball at what `camera` sees in the direction `ray`, unless one is on its way.
    ///
    /// # Errors
    /// Settings of the ball that make no attack.
    pub fn throw(&mut self, camera: &Camera, ray: Vec3) -> Result<(), AttackError> {
        let flies = match (&self.act, &self.last) {
            (Act::Asks { .. }, _) => true,
            (Act::Dodges { t, .. }, Some(last)) => *t < last.ball.attack.end(),
            _ => false,
        };
        if flies {
            let number = self.throws;
            self.events.push(Event::Ignored { number });
            return Ok(());
        }
        let ball = aim(
            (self.baked, self.playhead),
            (camera, ray),
            &self.settings.ball,
        )?;
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
        let open = Open {
            number: self.throws,
            ball,
            playhead: self.playhead,
            settings: self.settings.query,
        };
        self.asker.ask(Question {
            number: open.number,
            playhead: open.playhead,
            attack: open.ball.attack.clone(),
            settings: open.settings,
            culling: self.settings.culling,
            maps: self.chosen,
        });
        self.act = Act::Asks {
            open: Box::new(open),
            since: 0.0,
        };
        if self.settings.waits
            && let Some(reply) = self.asker.wait()
        {
            self.hear(reply);
        }
        Ok(())
    }

    /// Time goes on, seconds.
    pub fn advance(&mut self, seconds: f32) {
        while let Some(reply) = self.asker.poll() {
            self.hear(reply);
        }
        let speed = self.speed();
        if let (Some(t), Some(last)) = (&mut self.replay, &self.last) {
            *t += seconds * speed;
            let (start, end) = last.dodge.span();
            if *t > end {
                self.replay = self.picked.is_some().then_some(start);
            }
            return;
        }
        let graph = self.baked.graph();
        let mut over = None;
        match &mut self.act {
            Act::Walks => self
                .walker
                .advance(graph, &mut self.playhead, (seconds, false)),
            // Beyond the next node it might have gone another way than the answer.
            Act::Asks { since, .. } => {
                let before = self.playhead.frame;
                self.walker
                    .advance(graph, &mut self.playhead, (seconds, true));
                *since += (self.playhead.frame - before) / graph.frame_rate() as f32;
            }
            Act::Dodges { t, .. } => {
                *t += seconds * speed;
                over = Some(*t);
            }
        }
        if let Some(t) = over {
            self.go_on(t);
        }
    }

    /// The dodge has come to a moment.
    fn go_on(&mut self, t: f32) {
        let graph = self.baked.graph();
        let (Some(last), Act::Dodges { seen, .. }) = (&self.last, &mut self.act) else {
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
        if t >= last.dodge.span().1 {
            self.act = Act::Walks;
        }
    }

    /// Takes up an answer, unless it is one to something else.
    fn hear(&mut self, reply: Reply) {
        let Act::Asks { open, since } = &self.act else {
            return;
        };
        if open.number != reply.number {
            return;
        }
        if let Some(why) = &reply.trouble {
            self.events.push(Event::Trouble { why: why.clone() });
        }
        self.times.push_back(1e3 * reply.seconds as f32);
        if self.times.len() > TIMES {
            self.times.pop_front();
        }
        let shown = DodgeSettings {
            ghost: false,
            ..DodgeSettings::default()
        };
        let case = (open.ball.clone(), open.playhead);
        // In the end the baked maps, where those that were chosen cannot be drawn.
        let baked = self.choices.get(reply.maps).unwrap_or(self.baked);
        let throw = Throw::new(baked, case, (reply, open.settings), &shown);
        let t = *since;
        self.events.push(throw.event());
        self.last = Some(throw);
        self.act = Act::Dodges {
            t,
            seen: Seen {
                nearest: f32::INFINITY,
                pictures: 0,
                passed: false,
            },
        };
    }

    /// How fast time goes: slower where the ball is near.
    fn speed(&self) -> f32 {
        let (Some(t), Some(last)) = (self.moment(), &self.last) else {
            return 1.0;
        };
        let slow = self.settings.near_speed.clamp(0.02, 1.0);
        let away = (((t - last.dodge.clearance().time).abs() - 0.10) / 0.25).clamp(0.0, 1.0);
        slow + (1.0 - slow) * away * away * (3.0 - 2.0 * away)
    }

    /// Its joints at the moment that is shown, in the world.
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

    /// What a camera follows, metres.
    #[must_use]
    pub fn focus(&self) -> Vec3 {
        let mut joints = Vec::new();
        self.joints(&mut joints);
        let root = joints[0].translation;
        Vec3::new(root.x, HIPS, root.z)
    }

    /// Where body and ball are nearest to each other in the picture; `None` while nothing flies.
    #[must_use]
    pub fn nearest(&self) -> Option<Nearest> {
        self.last.as_ref()?.dodge.nearest(self.moment()?)
    }

    /// The picture.
    #[must_use]
    pub fn shot(&self, camera: Camera) -> Shot {
        if let (Some(t), Some(last)) = (self.moment(), &self.last) {
            let mut shot = last.dodge.shot(t, camera);
            match &self.picked {
                Some((_, motion)) if t >= 0.0 => self.add_picked((motion, t), &mut shot),
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
            shadow: (Vec3::new(root.x, 0.0, root.z), 3.5),
            ..Light::default()
        };
        let mut shot = Shot::new(camera, light);
        self.figure.capsules(&joints, 1.0, &mut shot.solids);
        shot
    }

    fn add_picked(&self, (motion, t): (&Motion, f32), shot: &mut Shot) {
        let (graph, mut pose, mut joints) = (self.baked.graph(), Pose::default(), Vec::new());
        motion.sample(graph, t, &mut pose);
        forward_kinematics(graph.skeleton(), &pose, &mut joints);
        self.other.capsules(&joints, 0.45, &mut shot.ghosts);
    }
}
