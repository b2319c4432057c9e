//! Distances between two fighters, and from the border of their arena.

use super::duel_state::Duel;
use crate::anim::{JointTransform, Pose, forward_kinematics};
use crate::graph::Motion;
use crate::maps::BodySphere;
use crate::query::Attack;

/// Number of samples per second at which distances are tested.
const RATE: f32 = 30.0;
/// Distance by which fighters that are too near or too far out may come even nearer or farther out, in metres. It allows them to stand
/// still.
const ROUNDING: f32 = 0.01;

impl Duel<'_> {
    /// Smallest distance of an attack and its targets on a motion with the same clock, in metres. Hands and forearms are not targets.
    pub(super) fn depth(&self, motion: &Motion, attack: &Attack) -> f32 {
        let graph = self.baked.graph();
        let (mut pose, mut joints): (Pose, Vec<JointTransform>) = Default::default();
        let mut nearest = f32::INFINITY;
        let (start, end) = (attack.start(), attack.end());
        for t in ticks(2.0 * (end - start)).map(|t| (start + 0.5 * t).min(end)) {
            motion.sample(graph, t, &mut pose);
            forward_kinematics(graph.skeleton(), &pose, &mut joints);
            let here = attack.spheres().iter();
            let here = here.filter(|sphere| (sphere.start()..=sphere.end()).contains(&t));
            for key in here.map(|sphere| sphere.at(t)) {
                let away = |part: &BodySphere| {
                    part.centre(&joints).distance(key.center) - part.radius - key.radius
                };
                nearest = self.trunk.targets.iter().map(away).fold(nearest, f32::min);
            }
        }
        nearest
    }

    /// Whether two motions that start now keep the trunks apart for a time, in seconds. Trunks that are too near now must not come nearer.
    pub(super) fn stays_apart(&self, motions: [&Motion; 2], seconds: f32) -> bool {
        /// Minimum distance at the samples, in metres. It is a reserve for the time between samples.
        const SPARE: f32 = 0.04;
        /// Distance of the roots beyond which trunks cannot touch, in metres.
        const FAR: f32 = 2.0;
        let graph = self.baked.graph();
        let distance = |t: f32| {
            let [a, b] = motions.map(|motion| motion.root(graph, t));
            if a.distance(b) > FAR {
                return f32::INFINITY;
            }
            let playheads = motions.map(|motion| motion.playhead(graph, t));
            self.trunk.distance(self.baked, playheads)
        };
        let least = SPARE.min(distance(0.0) - ROUNDING);
        ticks(seconds).all(|t| distance(t) > least)
    }

    /// Whether the root stays in the arena for a time, in seconds. A root that is outside must not go farther out.
    pub(super) fn stays_inside(&self, motion: &Motion, seconds: f32) -> bool {
        /// Minimum distance from the border, in metres.
        const SPARE: f32 = 0.02;
        let away = |t: f32| {
            let root = motion.root(self.baked.graph(), t);
            root.x.hypot(root.z)
        };
        let most = (self.settings.arena - SPARE).max(away(0.0) + ROUNDING);
        ticks(seconds).all(|t| away(t) < most)
    }

    /// Whether the roots keep the distance of [`DuelSettings::closest`](super::DuelSettings::closest) for a time, in seconds. Roots
    /// that are nearer now must not come nearer.
    pub(super) fn keeps_distance(&self, motions: [&Motion; 2], seconds: f32) -> bool {
        let least = (self.settings.closest).min(self.apart(motions, 0.0) - ROUNDING);
        ticks(seconds)
            .step_by(3)
            .all(|t| self.apart(motions, t) >= least)
    }

    /// Horizontal distance of the roots at a time, in metres.
    pub(super) fn apart(&self, motions: [&Motion; 2], seconds: f32) -> f32 {
        let [a, b] = motions.map(|motion| motion.root(self.baked.graph(), seconds));
        (a.x - b.x).hypot(a.z - b.z)
    }
}

fn ticks(seconds: f32) -> impl Iterator<Item = f32> {
    let count = (seconds * RATE).ceil().max(0.0) as usize;
    (0..=count).map(|tick| tick as f32 / RATE)
}
