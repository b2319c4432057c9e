//! Plays back a duel: the attack and the answer of each exchange, from a separate camera.

use std::sync::Arc;

use glam::Vec3;

use super::camera::film_times;
use super::{Actor, Camera, Capsule, Light, Look, Shot, Skin};
use sabaki::anim::{JointId, JointTransform, Pose, forward_kinematics};
use sabaki::graph::EdgeId;
use sabaki::maps::BakedGraph;
use sabaki::math::{Sphere, smooth_step};

/// Duration shown before an attack's start and after its end, in seconds.
const BEFORE: f32 = 0.75;
const AFTER: f32 = 0.45;
/// Playback speed when an attack is nearest, relative to real time.
const SLOWEST: f32 = 0.3;

/// Poses of two fighters at equal intervals, from the duel's start on.
#[derive(Clone, Debug)]
pub struct Played {
    /// Time between two frames, in seconds.
    pub step: f32,
    /// Both fighters' poses, frame by frame; at least one.
    pub frames: Vec<[Pose; 2]>,
}

/// A strike and how it ended. Times count from the duel's start, in seconds.
#[derive(Clone, Debug, PartialEq)]
pub struct Exchange {
    /// The fighter that strikes: 0 for white, 1 for blue.
    pub attacker: usize,
    /// Edge of the attack.
    pub attack: EdgeId,
    /// The strike begins, and the limb is a threat.
    pub announced: f32,
    /// The limb has reached furthest.
    pub contact: f32,
    /// Start and end of the attack.
    pub span: [f32; 2],
    /// Spheres of the limb at equal intervals, from the start of the attack to its end.
    pub limb: Vec<Vec<Sphere>>,
    /// Smallest distance of limb and body, in metres; negative for a hit. `None` if the limb never came near.
    pub clearance: Option<f32>,
    /// Time at which they are nearest.
    pub nearest_at: f32,
    /// Edge of the evasion by which the limb was avoided, if it was one.
    pub by: Option<EdgeId>,
}

impl Exchange {
    /// Whether the strike was avoided.
    pub fn is_avoided(&self) -> bool {
        self.clearance.is_none_or(|metres| metres >= 0.0)
    }

    /// Name of the fighter that strikes.
    pub fn attacker_name(&self) -> &'static str {
        ["white", "blue"][self.attacker]
    }
}

/// The playback of a duel's exchanges.
#[derive(Clone, Debug)]
pub struct DuelPlayback<'a> {
    baked: &'a BakedGraph,
    played: &'a Played,
    exchanges: &'a [Exchange],
    actors: [Actor; 2],
}

/// The part of an exchange that is shown, with its camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// Index of the exchange.
    pub exchange: usize,
    /// First and last time, in seconds since the duel's start.
    pub span: [f32; 2],
    /// Camera, which does not move.
    pub camera: Camera,
}

const ATTACK: Vec3 = Vec3::new(0.93, 0.10, 0.03);

impl<'a> DuelPlayback<'a> {
    /// Creates the playback of a duel, or of a part of one: the exchanges to show, and what was played.
    #[must_use]
    pub fn new(baked: &'a BakedGraph, played: &'a Played, exchanges: &'a [Exchange]) -> Self {
        Self {
            baked,
            played,
            exchanges,
            actors: Look::fighters().map(|look| Actor::new(baked, &look, None)),
        }
    }

    /// Draws the fighters with meshes that are bound to the graph's skeleton.
    #[must_use]
    pub fn with_skins(mut self, skins: Option<[Arc<Skin>; 2]>) -> Self {
        for (actor, skin) in self.actors.iter_mut().zip(skins.into_iter().flatten()) {
            actor.skin = Some(skin);
        }
        self
    }

    /// Time at which the cut of an exchange ends, in seconds since the duel's start.
    #[must_use]
    pub fn end(exchange: &Exchange) -> f32 {
        exchange.span[1] + AFTER
    }

    /// One cut for each exchange. Cuts do not overlap.
    pub fn cuts(&self, aspect: f32) -> Vec<Cut> {
        let mut shown = 0.0;
        let mut cuts = Vec::with_capacity(self.exchanges.len());
        for (index, exchange) in self.exchanges.iter().enumerate() {
            let start = exchange.span[0] - BEFORE;
            let span = [start.max(shown), Self::end(exchange)];
            shown = span[1];
            cuts.push(Cut {
                exchange: index,
                span,
                camera: self.camera(exchange, span, aspect),
            });
        }
        cuts
    }

    /// Time at which an exchange's attack is nearest to the defender, in seconds since the duel's
    /// start.
    pub fn nearest_at(&self, cut: &Cut) -> f32 {
        self.exchanges[cut.exchange].nearest_at
    }

    /// Times of the pictures of a cut's film with `rate` pictures per second, 1 to 1,000. Playback slows down
    /// when the attack is nearest.
    pub fn moments(&self, cut: &Cut, rate: f32) -> Vec<f32> {
        film_times(cut.span, rate, |t| self.pace(cut, t))
    }

    /// Playback speed at a time. It is lower when the attack is nearest.
    pub fn pace(&self, cut: &Cut, t: f32) -> f32 {
        let eased = smooth_step(((t - self.nearest_at(cut)).abs() - 0.05) / 0.25);
        SLOWEST + (1.0 - SLOWEST) * eased
    }

