//! Poses of the body that several motions have in common: of a query's candidates, or of a plan.

use std::sync::Arc;

use glam::{Quat, Vec3};
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

use crate::anim::{JointId, JointTransform, Pose, forward_kinematics};
use crate::graph::{Inertia, Motion, MotionMoment, Playhead};
use crate::maps::BakedGraph;

/// Rotations that a host adds to the joints of what is played: aim, recoil, a reaction to a hit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct AdditiveLayer {
    /// Each in the joint's own frame, before that of its parent.
    joints: Vec<(JointId, Quat)>,
    /// How far it moves a point of the body at most, in metres.
    moves: f32,
}

impl AdditiveLayer {
    /// Replaces the rotations, for a body of which a point is at most `reach` metres from the root. Returns by how much one of them has changed at
    /// most, in radians.
    pub(crate) fn set(&mut self, joints: &[(JointId, Quat)], reach: f32) -> f32 {
        let turned = |all: &[(JointId, Quat)], joint: JointId| {
            let found = all.iter().find(|(id, _)| *id == joint);
            found.map_or(Quat::IDENTITY, |found| found.1)
        };
        let angles =
            self.joints.iter().chain(joints).map(|&(joint, _)| {
                turned(&self.joints, joint).angle_between(turned(joints, joint))
            });
        let most = angles.fold(0.0, f32::max);
        // The way of a point that is turned about a joint, as a share of its distance from it, which is at most twice the reach.
        let ways = joints
            .iter()
            .map(|(_, rotation)| 2.0 * rotation.xyz().length());
        self.moves = 2.0 * reach * ways.sum::<f32>().min(2.0);
        self.joints.clear();
        self.joints.extend_from_slice(joints);
        most
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }

    pub(crate) fn moves(&self) -> f32 {
        self.moves
    }

    /// Whether a skeleton with so many joints can play it.
    pub(crate) fn is_sound(&self, joints: usize) -> bool {
        let mut all = self.joints.iter();
        all.all(|(joint, rotation)| joint.index() < joints && rotation.is_normalized())
            && (0.0..=1e3).contains(&self.moves)
    }

    pub(crate) fn apply(&self, pose: &mut Pose) {
        for &(joint, rotation) in &self.joints {
            let turned = &mut pose.rotations[joint.index()];
            *turned = (*turned * rotation).normalize();
        }
    }
}

/// Poses of one graph and its body. They are kept from one motion to the next.
#[derive(Clone, Debug, Default)]
pub(super) struct PoseCache {
    graph: Arc<()>,
    pub(super) additive: AdditiveLayer,
    pose: Pose,
    /// Transforms of the joints of the pose to the world.
    joints: Vec<JointTransform>,
    /// Numbers of the poses that depend on a playhead alone.
    known: FxHashMap<PoseKey, usize>,
    /// The blend in which the motions begin.
    blend: Inertia,
    /// Numbers of the poses in that blend, by their moments.
    blended: FxHashMap<(PoseKey, u32), usize>,
    pub(super) count: usize,
    /// Centres of the body's spheres, `[pose][x, y, z][sphere]`, padded.
    rows: Vec<f32>,
}

/// Key of a pose: edge, frame, and placement in the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct PoseKey([u32; 6]);

impl PoseKey {
    fn new(playhead: Playhead) -> Self {
        let place = playhead.clip_to_world;
        let [frame, cos, sin, x, z] =
            [playhead.frame, place.cos(), place.sin(), place.x, place.z].map(f32::to_bits);
        Self([playhead.edge.0, frame, cos, sin, x, z])
    }
}

impl PoseCache {
    /// Number of poses from which on all are removed before the next motion. It is enough for the moves of a query.
    const MOST: usize = 4096;

    /// Prepares for the next motion. The poses of earlier motions remain, except those of another graph or in another blend.
    pub(super) fn start(&mut self, baked: &BakedGraph, motion: &Motion) {
        if !Arc::ptr_eq(&self.graph, baked.identity()) || self.count > Self::MOST {
            self.graph = Arc::clone(baked.identity());
            self.clear();
        }
        if let Some(blend) = motion.continued_blend().filter(|it| **it != self.blend) {
            self.blend.clone_from(blend);
            self.blended.clear();
        }
    }

