use glam::{Vec2, Vec3};

use super::side::Side;
use super::{JointId, JointTransform, Skeleton};
use crate::math::Rigid2;

/// Finds where a posture stands and which way it faces, whatever the axes of its joints.
///
/// The way is read from the line between two joints (the hips, as a rule: of the pairs that names
/// call left and right and that the rest pose keeps apart, the one nearest to the root): left is +X
/// of the character's frame, so that it faces +Z. A skeleton without such a pair faces along its
/// root's own Z axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facing {
    /// Left and right.
    pair: Option<(JointId, JointId)>,
}

impl Facing {
    /// Looks for the pair.
    #[must_use]
    pub fn of(skeleton: &Skeleton) -> Self {
        let depth = |id| skeleton.ancestry(id).count();
        let pair = skeleton
            .ids()
            .filter_map(|id| match skeleton.sided(id)? {
                (Side::Left, twin) => Some((id, twin)),
                (Side::Right, _) => None,
            })
            .filter(|&(left, right)| apart(skeleton, left, right))
            .min_by_key(|&(left, _)| depth(left));
        Self { pair }
    }

    /// Whether there is such a pair.
    #[must_use]
    pub fn is_of_hips(self) -> bool {
        self.pair.is_some()
    }

    /// The character's frame: the root's place on the ground and the way that the pelvis faces.
    #[must_use]
    pub fn placement(self, joints: &[JointTransform]) -> Rigid2 {
        let root = joints[JointId::ROOT.index()];
        let forward = match self.pair {
            Some((left, right)) => (joints[left.index()].translation
                - joints[right.index()].translation)
                .cross(Vec3::Y),
            None => root.rotation * Vec3::Z,
        };
        Rigid2::facing(
            Vec2::new(forward.x, forward.z),
            root.translation.x,
            root.translation.z,
        )
    }
}

/// Whether the two can be told apart in the rest pose (CMU's hip joints lie both on the root).
fn apart(skeleton: &Skeleton, left: JointId, right: JointId) -> bool {
    let place = |id| -> Vec3 {
        skeleton
            .ancestry(id)
            .filter(|&j| j != JointId::ROOT)
            .map(|j| skeleton.joint(j).offset)
            .sum()
    };
    (place(left) - place(right)).length() > 1e-4
}
