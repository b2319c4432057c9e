//! The joints of the trunk and the limbs, which a [`Warp`](super::Warp) may move.

use super::limbs::Limbs;
use super::{JointId, Knee, Leg, Pose, Skeleton};
use glam::{Quat, Vec3};

/// Trunk and limbs of a skeleton, identified by the names and the hierarchy of its joints. Parts that are not identified are empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rig {
    /// Joints from the pelvis (excluded) up to the parent of both arms. Each is the parent of the next.
    spine: Vec<JointId>,
    /// Legs, then arms.
    limbs: [Option<Leg>; Self::LIMBS],
    /// How each limb bends.
    knees: [Knee; Self::LIMBS],
    parts: Vec<Part>,
}

/// A skeleton with its trunk and limbs.
#[derive(Clone, Copy, Debug)]
pub struct RiggedSkeleton<'a> {
    /// The skeleton.
    pub skeleton: &'a Skeleton,
    /// Spine and limbs of the skeleton.
    pub rig: &'a Rig,
}

/// The part of the body that a joint belongs to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Part {
    /// Number of spine joints that move this joint, counted from the pelvis.
    pub spine: usize,
    /// Index of the limb that contains the joint.
    pub limb: Option<usize>,
    /// Whether the joint is the limb's foot or hand, or one of its descendants.
    pub is_end: bool,
}

impl Part {
    /// Whether the joint belongs to the spine, the arms or the head.
    pub fn is_above_pelvis(self) -> bool {
        self.spine > 0 && self.limb.is_none_or(|limb| limb >= Rig::LEGS)
    }
}

impl Rig {
    /// Number of limbs: two legs and two arms.
    pub const LIMBS: usize = 4;
    /// Number of legs, which are the first limbs.
    pub const LEGS: usize = 2;

    /// Finds the parts of a skeleton. Legs are found if there are exactly two, arms and spine if there are exactly two hands.
    #[must_use]
    pub fn of(skeleton: &Skeleton) -> Self {
        let two = |limbs: Vec<Leg>| <[Leg; 2]>::try_from(limbs).ok();
        let legs = two(Leg::all(skeleton));
        let hands = Limbs::of(skeleton).hands;
        let arms = two(Leg::arms(skeleton));
        let spine = <[JointId; 2]>::try_from(hands)
            .map(|[left, right]| spine(skeleton, left, right))
            .unwrap_or_default();
        let limb = |pair: &Option<[Leg; 2]>, side: usize| pair.map(|pair| pair[side]);
        let mut rig = Self {
            spine,
            limbs: [
                limb(&legs, 0),
                limb(&legs, 1),
                limb(&arms, 0),
                limb(&arms, 1),
            ],
            knees: [Knee::InPlane; Self::LIMBS],
            parts: Vec::new(),
        };
        rig.parts = skeleton
            .ids()
            .map(|id| rig.find_part(skeleton, id))
            .collect();
        rig
    }

    /// Joints from the pelvis (excluded) up to the parent of both arms.
    pub fn spine(&self) -> &[JointId] {
        &self.spine
    }

    /// Legs, then arms, in the order of the skeleton. Each limb has two bones and an end.
    pub fn limbs(&self) -> &[Option<Leg>; Self::LIMBS] {
        &self.limbs
    }

    /// How the knee or elbow of a limb bends. Default: in its plane.
    pub fn knee(&self, limb: usize) -> Knee {
        self.knees[limb]
    }

    /// Lets the legs whose hip is a joint bend in another way.
    pub fn set_knee(&mut self, hip: JointId, knee: Knee) {
        for (limb, known) in self.limbs.iter().zip(&mut self.knees) {
            if limb.is_some_and(|limb| limb.hip == hip) {
                *known = knee;
            }
        }
    }

    /// Both legs, or `None` if the skeleton does not have exactly two.
    pub fn legs(&self) -> Option<[Leg; 2]> {
        Some([self.limbs[0]?, self.limbs[1]?])
    }

    /// The part of the body that moves a joint.
    pub fn part(&self, joint: JointId) -> Part {
        self.parts[joint.index()]
    }

    /// Whether the skeleton has a spine that moves arms and head but no leg.
    pub fn has_upper_body(&self) -> bool {
        let carries_leg = |leg: Leg| self.part(leg.hip).spine > 0;
        let legs = self.legs();
        !self.spine.is_empty() && legs.is_some_and(|legs| !legs.into_iter().any(carries_leg))
    }

    /// Rotates the joints of the spine about one axis in the space of the motion, from the pelvis up. They share the rotation equally.
    pub fn turn_spine(&self, vector: Vec3, pose: &mut Pose) {
        if vector == Vec3::ZERO || self.spine.is_empty() {
            return;
        }
        let turn = turn_by(vector / self.spine.len() as f32);
        let mut parent = pose.rotations[JointId::ROOT.index()];
        for joint in &self.spine {
            let local = pose.rotations[joint.index()];
            let turned = parent.conjugate() * turn * parent * local;
            pose.rotations[joint.index()] = turned.normalize();
            parent *= local;
        }
    }

    fn find_part(&self, skeleton: &Skeleton, id: JointId) -> Part {
        let carried_by = |joint: JointId| skeleton.carries(joint, id);
        let limb = self
            .limbs
            .iter()
            .position(|limb| limb.is_some_and(|limb| carried_by(limb.hip)));
        let is_end = limb.and_then(|limb| self.limbs[limb]);
        Part {
            spine: self
                .spine
                .iter()
                .filter(|&&joint| carried_by(joint))
                .count(),
            limb,
            is_end: is_end.is_some_and(|limb| carried_by(limb.foot)),
        }
    }
}

/// Rotation by a small vector, axis times angle. The rotation angle is 2 atan(angle / 2), which is never larger than the angle.
fn turn_by(vector: Vec3) -> Quat {
    let half = 0.5 * vector;
    Quat::from_xyzw(half.x, half.y, half.z, 1.0).normalize()
}

/// Joints from the root (excluded) down to the last common ancestor of both hands.
fn spine(skeleton: &Skeleton, left: JointId, right: JointId) -> Vec<JointId> {
    let chest = skeleton
        .ancestry(left)
        .find(|&joint| skeleton.carries(joint, right));
    let mut spine: Vec<JointId> = chest
        .into_iter()
        .flat_map(|chest| skeleton.ancestry(chest))
        .filter(|&joint| joint != JointId::ROOT)
        .collect();
    spine.reverse();
    spine
}
