//! A character that walks its graph without end and dodges the balls that the user throws by clicks.
//!
//! Source: Masaoka & Oshita, section 5: their test program, in which a ball flies to where the user clicks.

use std::cell::OnceCell;
use std::sync::Arc;
use std::time::Instant;

use egui::{CollapsingHeader, Color32, RichText, ScrollArea, Slider, Stroke};
use glam::{Vec2, Vec3};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use super::gui::{bars, write_beside};
use super::player::Times;
use super::{Drawn, Event, Scene, Seen, WindowError};
use sabaki::anim::{JointTransform, Pose, forward_kinematics};
use sabaki::graph::{EdgeId, Motion, MotionGraph, MotionStep, Playhead};
use sabaki::maps::{BakedGraph, SphereKey};
use sabaki::math::smooth_step;
use sabaki::math::{F32x16, Rigid2, Sphere};
use sabaki::query::cull::{Counted, CullInput, Overlap, cpu};
use sabaki::query::{
    Answer, Attack, AttackError, CandidateReport, CandidateResult, CullPath, Enumerate, Query,
    QueryContext, QuerySettings, Request,
};
use sabaki_draw::scene::{
    Actor, Camera, Dodge, DodgeSettings, Light, Look, Mesh, Nearest, Outfit, Shot,
};
use sabaki_fixtures::headless::{Cullers, Headless};
use sabaki_fixtures::throw::generator;

/// Settings of a [`ThrowScene`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThrowSettings {
    /// Time from the click to the throw of a ball, in seconds. Default: 0.9.
    pub lead: f32,
    /// Speed of a ball, in metres per second. Default: 9.
    pub speed: f32,
    /// Radius of a ball, in metres. Default: 0.09.
    pub radius: f32,
    /// Largest distance from the thrower to the target, in metres. Default: 3.2.
    pub distance: f32,
    /// Aims a ball at the place where the clicked part of the body will be on arrival if the character does not dodge.
    /// Default: true.
    pub ahead: bool,
    /// Settings of the queries.
    pub query: QuerySettings,
    /// Culling path.
    pub culling: CullPath,
    /// Shows the motion without the dodge, too. Default: true.
    pub ghost: bool,
    /// Whether the maps of the chosen evasion are shown. Default: false.
    pub maps: bool,
    /// Speed of time while the ball is near. Default: 0.35; 1 is real time.
    pub near_speed: f32,
}

impl Default for ThrowSettings {
    fn default() -> Self {
        Self {
            lead: 0.9,
            speed: 9.0,
            radius: 0.09,
            distance: 3.2,
            ahead: true,
            query: QuerySettings::default(),
            culling: CullPath::default(),
            ghost: true,
            maps: false,
            near_speed: 0.35,
        }
    }
}

/// A thrown ball with the answer to it.
pub struct Thrown<'a> {
    /// Attack of the ball; its time starts at the click.
    pub attack: Attack,
    /// Place of the character at the click.
    pub playhead: Playhead,
    /// Answer of the query, with all candidates.
    pub answer: Answer,
    /// Culling path that was used.
    pub culling: CullPath,
    /// Time of the query, in milliseconds.
    query_ms: f64,
    /// Why another path was used than requested.
    trouble: Option<String>,
    /// Motion and maps to draw.
    dodge: Dodge<'a>,
    /// Motion of the character, until everything that is shown is over.
    motion: Motion,
    lines: OnceCell<Vec<CandidateLine>>,
}

/// The part of a ball's flight that has been shown.
#[derive(Clone, Copy)]
struct Progress {
    /// Time since the click, in seconds.
    t: f32,
    nearest: f32,
    pictures: u32,
    passed: bool,
}

