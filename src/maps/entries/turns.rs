//! Rotations of joints between two poses.

use glam::Vec3;

use crate::anim::Pose;
use crate::graph::rotation_vector;

/// Rotation vector of each joint between two poses, in radians.
pub(super) fn turns(from: &Pose, to: &Pose) -> Vec<Vec3> {
    let both = from.rotations.iter().zip(&to.rotations);
    both.map(|(from, to)| rotation_vector(*to * from.conjugate()))
        .collect()
}
