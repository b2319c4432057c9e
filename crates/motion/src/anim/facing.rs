use glam::{Vec2, Vec3};

use super::side::Side;
use super::{JointId, JointTransform, Skeleton};
use crate::math::Rigid2;

/// Finds the position and the facing direction of a pose, independently of the joints' axes.
///
/// The direction is computed from the line between a left and a right joint, usually the hips: of
/// the pairs with mirrored names that the rest pose keeps apart, the pair closest to the root. Left
/// is +X of the character's frame, so the character faces +Z. A skeleton without such a pair faces
/// along its root's Z axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facing {
    /// Left and right joint.
    pair: Option<(JointId, JointId)>,
}

impl Facing {
    /// Finds the pair of joints in `skeleton`.
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

    /// Whether the skeleton has a pair of left and right joints.
    #[must_use]
    pub fn is_of_hips(self) -> bool {
        self.pair.is_some()
    }

    /// The character's frame: root on the ground, with the pelvis' facing direction.
    #[must_use]
    pub fn placement(self, joints: &[JointTransform]) -> Rigid2 {
        self.placement_by(|joint| joints[joint.index()])
    }

    /// [`Facing::placement`] with a function that returns the frame of a joint.
    pub fn placement_by(self, frame: impl Fn(JointId) -> JointTransform) -> Rigid2 {
        let root = frame(JointId::ROOT);
        let forward = match self.pair {
            Some((left, right)) => {
                (frame(left).translation - frame(right).translation).cross(Vec3::Y)
            }
            None => root.rotation * Vec3::Z,
        };
        Rigid2::facing(
            Vec2::new(forward.x, forward.z),
            root.translation.x,
            root.translation.z,
        )
    }
}

/// Whether two joints have different positions in the rest pose. In CMU's skeletons, both hip
/// joints lie on the root.
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