/// The character and the last throw.
pub struct ThrowScene<'a> {
    /// May change at any time; a query uses the settings of the moment of the throw.
    pub settings: ThrowSettings,
    baked: &'a BakedGraph,
    outfit: Option<Arc<Outfit>>,
    actor: Actor,
    walker: Walker,
    playhead: Playhead,
    last: Option<Thrown<'a>>,
    /// `None` while the character walks.
    dodging: Option<Progress>,
    throws: u32,
    /// The replayed moment of the last throw.
    replay: Option<f32>,
    /// A candidate of the last throw, and its motion.
    picked: Option<(usize, Motion)>,
    times: Times,
    events: Vec<Event>,
    context: QueryContext,
    cpu: cpu::Culler,
    cullers: Cullers,
}

/// Colour of a candidate that was not chosen.
const OTHER: Vec3 = Vec3::new(0.95, 0.42, 0.02);
/// Approximate height of the root, in metres.
const HIPS: f32 = 0.92;

impl<'a> ThrowScene<'a> {
    /// A character in the graph's first pose, at the origin. `seed` determines its walk.
    #[must_use]
    pub fn new(
        baked: &'a BakedGraph,
        outfit: Option<Arc<Outfit>>,
        settings: ThrowSettings,
        seed: u64,
    ) -> Self {
        let skin = outfit.as_ref().map(|outfit| outfit.skins[0].clone());
        Self {
            settings,
            baked,
            actor: Actor::new(baked, &Look::default(), skin),
            outfit,
            walker: Walker::new(seed),
            playhead: Playhead::at(baked.graph(), EdgeId(0), 0.0, Rigid2::IDENTITY),
            last: None,
            dodging: None,
            throws: 0,
            replay: None,
            picked: None,
            times: Times::default(),
            events: Vec::new(),
            context: QueryContext::default(),
            cpu: cpu::Culler::default().counting(Counted::FOR_A_CHOICE),
            cullers: Cullers::default(),
        }
    }

