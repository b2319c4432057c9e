//! Plays back a dodge: a fighter walks the graph, an attack is thrown at a given time, and the
//! answer follows.

use std::sync::Arc;

use glam::Vec3;

use super::film_times::{AROUND, SLOWEST, bounded, film_times};
use super::lead_in::lead_in;
use super::maps::{DodgeMaps, MapStyle};
use super::{Actor, Look, Shot, Skin};
use sabaki::anim::{JointTransform, Pose, forward_kinematics};
use sabaki::graph::{Motion, Playhead};
use sabaki::maps::{BakedGraph, MovingSphere};
use sabaki::math::smooth_step;
use sabaki::query::{Answer, Attack, Clearance};

/// Settings of the playback of a dodge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DodgeSettings {
    /// Duration before the query, in seconds, 0 to 60. Default 0.5.
    pub before: f32,
    /// Duration after the attack's end, in seconds, 0 to 60. Default 0.7.
    pub after: f32,
    /// Playback speed when the attack is nearest, relative to real time, 0.01 to 1. Default 0.12.
    pub slowest: f32,
    /// Whether the motion without the dodge is shown as a ghost. Default true.
    pub ghost: bool,
    /// Colours of the fighter.
    pub look: Look,
}

impl Default for DodgeSettings {
    fn default() -> Self {
        Self {
            before: 0.5,
            after: 0.7,
            slowest: 0.12,
            ghost: true,
            look: Look::default(),
        }
    }
}

/// An attack on a character, and the answer to it.
#[derive(Clone, Copy, Debug)]
pub struct AnsweredAttack<'a> {
    /// State of the character at the query.
    pub playhead: Playhead,
    /// The attack, in the world, with times in seconds since the query.
    pub attack: &'a Attack,
    /// Answer of the query.
    pub answer: &'a Answer,
}

/// A dodge. Time 0 is the query.
#[derive(Clone, Debug)]
pub struct Dodge<'a> {
    pub(super) baked: &'a BakedGraph,
    pub(super) settings: DodgeSettings,
    pub(super) actor: Actor,
    /// Motion before the query, and its duration in seconds.
    before: (Motion, f32),
    /// Motion from the query on.
    answer: Motion,
    /// Motion that would play without the dodge.
    pub(super) idle: Motion,
    pub(super) attack: Attack,
    pub(super) clearance: Clearance,
    /// Maps of the evasion, or `None` if the answer has no evasion.
    maps: Option<DodgeMaps>,
}

/// Nearest points of a body and an attack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Distance between the surfaces, in metres, negative if they intersect.
    pub metres: f32,
    /// Point on the surface of the body's spheres, in the world.
    pub body: Vec3,
    /// Point on the surface of the attack, in the world.
    pub attack: Vec3,
}

/// Colour of the ghost.
pub(super) const GHOST: Vec3 = Vec3::new(0.16, 0.33, 0.62);

impl<'a> Dodge<'a> {
    /// Creates the playback of an attack and its answer. Settings out of their ranges are replaced by the nearest ones in them.
    #[must_use]
    pub fn new(
        baked: &'a BakedGraph,
        answered: AnsweredAttack<'_>,
        settings: &DodgeSettings,
    ) -> Self {
        let AnsweredAttack {
            playhead,
            attack,
            answer,
        } = answered;
        let graph = baked.graph();
        let settings = DodgeSettings {
            before: bounded(settings.before, AROUND),
            after: bounded(settings.after, AROUND),
            slowest: bounded(settings.slowest, SLOWEST),
            ..*settings
        };
        let end = attack.end() + settings.after;
        let mut motion = answer.motion.clone();
        motion.extend(graph, end);
        let mut idle = Motion::new(graph, playhead, &[]);
        idle.extend(graph, end);
        Self {
            maps: DodgeMaps::of(baked, answer, attack),
            baked,
            settings,
            actor: Actor::new(baked, &settings.look, None),
            before: lead_in(graph, playhead, settings.before),
            answer: motion,
            idle,
            attack: attack.clone(),
            clearance: answer.clearance(),
        }
    }