    /// Frames of a fighter's joints at a time, in the world. Between two frames they go straight.
    pub fn joints(&self, fighter: usize, t: f32, out: &mut Vec<JointTransform>) {
        let (skeleton, frames) = (self.baked.graph().skeleton(), &self.played.frames);
        let at = (t / self.played.step).clamp(0.0, (frames.len() - 1) as f32);
        let (before, mut after) = (at as usize, Vec::new());
        forward_kinematics(skeleton, &frames[before][fighter], out);
        let next = &frames[(before + 1).min(frames.len() - 1)][fighter];
        forward_kinematics(skeleton, next, &mut after);
        let share = at - before as f32;
        for (joint, after) in out.iter_mut().zip(after) {
            joint.translation = joint.translation.lerp(after.translation, share);
            joint.rotation = joint.rotation.slerp(after.rotation, share);
        }
    }

    /// Camera beside the fighters, on the side of the attacking limb, that shows both during the
    /// whole cut.
    fn camera(&self, exchange: &Exchange, span: [f32; 2], aspect: f32) -> Camera {
        let (mut joints, near) = (Vec::new(), exchange.nearest_at);
        let [a, b] = [exchange.attacker, 1 - exchange.attacker].map(|fighter| {
            self.joints(fighter, near, &mut joints);
            joints[0]
        });
        let along = b.translation - a.translation;
        let along = Vec3::new(along.x, 0.0, along.z).normalize_or(Vec3::Z);
        let across = Vec3::new(along.z, 0.0, -along.x);
        let limb = attacking_limb(exchange, near);
        let side = (limb - a.translation).dot(across);
        let across = if side < 0.0 { -across } else { across };
        // Slightly behind the attacker, because the defender's answer is of interest.
        let out = (across - 0.22 * along).normalize_or(Vec3::Z);
        let around = |joint: &JointTransform| Sphere::new(joint.translation, 0.1);
        let mut seen = Vec::new();
        for step in 0..=24 {
            let t = span[0] + (span[1] - span[0]) * step as f32 / 24.0;
            for fighter in 0..2 {
                self.joints(fighter, t, &mut joints);
                seen.extend(joints.iter().map(around));
            }
        }
        let middle = 0.5 * (a.translation + b.translation);
        // Leave space for text at the top.
        Camera::framing(middle, out, 0.14, &seen, aspect, [0.54, 0.25, 0.06])
    }

    /// Shot of a time in a cut.
    pub fn shot(&self, cut: &Cut, t: f32) -> Shot {
        let exchange = &self.exchanges[cut.exchange];
        let (mut joints, mut middle) = (Vec::new(), Vec3::ZERO);
        let mut shot = Shot::new(cut.camera, Light::default());
        for (fighter, actor) in self.actors.iter().enumerate() {
            self.joints(fighter, t, &mut joints);
            middle += 0.5 * joints[0].translation;
            if fighter == exchange.attacker {
                let tint = ATTACK.extend(heat(exchange, t)).to_array();
                let weights = self.attacking(exchange);
                actor.add_tinted(&joints, tint, &weights, 1.0, &mut shot);
            } else {
                actor.add(&joints, None, 1.0, &mut shot);
            }
            actor.shade(&joints, &mut shot);
        }
        shot.light.shadow = Sphere::new(Vec3::new(middle.x, 0.0, middle.z), 3.0);
        add_region(exchange, t, &mut shot);
        shot
    }

    /// For each joint 1 if it belongs to the attacking limb, otherwise 0.
    fn attacking(&self, exchange: &Exchange) -> Vec<f32> {
        let graph = self.baked.graph();
        let joints: &[JointId] = match graph.edge(exchange.attack).event {
            Some(event) => &graph.event(event).joints,
            None => &[],
        };
        let skeleton = graph.skeleton();
        let attacks = |joint| joints.iter().any(|&above| skeleton.carries(above, joint));
        let weight = |joint| f32::from(u8::from(attacks(joint)));
        skeleton.ids().map(weight).collect()
    }
}

/// Weight of the attack's colour on the limb. It rises shortly before the attack's start and falls
/// at its end.
fn heat(exchange: &Exchange, t: f32) -> f32 {
    let [start, end] = exchange.span;
    smooth_step((t - start + 0.2) / 0.2) * (1.0 - smooth_step((t - end + 0.05) / 0.2))
}

/// Adds the attack's path, visible from its announcement until its end.
fn add_region(exchange: &Exchange, t: f32, shot: &mut Shot) {
    let ([start, end], since) = (exchange.span, t - exchange.announced);
    let lead = (start - exchange.announced).clamp(0.05, 0.4);
    let shown = smooth_step(since / lead) * (1.0 - smooth_step((t - end + 0.1) / 0.25));
    if since < 0.0 || shown <= 0.0 {
        return;
    }
    let colour = ATTACK.extend(0.30 * shown).to_array();
    for pair in exchange.limb.windows(2) {
        let both = pair[0].iter().zip(&pair[1]);
        let pieces = both.map(|(from, to)| Capsule::new(*from, *to, colour));
        shot.ghosts.extend(pieces);
    }
}

/// Approximate position of the attacking limb at a time.
fn attacking_limb(exchange: &Exchange, t: f32) -> Vec3 {
    let [start, end] = exchange.span;
    let last = exchange.limb.len().saturating_sub(1);
    let share = ((t - start) / (end - start).max(1e-3)).clamp(0.0, 1.0);
    let limb = exchange.limb.get((share * last as f32) as usize);
    let spheres = limb.map_or(&[][..], |limb| limb);
    let all: Vec3 = spheres.iter().map(|sphere| sphere.centre).sum();
    all / spheres.len().max(1) as f32
}