    /// The last throw.
    pub fn last(&self) -> Option<&Thrown<'a>> {
        self.last.as_ref()
    }

    /// Whether the last throw is replayed.
    pub fn is_replaying(&self) -> bool {
        self.replay.is_some()
    }

    /// The shown moment of the last throw, in seconds since its click; `None` while the character walks.
    pub fn moment(&self) -> Option<f32> {
        self.replay.or(self.dodging.map(|progress| progress.t))
    }

    /// Starts or stops the replay of the last throw.
    pub fn replay(&mut self) {
        self.replay = match (self.replay, &self.last) {
            (None, Some(last)) => Some(last.dodge.span()[0]),
            _ => None,
        };
    }

    /// The candidate of the last throw that is shown beside the chosen one.
    pub fn picked(&self) -> Option<usize> {
        self.picked.as_ref().map(|(index, _)| *index)
    }

    /// Shows a candidate of the last throw in a repeating replay; `None` ends it.
    pub fn pick(&mut self, candidate: Option<usize>) {
        self.picked = candidate.and_then(|index| {
            let last = self.last.as_ref()?;
            let report = last.answer.candidates.get(index)?;
            let mut motion = last.answer.motion_of(self.baked, last.playhead, report)?;
            motion.extend(self.baked.graph(), last.dodge.span()[1]);
            Some((index, motion))
        });
        if self.picked.is_none() {
            self.replay = None;
        } else if self.moment().is_none() {
            self.replay();
        }
    }

    /// Throws a ball in the direction `ray` of `camera`, unless one is flying. Without a device, the CPU culls.
    ///
    /// # Errors
    /// The settings of the ball make no attack.
    pub fn throw(
        &mut self,
        camera: &Camera,
        ray: Vec3,
        device: Option<&mut Headless>,
    ) -> Result<(), AttackError> {
        if let (Some(progress), Some(last)) = (self.dodging, &self.last)
            && progress.t < last.attack.end()
        {
            let number = self.throws;
            self.events.push(Event::Ignored { number });
            return Ok(());
        }
        let ball = self.settings;
        let (attack, [from, target], at_body) = aim(self.baked, self.playhead, camera, ray, &ball)?;
        (self.replay, self.picked) = (None, None);
        self.throws += 1;
        let number = self.throws;
        self.events.push(Event::Throw {
            number,
            from: from.to_array(),
            target: target.to_array(),
            at_body,
            lead: ball.lead,
            speed: ball.speed,
            radius: ball.radius,
        });
        let thrown = self.ask(attack, device);
        if let Some(why) = thrown.trouble.clone() {
            self.events.push(Event::Trouble { why });
        }
        self.times.add(thrown.query_ms as f32, 60);
        let event = thrown.event(number, &self.settings);
        self.events.push(event);
        self.last = Some(thrown);
        self.dodging = Some(Progress {
            t: 0.0,
            nearest: f32::INFINITY,
            pictures: 0,
            passed: false,
        });
        Ok(())
    }

    fn ask(&mut self, attack: Attack, mut device: Option<&mut Headless>) -> Thrown<'a> {
        let (baked, settings) = (self.baked, self.settings);
        let (mut answer, mut trouble, mut culling) = (Answer::default(), None, settings.culling);
        let query = Query::new(baked, &settings.query);
        let request = Request {
            evaluation: culling.evaluation(),
            ..Request::new(self.playhead, &attack)
        };
        let started = Instant::now();
        // Taken out while the session uses it.
        let mut context = std::mem::take(&mut self.context);
        let mut session = query.start(request, &mut context);
        let counted = session.run(&mut answer, |input, counts| {
            if culling.needs_device() {
                match self.count_on_device(culling, input, device.as_deref_mut()) {
                    Ok(counted) => {
                        *counts = counted;
                        return Ok(());
                    }
                    Err(why) => (culling, trouble) = (CullPath::Cpu, Some(why)),
                }
            }
            self.cpu.count(input, counts);
            Ok::<_, std::convert::Infallible>(())
        });
        let Ok(()) = counted;
        self.context = context;
        let query_ms = 1e3 * started.elapsed().as_secs_f64();
        let shown = DodgeSettings {
            ghost: false,
            ..DodgeSettings::default()
        };
        let dodge = Dodge::new(baked, self.playhead, &attack, &answer, &shown)
            .with_skin(self.actor.skin.clone());
        let mut motion = answer.motion.clone();
        motion.extend(baked.graph(), dodge.span()[1]);
        Thrown {
            playhead: self.playhead,
            culling,
            query_ms,
            trouble,
            dodge,
            motion,
            lines: OnceCell::new(),
            attack,
            answer,
        }
    }

    fn count_on_device(
        &mut self,
        path: CullPath,
        input: &CullInput<'_>,
        device: Option<&mut Headless>,
    ) -> Result<Vec<Overlap>, String> {
        let device = device.ok_or("there is no device")?;
        let culler = self.cullers.get(device, path, input.atlas);
        let counted = culler.and_then(|culler| device.cull(culler, input));
        counted.map_err(|error| error.to_string())
    }

    fn dodge_on(&mut self, seconds: f32) {
        let (Some(last), Some(progress)) = (&self.last, &mut self.dodging) else {
            return;
        };
        progress.t += seconds;
        let t = progress.t;
        self.playhead = last.motion.playhead(self.baked.graph(), t);
        if let Some(nearest) = last.dodge.nearest(t) {
            progress.nearest = progress.nearest.min(nearest.metres);
            progress.pictures += 1;
        }
        if t > last.attack.end() && !progress.passed {
            progress.passed = true;
            self.events.push(Event::Passed {
                number: self.throws,
                nearest: progress.nearest,
                pictures: progress.pictures,
            });
        }
        if t >= last.dodge.span()[1] {
            self.dodging = None;
        }
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

    /// Joints of the character at the shown moment, in the world.
    fn joints(&self) -> Vec<JointTransform> {
        let mut joints = Vec::new();
        match (self.moment(), &self.last) {
            (Some(t), Some(last)) => last.dodge.joints(t, &mut joints),
            _ => {
                let (graph, mut pose) = (self.baked.graph(), Pose::default());
                self.playhead.pose(graph, &mut pose);
                forward_kinematics(graph.skeleton(), &pose, &mut joints);
            }
        }
        joints
    }

    /// The nearest points of body and ball at the shown moment; `None` without a ball.
    fn nearest(&self) -> Option<Nearest> {
        self.last.as_ref()?.dodge.nearest(self.moment()?)
    }

    /// What `camera` sees.
    pub fn shot(&self, camera: Camera) -> Shot {
        if let (Some(t), Some(last)) = (self.moment(), &self.last) {
            let mut shot = last.dodge.shot(t, camera);
            match &self.picked {
                Some((_, motion)) if t >= 0.0 => {
                    let joints = joints_at(self.baked.graph(), motion, t);
                    self.actor.add(&joints, Some(OTHER), 0.45, &mut shot);
                }
                _ if self.settings.ghost => last.dodge.add_ghost(t, &mut shot),
                _ => {}
            }
            if self.settings.maps {
                last.dodge.add_maps(t, &mut shot);
            }
            return shot;
        }
        let joints = self.joints();
        let light = Light {
            shadow: Sphere::new(joints[0].translation.with_y(0.0), 3.5),
            ..Light::default()
        };
        let mut shot = Shot::new(camera, light);
        self.actor.add(&joints, None, 1.0, &mut shot);
        self.actor.shade(&joints, &mut shot);
        shot
    }
}

