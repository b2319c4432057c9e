//! Two bodies do not stand in each other, and neither leaves the arena.

use glam::Vec3;

use super::Duel;
use crate::anim::{JointTransform, Pose, forward_kinematics};
use crate::graph::{Motion, Playhead};
use crate::maps::{BakedGraph, BodySphere};
use crate::query::Attack;

/// The part of a body that nobody else can be in: the spheres of trunk and head, and not those of the limbs, of which a blow may land.
#[derive(Clone, Debug, PartialEq)]
pub struct Core {
    spheres: Vec<BodySphere>,
    /// What a blow is aimed at: the core, and the first bone of each limb.
    vital: Vec<BodySphere>,
}

/// Bodies are looked at this often, times a second.
const RATE: f32 = 30.0;

impl Core {
    /// Spheres of the joints that have no twin on the other side; where names tell no sides, of the root.
    #[must_use]
    pub fn of(baked: &BakedGraph) -> Self {
        let skeleton = baked.graph().skeleton();
        let middle = |sphere: &&BodySphere| skeleton.mirror(sphere.joint).is_none();
        let has_sides = skeleton.ids().any(|id| skeleton.mirror(id).is_some());
        let first = |sphere: &&BodySphere| {
            let sided = |id: &crate::anim::JointId| skeleton.mirror(*id).is_some();
            skeleton.ancestry(sphere.joint).take_while(sided).count() <= 1
        };
        let root = |sphere: &&BodySphere| sphere.joint == crate::anim::JointId::ROOT;
        let all = baked.body().spheres.iter();
        let spheres = match has_sides {
            true => all.filter(middle).copied().collect(),
            false => all.filter(root).copied().collect(),
        };
        let vital = baked.body().spheres.iter().filter(first);
        Self {
            spheres,
            vital: vital.copied().collect(),
        }
    }

    /// Its spheres.
    #[must_use]
    pub fn spheres(&self) -> &[BodySphere] {
        &self.spheres
    }

    /// Centres and radii at a place of the graph, in the world.
    pub fn at(&self, baked: &BakedGraph, playhead: Playhead, out: &mut Vec<(Vec3, f32)>) {
        let (mut pose, mut joints): (Pose, Vec<JointTransform>) = Default::default();
        playhead.pose(baked.graph(), &mut pose);
        forward_kinematics(baked.graph().skeleton(), &pose, &mut joints);
        out.clear();
        let spheres = self.spheres.iter();
        out.extend(spheres.map(|sphere| (sphere.centre(&joints), sphere.radius)));
    }

    /// The smallest distance between the surfaces of two bodies' cores, metres; negative where they meet.
    #[must_use]
    pub fn distance(&self, baked: &BakedGraph, playheads: [Playhead; 2]) -> f32 {
        let [mut a, mut b] = [Vec::new(), Vec::new()];
        self.at(baked, playheads[0], &mut a);
        self.at(baked, playheads[1], &mut b);
        let pairs = a.iter().flat_map(|a| b.iter().map(move |b| (a, b)));
        pairs
            .map(|(a, b)| a.0.distance(b.0) - a.1 - b.1)
            .fold(f32::INFINITY, f32::min)
    }
}

impl Duel<'_> {
    /// How near an attack comes to what it is aimed at, metres, on a motion with the same clock: what is guarded by hands and
    /// forearms is no more than guarded.
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
                nearest = self.core.vital.iter().map(away).fold(nearest, f32::min);
            }
        }
        nearest
    }

    /// Whether two motions that start now keep their cores apart for so many seconds, with a little to spare for what lies between
    /// the moments that are looked at.
    pub(super) fn stays_apart(&self, motions: [&Motion; 2], seconds: f32) -> bool {
        /// Metres.
        const SPARE: f32 = 0.04;
        /// Roots that are so far apart keep bodies apart, metres: no trunk leans out further.
        const FAR: f32 = 2.0;
        let graph = self.baked.graph();
        ticks(seconds).all(|t| {
            let [a, b] = motions.map(|motion| motion.root(graph, t));
            if a.distance(b) > FAR {
                return true;
            }
            let playheads = motions.map(|motion| motion.playhead(graph, t));
            self.core.distance(self.baked, playheads) > SPARE
        })
    }

    /// Whether the root stays in the arena.
    pub(super) fn stays_inside(&self, motion: &Motion, seconds: f32) -> bool {
        /// Metres.
        const SPARE: f32 = 0.02;
        ticks(seconds).all(|t| {
            let root = motion.root(self.baked.graph(), t);
            root.x.hypot(root.z) < self.settings.arena - SPARE
        })
    }

    /// Whether roots keep their distance.
    pub(super) fn keeps_distance(&self, motions: [&Motion; 2], seconds: f32) -> bool {
        let graph = self.baked.graph();
        ticks(seconds).step_by(3).all(|t| {
            let [a, b] = motions.map(|motion| motion.root(graph, t));
            (a.x - b.x).hypot(a.z - b.z) >= self.settings.closest
        })
    }
}

fn ticks(seconds: f32) -> impl Iterator<Item = f32> {
    let count = (seconds * RATE).ceil().max(0.0) as usize;
    (0..=count).map(|tick| tick as f32 / RATE)
}
