//! Plays back a duel: the attack and the answer of each exchange, from a separate camera.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::camera::film_times;
use super::{Actor, Camera, Capsule, Light, Look, Orbit, Shot, Skin};
use sabaki::anim::{JointId, JointTransform, Pose, forward_kinematics};
use sabaki::duel::{Exchange, Fighter, Side};
use sabaki::maps::{BakedGraph, MovingSphere, SphereKey};
use sabaki::math::{Sphere, smooth_step};

/// Duration shown before an attack's start and after its end, in seconds.
const BEFORE: f32 = 0.75;
const AFTER: f32 = 0.45;
/// Playback speed when an attack is nearest, relative to real time.
const SLOWEST: f32 = 0.3;

/// The playback of a duel's exchanges.
#[derive(Clone, Debug)]
pub struct DuelPlayback<'a> {
    baked: &'a BakedGraph,
    fighters: &'a [Fighter; 2],
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
    /// Creates the playback of a duel, or of a part of one: the exchanges to show, and the fighters with the motions that they have played
    /// on the graph.
    #[must_use]
    pub fn new(
        baked: &'a BakedGraph,
        fighters: &'a [Fighter; 2],
        exchanges: &'a [Exchange],
    ) -> Self {
        Self {
            baked,
            fighters,
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
        exchange.end() + AFTER
    }

    /// One cut for each exchange. Cuts do not overlap.
    #[must_use]
    pub fn cuts(&self, aspect: f32) -> Vec<Cut> {
        let mut shown = 0.0;
        let mut cuts = Vec::with_capacity(self.exchanges.len());
        for (index, exchange) in self.exchanges.iter().enumerate() {
            let start = exchange.announced + exchange.attack.start() - BEFORE;
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
    #[must_use]
    pub fn nearest_at(&self, cut: &Cut) -> f32 {
        let exchange = &self.exchanges[cut.exchange];
        exchange.announced + exchange.clearance.time
    }

    /// Times of the pictures of a cut's film with `rate` pictures per second, 1 to 1,000. Playback slows down
    /// when the attack is nearest.
    #[must_use]
    pub fn moments(&self, cut: &Cut, rate: f32) -> Vec<f32> {
        film_times(cut.span, rate, |t| self.pace(cut, t))
    }

    /// Playback speed at a time. It is lower when the attack is nearest.
    #[must_use]
    pub fn pace(&self, cut: &Cut, t: f32) -> f32 {
        let eased = smooth_step(((t - self.nearest_at(cut)).abs() - 0.05) / 0.25);
        SLOWEST + (1.0 - SLOWEST) * eased
    }

    /// Frames of a fighter's joints at a time, in the world.
    pub fn joints(&self, side: Side, t: f32, out: &mut Vec<JointTransform>) {
        let (graph, mut pose) = (self.baked.graph(), Pose::default());
        self.fighters[side.index()].pose(graph, t, &mut pose);
        forward_kinematics(graph.skeleton(), &pose, out);
    }

    /// Camera beside the fighters, on the side of the attacking limb, that shows both during the
    /// whole cut.
    fn camera(&self, exchange: &Exchange, span: [f32; 2], aspect: f32) -> Camera {
        let (mut a, mut b) = (Vec::new(), Vec::new());
        let near = exchange.announced + exchange.clearance.time;
        self.joints(exchange.attacker, near, &mut a);
        self.joints(exchange.attacker.other(), near, &mut b);
        let along = b[0].translation - a[0].translation;
        let along = Vec3::new(along.x, 0.0, along.z).normalize_or(Vec3::Z);
        let across = Vec3::new(along.z, 0.0, -along.x);
        let limb = attacking_limb(exchange, exchange.clearance.time);
        let side = (limb - a[0].translation).dot(across);
        let across = if side < 0.0 { -across } else { across };
        // Slightly behind the attacker, because the defender's answer is of interest.
        let out = (across - 0.22 * along).normalize_or(Vec3::Z);
        let right = Vec3::Y.cross(out);
        let (low, high) = self.extent(span, right);
        let middle = 0.5 * (a[0].translation + b[0].translation);
        let middle = Vec3::new(middle.x, 0.0, middle.z);
        let aside = 0.5 * (low.x + high.x) - middle.dot(right);
        let target = middle + right * aside + Vec3::Y * (0.5 * high.y + 0.06);
        // Leave space for text at the top.
        let half = (0.54 * (high.x - low.x) / aspect).max(0.5 * high.y) + 0.25;
        let field = 30f32.to_radians();
        let orbit = Orbit {
            target,
            around: out.x.atan2(out.z),
            up: 0.14,
            distance: half / (0.5 * field).tan(),
        };
        Camera {
            field,
            ..Camera::orbit(orbit)
        }
    }

    /// Horizontal and vertical extent of both fighters.
    fn extent(&self, [start, end]: [f32; 2], right: Vec3) -> (Vec2, Vec2) {
        let (mut low, mut high) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        let mut joints = Vec::new();
        for step in 0..=24 {
            let t = start + (end - start) * step as f32 / 24.0;
            for side in [Side::White, Side::Blue] {
                self.joints(side, t, &mut joints);
                for joint in &joints {
                    let seen = Vec2::new(joint.translation.dot(right), joint.translation.y);
                    low = low.min(seen - 0.1);
                    high = high.max(seen + 0.1);
                }
            }
        }
        (low, high)
    }

    /// Shot of a time in a cut.
    #[must_use]
    pub fn shot(&self, cut: &Cut, t: f32) -> Shot {
        let exchange = &self.exchanges[cut.exchange];
        let local = t - exchange.announced;
        let (mut joints, mut middle) = (Vec::new(), Vec3::ZERO);
        let mut shot = Shot::new(cut.camera, Light::default());
        for side in [Side::White, Side::Blue] {
            self.joints(side, t, &mut joints);
            middle += 0.5 * joints[0].translation;
            let actor = &self.actors[side.index()];
            if side == exchange.attacker {
                let tint = ATTACK.extend(heat(exchange, local)).to_array();
                let weights = self.attacking(exchange);
                actor.add_tinted(&joints, tint, &weights, 1.0, &mut shot);
            } else {
                actor.add(&joints, None, 1.0, &mut shot);
            }
            actor.shade(&joints, &mut shot);
        }
        shot.light.shadow = Sphere::new(Vec3::new(middle.x, 0.0, middle.z), 3.0);
        add_region(exchange, local, &mut shot);
        shot
    }

    /// For each joint 1 if it belongs to the attacking limb, otherwise 0.
    fn attacking(&self, exchange: &Exchange) -> Vec<f32> {
        let graph = self.baked.graph();
        let joints: &[JointId] = match graph.edge(exchange.strike).event {
            Some(event) => &graph.event(event).joints,
            None => &[],
        };
        let skeleton = graph.skeleton();
        let attacks = |joint: JointId| {
            let mut above = skeleton.ancestry(joint);
            above.any(|above| joints.contains(&above))
        };
        let weight = |joint| f32::from(u8::from(attacks(joint)));
        skeleton.ids().map(weight).collect()
    }
}

/// Weight of the attack's colour on the limb. It rises shortly before the attack's start and falls
/// at its end.
fn heat(exchange: &Exchange, t: f32) -> f32 {
    let (start, end) = (exchange.attack.start(), exchange.attack.end());
    smooth_step((t - start + 0.2) / 0.2) * (1.0 - smooth_step((t - end + 0.05) / 0.2))
}

/// Adds the attack's path, visible from its announcement until its end.
fn add_region(exchange: &Exchange, t: f32, shot: &mut Shot) {
    let (start, end) = (exchange.attack.start(), exchange.attack.end());
    let shown =
        smooth_step(t / start.clamp(0.05, 0.4)) * (1.0 - smooth_step((t - end + 0.1) / 0.25));
    if t < 0.0 || shown <= 0.0 {
        return;
    }
    let colour = ATTACK.extend(0.30 * shown).to_array();
    let sphere = |key: &SphereKey| Sphere::new(key.center, key.radius);
    for moving in exchange.attack.spheres() {
        for pair in moving.keys().windows(2) {
            let piece = Capsule::new(sphere(&pair[0]), sphere(&pair[1]), colour);
            shot.ghosts.push(piece);
        }
    }
}

/// Approximate position of the attacking limb at a time.
fn attacking_limb(exchange: &Exchange, t: f32) -> Vec3 {
    let spheres = exchange.attack.spheres();
    let all: Vec3 = spheres
        .iter()
        .map(|sphere: &MovingSphere| sphere.at(t).center)
        .sum();
    all / spheres.len().max(1) as f32
}