fn joints_at(graph: &MotionGraph, motion: &Motion, t: f32) -> Vec<JointTransform> {
    let (mut pose, mut joints) = (Pose::default(), Vec::new());
    motion.sample(graph, t, &mut pose);
    forward_kinematics(graph.skeleton(), &pose, &mut joints);
    joints
}

/// The attack of a ball that a click in the direction `ray` of a camera throws at a character, its start and its target in the world, and
/// whether it is aimed at the body.
///
/// # Errors
/// Settings that make no attack: a radius or a speed that is not above 0, a lead below 0.
fn aim(
    baked: &BakedGraph,
    playhead: Playhead,
    camera: &Camera,
    ray: Vec3,
    settings: &ThrowSettings,
) -> Result<(Attack, [Vec3; 2], bool), AttackError> {
    /// Distance that a ball flies on behind its target, in metres.
    const BEYOND: f32 = 1.6;
    /// Offset of the throwing hand from the eye, to the right and down, in metres.
    const HAND: (f32, f32) = (0.75, 0.35);
    let graph = baked.graph();
    let mut idle = Motion::new(graph, playhead, &[]);
    let now = joints_at(graph, &idle, 0.0);
    let (sphere, mut target) = target_of(baked, &now, camera.eye, ray);
    target.y = target.y.max(settings.radius);
    // The hand is beside the eye, or nearer to the target if the eye is far away.
    let right = ray.cross(Vec3::Y).normalize_or(Vec3::X);
    let beside = camera.eye + right * HAND.0 - Vec3::Y * HAND.1;
    let away = (beside - target).clamp_length_max(settings.distance.max(0.5));
    let from = target + away;
    let from = from.with_y(from.y.max(settings.radius));
    let arrives = settings.lead + from.distance(target) / settings.speed;
    if let Some(sphere) = sphere.map(|index| baked.body().spheres[index])
        && settings.ahead
        && arrives.is_finite()
    {
        idle.extend(graph, arrives.min(Attack::LATEST));
        let then = joints_at(graph, &idle, arrives);
        let joint = sphere.joint.index();
        target += then[joint].point(sphere.offset) - now[joint].point(sphere.offset);
        target.y = target.y.max(settings.radius);
    }
    let flight = (target - from).normalize_or(ray);
    // The ball ends above the floor.
    let beyond = match flight.y < -1e-3 {
        true => BEYOND.min(((target.y - settings.radius) / -flight.y).max(0.05)),
        false => BEYOND,
    };
    let key = |metres: f32| SphereKey {
        t: settings.lead + metres / settings.speed,
        center: from + flight * metres,
        radius: settings.radius,
    };
    let keys = vec![key(0.0), key(from.distance(target) + beyond)];
    Ok((Attack::new(vec![keys])?, [from, target], sphere.is_some()))
}

