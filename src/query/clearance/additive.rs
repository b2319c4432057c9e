use glam::Quat;
use serde::{Deserialize, Serialize};

use crate::anim::{JointId, Pose};

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

    /// How far it moves a point of the body at most, in metres.
    pub(crate) fn moves(&self) -> f32 {
        self.moves
    }

    /// Whether a skeleton with so many joints can play it.
    pub(crate) fn is_sound(&self, joints: usize) -> bool {
        let mut all = self.joints.iter();
        all.all(|(joint, rotation)| joint.index() < joints && rotation.is_normalized())
            && (0.0..=1e3).contains(&self.moves)
    }

    /// Adds the rotations to a pose.
    pub(crate) fn apply(&self, pose: &mut Pose) {
        for &(joint, rotation) in &self.joints {
            let turned = &mut pose.rotations[joint.index()];
            *turned = (*turned * rotation).normalize();
        }
    }
}