    pub(super) fn set_additive(&mut self, additive: &AdditiveLayer) {
        if self.additive != *additive {
            self.additive.clone_from(additive);
            self.clear();
        }
    }

    /// Removes all poses, so that what a query costs does not depend on the one before it.
    pub(super) fn clear(&mut self) {
        self.known.clear();
        self.blended.clear();
        self.count = 0;
        self.rows.clear();
    }

    /// Number of the pose of a moment, until the next [`PoseCache::start`].
    pub(super) fn number(&mut self, baked: &BakedGraph, moment: MotionMoment<'_>) -> usize {
        let MotionMoment { motion, seconds } = moment;
        let graph = baked.graph();
        let key = || PoseKey::new(motion.playhead(graph, seconds));
        let next = self.count;
        let number = if !motion.is_composed(seconds) {
            *self.known.entry(key()).or_insert(next)
        } else if motion.is_in_continued_blend(seconds) {
            let at = (key(), seconds.to_bits());
            *self.blended.entry(at).or_insert(next)
        } else {
            // No other motion has this pose.
            next
        };
        if number == next {
            motion.sample(graph, seconds, &mut self.pose);
            self.additive.apply(&mut self.pose);
            forward_kinematics(graph.skeleton(), &self.pose, &mut self.joints);
            baked.body_rows().push(&self.joints, &mut self.rows);
            self.count += 1;
        }
        number
    }

    /// Centre of mass of the body in a pose, in the world, in metres.
    pub(super) fn centre_of_mass(&self, baked: &BakedGraph, number: usize) -> Vec3 {
        let row = 3 * baked.body_rows().radii().len();
        baked
            .body_rows()
            .centre_of_mass(&self.rows[number * row..][..row])
    }

    /// Rows of the x, y and z coordinates of the spheres' centres in a pose, in the world, in metres.
    pub(super) fn axes(&self, baked: &BakedGraph, number: usize) -> [&[f32]; 3] {
        let row = baked.body_rows().radii().len();
        [0, 1, 2].map(|axis| &self.rows[(3 * number + axis) * row..][..row])
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::graph::{EdgeId, Played};
    use crate::math::Rigid2;
    use crate::query::fixture::{self, bake, baked};

    /// Motions of two graphs in turn, on few edges at two places, so that poses come again. Most continue one of two blends, which last for 0.2 s.
    #[test]
    fn poses_are_those_of_their_motions() {
        let graphs = [baked().clone(), bake([0.7, 1.6])];
        let mut cache = PoseCache::default();
        let (mut sampled, mut posed) = (0, 0);
        for round in 0..72 {
            // Several motions of a graph follow each other.
            let baked = &graphs[round / 12 % 2];
            let graph = baked.graph();
            let motion = |edge: usize, place: f32| {
                let place = Rigid2::new(0.3, place, 0.0);
                fixture::motion(baked, EdgeId(edge as u32), 0.0, place)
            };
            let mut tested = motion(round % 2, 0.0);
            if round % 4 > 0 {
                let mut blended = motion(round % 2, 0.0);
                let other = motion(2 + round / 4 % 2, 0.1);
                let played = Played {
                    motion: &other,
                    seconds: 0.4,
                    rate: 1.0,
                };
                blended.blend_from(graph, played, 0.3);
                tested.continue_blend(&blended, 0.1);
            }
            cache.start(baked, &tested);
            let before = cache.count;
            for tick in 0..60 {
                let moment = tested.moment_at(tick as f32 / 60.0);
                let number = cache.number(baked, moment);
                let joints = fixture::joints(baked, &tested, moment.seconds);
                let mut rows = Vec::new();
                baked.body_rows().push(&joints, &mut rows);
                assert_eq!(cache.axes(baked, number).concat(), rows, "{round} {tick}");
            }
            sampled += 60;
            posed += cache.count - before;
        }
        assert!(posed < sampled / 2, "{posed} {sampled}");
    }
}