/// The target of a ray from the eye: on a sphere of the body (its index) the point of the ray nearest to its centre, else on the plane
/// through the body's root that faces the eye.
fn target_of(
    baked: &BakedGraph,
    joints: &[JointTransform],
    eye: Vec3,
    ray: Vec3,
) -> (Option<usize>, Vec3) {
    let mut centres = Vec::new();
    baked.body().centres(joints, &mut centres);
    let spheres = centres.iter().zip(&baked.body().spheres).enumerate();
    let met = spheres.filter_map(|(index, (centre, sphere))| {
        let along = (*centre - eye).dot(ray);
        let nearest = eye + along * ray;
        let within = along > 0.0 && nearest.distance(*centre) <= sphere.radius;
        within.then_some((along, index, nearest))
    });
    if let Some((_, index, place)) = met.min_by(|a, b| a.0.total_cmp(&b.0)) {
        return (Some(index), place);
    }
    let root = joints[0].translation;
    let across = (root - eye).with_y(0.0).normalize_or(Vec3::Z);
    let slope = ray.dot(across);
    let along = match slope > 0.05 {
        true => (root - eye).dot(across) / slope,
        // The ray is almost parallel to the plane: the point at the root's distance.
        false => root.distance(eye),
    };
    (None, eye + along * ray)
}

impl Thrown<'_> {
    fn event(&self, number: u32, settings: &ThrowSettings) -> Event {
        let (clearance, counts) = (self.answer.clearance(), self.answer.counts);
        let chosen = self.answer.candidates.get(self.answer.chosen);
        let evades = chosen.is_some_and(|chosen| chosen.evasion.is_some());
        Event::Answer {
            number,
            avoided: self.answer.avoided,
            chosen: if evades { "evasion" } else { "move" },
            clearance: clearance.metres,
            nearest_at: clearance.time,
            source: self.answer.source,
            candidates: counts.candidates,
            culled: counts.culled,
            hits: counts.hits,
            clean: counts.clean,
            cull: self.culling.name(),
            grid: settings.query.enumerate.uses_grid(),
            query_ms: self.query_ms,
        }
    }
}

/// Walks a graph for ever: mostly along the clips, sometimes along a transition, and back home from far away.
struct Walker {
    random: Pcg64Mcg,
}

impl Walker {
    fn new(seed: u64) -> Self {
        Self {
            random: generator(seed, 0),
        }
    }

    fn advance(&mut self, graph: &MotionGraph, playhead: &mut Playhead, seconds: f32) {
        playhead.frame += seconds.max(0.0) * graph.frame_rate() as f32;
        loop {
            let over = playhead.frame - graph.edge(playhead.edge).frames as f32;
            if over < 0.0 {
                return;
            }
            *playhead = Playhead {
                edge: self.next_edge(graph, playhead),
                frame: over,
                clip_to_world: playhead.next_clip_to_world(graph),
            };
        }
    }

    fn next_edge(&mut self, graph: &MotionGraph, playhead: &Playhead) -> EdgeId {
        /// Largest distance from the origin, in metres.
        const LEASH: f32 = 1.2;
        /// Time that is looked ahead, in seconds.
        const AHEAD: f32 = 1.5;
        /// Number of transitions that are considered: the closest ones.
        const EDGES: usize = 12;
        /// Share of the nodes at which it leaves the clip although the clip goes on.
        const WHIMS: f32 = 0.3;
        let node = playhead.next_node(graph);
        let at_node = Playhead {
            frame: graph.edge(playhead.edge).frames as f32,
            ..*playhead
        };
        let away = |edge: EdgeId| {
            let mut motion = Motion::new(graph, at_node, &[MotionStep { edge, rate: 1.0 }]);
            motion.extend(graph, AHEAD);
            let root: Vec3 = motion.root(graph, AHEAD);
            Vec2::new(root.x, root.z).length()
        };
        // The clip's own edge first, then the closest transitions.
        let cost = |edge: &EdgeId| graph.edge(*edge).motion.distance();
        let mut edges: Vec<EdgeId> = graph.edges_from(node).collect();
        edges.sort_by(|a, b| cost(a).total_cmp(&cost(b)).then(a.0.cmp(&b.0)));
        edges.truncate(EDGES);
        let mut wanted = graph.natural_edge(node);
        if self.random.random::<f32>() < WHIMS {
            wanted = edges[self.random.random_range(0..edges.len())];
        }
        if away(wanted) <= LEASH {
            return wanted;
        }
        let nearest = edges.into_iter().map(|edge| (away(edge), edge));
        let nearest = nearest.min_by(|a, b| a.0.total_cmp(&b.0));
        nearest.map_or(wanted, |(_, edge)| edge)
    }
}

