//! How a body stands at a moment: what an entry is aligned by.

use glam::Vec3;

use crate::anim::{Facing, JointTransform, Pose, forward_kinematics};
use crate::graph::{ClipId, MotionGraph};
use crate::math::Rigid2;

/// Where a body stands and which way it faces, and where its root and its feet are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stance {
    /// The character's frame.
    pub placement: Rigid2,
    /// The root's place.
    pub root: Vec3,
    /// The ankles', by leg; the first four.
    pub feet: [Vec3; Self::LEGS],
}

impl Stance {
    /// No more legs are looked at.
    pub(crate) const LEGS: usize = 4;

    /// Of joints in some space, in that space.
    #[must_use]
    pub(crate) fn of(graph: &MotionGraph, facing: Facing, joints: &[JointTransform]) -> Self {
        let mut feet = [Vec3::ZERO; Self::LEGS];
        for (place, leg) in feet.iter_mut().zip(graph.feet().legs()) {
            *place = joints[leg.foot.index()].translation;
        }
        Self {
            placement: facing.placement(joints),
            root: joints[0].translation,
            feet,
        }
    }

    /// Of a frame of a clip, in the clip's space.
    #[must_use]
    pub(crate) fn of_frame(graph: &MotionGraph, clip: ClipId, frame: u32) -> Self {
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        graph.clip(clip).pose(frame as usize, &mut pose);
        forward_kinematics(graph.skeleton(), &pose, &mut joints);
        Self::of(graph, Facing::of(graph.skeleton()), &joints)
    }

    /// Takes the space of `target` to that of this stance, so that both face one way and have a foot, or without one the root, at
    /// one place.
    #[must_use]
    pub(crate) fn align(&self, target: &Self, pin: Option<usize>) -> Rigid2 {
        let place =
            |stance: &Self| pin.map_or(stance.root, |leg| stance.feet[leg.min(Self::LEGS - 1)]);
        let turn = self.placement * target.placement.inverse();
        let off = place(self) - turn.point(place(target));
        Rigid2::new(0.0, off.x, off.z) * turn
    }

    /// How far root and feet are apart over the ground when the other is aligned, metres: the root, and for each leg the foot.
    pub(super) fn apart(&self, target: &Self, align: Rigid2) -> (f32, [f32; Self::LEGS]) {
        let apart = |a: Vec3, b: Vec3| (a - align.point(b)).with_y(0.0).length();
        let feet = std::array::from_fn(|leg| apart(self.feet[leg], target.feet[leg]));
        (apart(self.root, target.root), feet)
    }
}