    /// Draws the fighter and its ghost with a mesh that is bound to the graph's skeleton.
    #[must_use]
    pub fn with_skin(mut self, skin: Option<Arc<Skin>>) -> Self {
        self.actor.skin = skin;
        self
    }

    /// First and last time that can be shown, in seconds.
    #[must_use]
    pub fn span(&self) -> [f32; 2] {
        [
            -self.before.1.min(self.settings.before),
            self.attack.end() + self.settings.after,
        ]
    }

    /// Start and end of the attack, in seconds.
    #[must_use]
    pub fn flight(&self) -> [f32; 2] {
        [self.attack.start(), self.attack.end()]
    }

    /// Minimum distance of body and attack, and its time.
    #[must_use]
    pub fn clearance(&self) -> Clearance {
        self.clearance
    }

    /// Times of the pictures of a film with `rate` pictures per second, 1 to 1,000. Playback slows down when
    /// the attack is nearest.
    #[must_use]
    pub fn moments(&self, rate: f32) -> Vec<f32> {
        let slowest = self.settings.slowest;
        film_times(self.span(), rate, |t| {
            let away = ((t - self.clearance.time).abs() - 0.04) / 0.34;
            slowest + (1.0 - slowest) * smooth_step(away)
        })
    }

    /// Frames of the joints at a time, in the world.
    pub fn joints(&self, t: f32, out: &mut Vec<JointTransform>) {
        let (graph, mut pose) = (self.baked.graph(), Pose::default());
        if t < 0.0 {
            let (motion, seconds) = &self.before;
            motion.sample(graph, seconds + t, &mut pose);
        } else {
            self.answer.sample(graph, t, &mut pose);
        }
        forward_kinematics(graph.skeleton(), &pose, out);
    }

    /// Adds the maps of the chosen evasion and of the attack to a shot. It does nothing if the
    /// answer has no evasion.
    pub fn add_maps(&self, t: f32, style: MapStyle, shot: &mut Shot) {
        if let Some(maps) = &self.maps {
            maps.add(t, style, shot);
        }
    }

    /// Nearest points of body and attack at a time, or `None` if there is no attack at that time.
    #[must_use]
    pub fn nearest(&self, t: f32) -> Option<Nearest> {
        self.nearest_of(t).map(|(_, nearest)| nearest)
    }

    /// The attack's sphere that is nearest to the body when the attack is nearest.
    pub(super) fn nearest_sphere(&self) -> Option<&MovingSphere> {
        let nearest = self.nearest_of(self.clearance.time);
        let index = nearest.map_or(0, |(index, _)| index);
        self.attack.spheres().get(index)
    }

    /// Nearest points at a time, with the index of the attack's sphere.
    fn nearest_of(&self, t: f32) -> Option<(usize, Nearest)> {
        let (mut joints, mut centres) = (Vec::new(), Vec::new());
        self.joints(t, &mut joints);
        self.baked.body().centres(&joints, &mut centres);
        let spheres = self.attack.spheres().iter().enumerate();
        let flying = spheres.filter(|(_, one)| (one.start()..=one.end()).contains(&t));
        let apart = flying.flat_map(|(index, sphere)| {
            let ball = sphere.at(t);
            let spheres = centres.iter().zip(&self.baked.body().spheres);
            spheres.map(move |(centre, part)| {
                let between = (ball.center - *centre).normalize_or(Vec3::Y);
                let nearest = Nearest {
                    metres: centre.distance(ball.center) - part.radius - ball.radius,
                    body: *centre + between * part.radius,
                    attack: ball.center - between * ball.radius,
                };
                (index, nearest)
            })
        });
        apart.min_by(|(_, a), (_, b)| a.metres.total_cmp(&b.metres))
    }
}