impl Scene for ThrowScene<'_> {
    fn meshes(&self) -> &[Mesh] {
        self.outfit.as_ref().map_or(&[], |outfit| &outfit.meshes)
    }

    fn advance(&mut self, seconds: f32) {
        let speed = self.speed();
        if let (Some(t), Some(last)) = (&mut self.replay, &self.last) {
            *t += seconds * speed;
            let [start, end] = last.dodge.span();
            if *t > end {
                self.replay = self.picked.is_some().then_some(start);
            }
        } else if self.dodging.is_some() {
            self.dodge_on(seconds * speed);
        } else {
            self.walker
                .advance(self.baked.graph(), &mut self.playhead, seconds);
        }
    }

    fn focus(&self) -> Vec3 {
        self.joints()[0].translation.with_y(HIPS)
    }

    fn distance(&self) -> f32 {
        4.6
    }

    fn draw(&mut self, camera: Camera, _: [u32; 2], _: &mut [F32x16]) -> Drawn {
        Ok((self.shot(camera), None))
    }

    fn click(
        &mut self,
        camera: &Camera,
        ray: Vec3,
        device: &mut Headless,
    ) -> Result<(), WindowError> {
        Ok(self.throw(camera, ray, Some(device))?)
    }

    fn key(&mut self, key: &str, is_down: bool) -> bool {
        let settings = &mut self.settings;
        match key {
            "r" | "g" | "m" if !is_down => {}
            "r" => self.replay(),
            "g" => settings.ghost = !settings.ghost,
            "m" => settings.maps = !settings.maps,
            _ => return false,
        }
        true
    }

    fn keys(&self) -> &'static [(&'static str, &'static str)] {
        &[
            ("r", "replay of the last throw"),
            ("m", "maps of the evasion"),
            ("g", "ghost of who did nothing"),
        ]
    }

    fn panel(&mut self, ui: &mut egui::Ui) {
        let section = |name| CollapsingHeader::new(RichText::new(name).strong()).default_open(true);
        self.add_state(ui);
        section("Last query").show(ui, |ui| self.add_last(ui));
        section("Candidates").show(ui, |ui| self.add_candidates(ui));
        section("Throw").show(ui, |ui| self.add_sliders(ui));
        section("Query").show(ui, |ui| self.add_query(ui));
    }

    fn label(&self, painter: &egui::Painter, seen: Seen<'_>) {
        let Some(nearest) = self.nearest().filter(|one| one.metres < 0.6) else {
            return;
        };
        let (Some(body), Some(ball)) = (seen(nearest.body), seen(nearest.attack)) else {
            return;
        };
        let centimetres = 100.0 * nearest.metres;
        let (text, colour) = match centimetres {
            hit if hit < 0.0 => (
                format!("hit, {:.1} cm deep", -hit),
                Color32::from_rgb(170, 0, 0),
            ),
            near if near < 10.0 => (format!("{near:.1} cm"), Color32::from_rgb(150, 45, 0)),
            far => (format!("{far:.1} cm"), Color32::from_rgb(30, 36, 48)),
        };
        painter.line_segment([body, ball], Stroke::new(2.0, colour));
        write_beside(painter, ball + egui::vec2(26.0, -34.0), text, colour);
    }

    fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }

    fn close(&mut self, device: &mut Headless) {
        self.cullers.destroy(device);
    }
}

