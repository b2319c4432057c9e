//! Skeletons for the unit tests.

use glam::Vec3;

use super::{Joint, JointId, JointKind, Skeleton};

/// A skeleton of joints that move, each by its name, its parent and its offset from it.
pub(crate) fn skeleton(joints: &[(&str, Option<u16>, Vec3)]) -> Skeleton {
    let joint = |&(name, parent, offset): &(&str, Option<u16>, Vec3)| Joint {
        name: name.into(),
        parent: parent.map(JointId),
        offset,
        kind: JointKind::Moving,
    };
    Skeleton::new(joints.iter().map(joint).collect()).unwrap()
}

/// A body with a trunk, two arms and two legs with toes.
pub(crate) fn biped() -> Skeleton {
    let (up, side) = (Vec3::Y * 0.2, Vec3::X * 0.25);
    skeleton(&[
        ("Hips", None, Vec3::ZERO),
        ("Spine", Some(0), up),
        ("Chest", Some(1), up),
        ("Neck", Some(2), up),
        ("Head", Some(3), up),
        ("LeftArm", Some(2), side),
        ("LeftForeArm", Some(5), side),
        ("LeftHand", Some(6), side),
        ("RightArm", Some(2), -side),
        ("RightForeArm", Some(8), -side),
        ("RightHand", Some(9), -side),
        ("LeftUpLeg", Some(0), side * 0.4),
        ("LeftLeg", Some(11), -up * 2.0),
        ("LeftFoot", Some(12), -up * 2.0),
        ("RightUpLeg", Some(0), -side * 0.4),
        ("RightLeg", Some(14), -up * 2.0),
        ("RightFoot", Some(15), -up * 2.0),
        ("LeftToe", Some(13), Vec3::Z * 0.15),
        ("RightToe", Some(16), Vec3::Z * 0.15),
    ])
}