impl ThrowScene<'_> {
    fn add_state(&mut self, ui: &mut egui::Ui) {
        let is_replaying = self.is_replaying();
        let text = match (self.moment(), is_replaying) {
            (Some(t), true) => format!("replay {t:+.2} s"),
            (Some(t), false) => format!("dodging {t:+.2} s"),
            _ => "walking: click at it".to_owned(),
        };
        ui.horizontal(|ui| {
            ui.label(text);
            let button = egui::Button::new(if is_replaying { "end" } else { "replay" });
            if ui.add_enabled(self.last.is_some(), button).clicked() {
                self.pick(None);
                if !is_replaying {
                    self.replay();
                }
            }
        });
    }

    fn add_last(&mut self, ui: &mut egui::Ui) {
        let Some(last) = &self.last else {
            ui.label(RichText::new("nothing was thrown yet").weak());
            return;
        };
        let (answer, counts) = (&last.answer, last.answer.counts);
        let (word, colour) = match answer.avoided {
            true => ("avoided", Color32::from_rgb(120, 215, 130)),
            false => ("hit", Color32::from_rgb(245, 110, 90)),
        };
        ui.horizontal(|ui| {
            ui.label(RichText::new(word).strong().color(colour));
            let clearance = answer.clearance();
            let (centimetres, t) = (100.0 * clearance.metres, clearance.time);
            ui.label(format!("{centimetres:.1} cm at {t:+.2} s"));
        });
        ui.label(format!("candidates from {}", answer.source.describe()));
        ui.label(format!(
            "{} candidates: {} culled, {} hit, {} clean",
            counts.candidates, counts.culled, counts.hits, counts.clean
        ));
        ui.label(format!(
            "{:.2} ms by {}",
            last.query_ms,
            last.culling.name()
        ));
        if let Some(why) = &last.trouble {
            let orange = Color32::from_rgb(245, 170, 90);
            ui.label(RichText::new(why).small().color(orange));
        }
        bars(ui, &self.times);
    }

    /// The candidates of the last throw. A click on a line shows the candidate as a ghost; another click hides it.
    fn add_candidates(&mut self, ui: &mut egui::Ui) {
        /// Height of a line, in points, and number of visible lines.
        const LINE: f32 = 13.0;
        const LINES: f32 = 11.0;
        let Some(last) = &self.last else {
            ui.label(RichText::new("click one of them to see its ghost").weak());
            return;
        };
        let head = format!(
            "{:<9} {:>4} {:>5} {:>5} {:>4} {:>5}",
            "result", "p", "V_a", "V_d", "V_t", "V"
        );
        ui.label(RichText::new(head).monospace().size(11.0).weak());
        let graph = self.baked.graph();
        let lines = last.lines.get_or_init(|| lines(graph, &last.answer));
        let before = self.picked();
        let mut picked = before;
        ScrollArea::vertical()
            .id_salt("candidates")
            .max_height((LINE + 4.0) * LINES)
            .auto_shrink([false, true])
            .show_rows(ui, LINE, lines.len(), |ui, rows| {
                for line in &lines[rows] {
                    let is_picked = picked == Some(line.candidate);
                    let text = RichText::new(&line.text).monospace().size(11.0);
                    let label = ui.selectable_label(is_picked, text.color(line.colour));
                    if label.on_hover_text(&line.name).clicked() {
                        picked = (!is_picked).then_some(line.candidate);
                    }
                }
            });
        if picked != before {
            self.pick(picked);
        }
    }

    fn add_sliders(&mut self, ui: &mut egui::Ui) {
        let settings = &mut self.settings;
        let mut slide = |value: &mut f32, (low, high): (f32, f32), text: &str| {
            ui.add(Slider::new(value, low..=high).text(text).max_decimals(2));
        };
        slide(&mut settings.speed, (2.0, 20.0), "speed, m/s");
        slide(&mut settings.radius, (0.03, 0.25), "radius, m");
        slide(&mut settings.lead, (0.0, 2.0), "lead, s");
        slide(&mut settings.distance, (1.0, 6.0), "distance, m");
        slide(&mut settings.near_speed, (0.05, 1.0), "time near it");
        ui.checkbox(&mut settings.ahead, "aim at where the body will be");
        ui.checkbox(&mut settings.ghost, "ghost of who does nothing");
        ui.checkbox(&mut settings.maps, "maps of the evasion");
    }

    fn add_query(&mut self, ui: &mut egui::Ui) {
        let settings = &mut self.settings;
        ui.horizontal(|ui| {
            for culling in CullPath::ALL {
                ui.selectable_value(&mut settings.culling, culling, culling.name());
            }
        });
        let enumerate = &mut settings.query.enumerate;
        ui.horizontal(|ui| {
            for (value, name) in [
                (Enumerate::Whole, "no grid"),
                (Enumerate::TouchedCells, "all cells"),
                (Enumerate::NearestFiledCell, "nearest with a path"),
                (Enumerate::NearestCell, "nearest"),
            ] {
                ui.selectable_value(enumerate, value, name);
            }
        });
        let weights = &mut settings.query.weights;
        let mut slide = |value: &mut f32, text: &str| {
            ui.add(Slider::new(value, 0.0..=8.0).text(text).max_decimals(1));
        };
        slide(&mut weights.avoid, "w_a, region");
        slide(&mut weights.distance, "w_d, clearance");
        slide(&mut weights.time, "w_t, rate");
    }
}

struct CandidateLine {
    candidate: usize,
    text: String,
    colour: Color32,
    name: String,
}

/// The lines of an answer's candidates, by their results and scores.
fn lines(graph: &MotionGraph, answer: &Answer) -> Vec<CandidateLine> {
    let all = answer.candidates.iter().enumerate();
    let mut lines: Vec<((u8, f32), CandidateLine)> = all
        .map(|(candidate, report)| {
            let (rank, result, colour) = match report.result {
                CandidateResult::Chosen => (0, "chosen", Color32::from_rgb(130, 225, 140)),
                CandidateResult::Outscored => (1, "outscored", Color32::from_gray(205)),
                CandidateResult::Hit => (2, "hit", Color32::from_rgb(240, 115, 95)),
                CandidateResult::TooHard => (3, "too hard", Color32::from_rgb(200, 150, 215)),
                CandidateResult::Culled => (4, "culled", Color32::from_rgb(225, 175, 90)),
                CandidateResult::NotInTime => (5, "late", Color32::from_gray(120)),
            };
            let total = report.score.map_or(f32::INFINITY, |score| score.total);
            let event = report.evasion.map(|edge| graph.edge(edge).event);
            let line = CandidateLine {
                candidate,
                text: line(report, result),
                colour,
                name: match event {
                    None => "only moves".to_owned(),
                    Some(event) => event.map_or_else(String::new, |event| {
                        graph.describe_event(graph.event(event))
                    }),
                },
            };
            ((rank, total), line)
        })
        .collect();
    lines.sort_by(|(a, _), (b, _)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    lines.into_iter().map(|(_, line)| line).collect()
}

fn line(report: &CandidateReport, result: &str) -> String {
    let rate = match report.rate {
        Ok(rate) => format!("{:.2}", rate.rate),
        Err(_) => "-".to_owned(),
    };
    match (report.score, report.clearance) {
        (Some(score), _) => format!(
            "{result:<9} {rate:>4} {:>5.2} {:>5.2} {:>4.2} {:>5.2}",
            score.avoid, score.distance, score.time, score.total
        ),
        (None, Some(hit)) => format!("{result:<9} {rate:>4}  {:.1} cm deep", -100.0 * hit.metres),
        (None, None) => match report.overlap.filter(|overlap| overlap.body > 0) {
            Some(overlap) => format!("{result:<9} {rate:>4}  {} texels met", overlap.body),
            None => format!("{result:<9} {rate:>4}"),
        },
    }
}
