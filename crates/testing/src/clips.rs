//! Skeletons and clips made up for tests.

use glam::{Quat, Vec3};
use sabaki::anim::{Clip, ClipDesc, Joint, JointId, JointKind, Skeleton};

/// Pelvis, two legs and a trunk with arms: nine joints, some of them tips.
pub fn small_skeleton() -> Skeleton {
    let joint = |name: &str, parent: Option<u16>, offset: [f32; 3], kind| Joint {
        name: name.into(),
        parent: parent.map(JointId),
        offset: Vec3::from(offset),
        kind,
    };
    let (moving, tip) = (JointKind::Moving, JointKind::EndSite);
    Skeleton::new(vec![
        joint("Hips", None, [0.0; 3], moving),
        joint("LeftFoot", Some(0), [0.1, -0.9, 0.0], moving),
        joint("LeftFoot_End", Some(1), [0.0, 0.0, 0.15], tip),
        joint("RightFoot", Some(0), [-0.1, -0.9, 0.0], moving),
        joint("RightFoot_End", Some(3), [0.0, 0.0, 0.15], tip),
        joint("Chest", Some(0), [0.0, 0.5, 0.0], moving),
        joint("Chest_End", Some(5), [0.0, 0.3, 0.0], tip),
        joint("LeftHand", Some(5), [0.6, 0.0, 0.0], moving),
        joint("RightHand", Some(5), [-0.6, 0.0, 0.0], moving),
    ])
    .unwrap()
}

/// A clip in which the root wanders and every joint swings; `seed` changes how.
pub fn swinging_clip(skeleton: &Skeleton, frames: usize, seed: f32) -> Clip {
    let (mut roots, mut rotations) = (Vec::new(), Vec::new());
    for frame in 0..frames {
        let t = frame as f32 / 30.0;
        roots.push(Vec3::new(
            (t * 0.7 + seed).sin() * 2.0 + seed,
            0.95,
            t * 0.4 * seed.cos(),
        ));
        for (index, joint) in skeleton.joints().iter().enumerate() {
            let phase = seed * 1.7 + index as f32;
            let (yaw, pitch) = (
                (t * 1.3 + phase).sin() * 0.8 + seed,
                (t * 2.1 + phase).sin() * 0.5,
            );
            rotations.push(match (joint.kind, index) {
                (JointKind::EndSite, _) => Quat::IDENTITY,
                (_, 0) => Quat::from_rotation_y(yaw),
                _ => Quat::from_rotation_y(yaw * 0.3) * Quat::from_rotation_x(pitch),
            });
        }
    }
    let name = format!("swing {seed}");
    let desc = ClipDesc {
        name,
        frame_rate: 30.0,
        roots,
        rotations,
        translations: Vec::new(),
    };
    Clip::new(skeleton, desc).unwrap()
}

/// The first frame of a clip whose joints keep the skeleton's offsets.
pub fn first_frame(skeleton: &Skeleton, clip: &Clip) -> Clip {
    let desc = ClipDesc {
        roots: clip.desc().roots[..1].to_vec(),
        rotations: clip.desc().rotations[..skeleton.len()].to_vec(),
        translations: Vec::new(),
        ..clip.desc().clone()
    };
    Clip::new(skeleton, desc).unwrap()
}

/// A skeleton of joints that move, each by its name, its parent and its offset from it.
pub fn skeleton(joints: &[(&str, Option<u16>, Vec3)]) -> Skeleton {
    let joint = |&(name, parent, offset): &(&str, Option<u16>, Vec3)| Joint {
        name: name.into(),
        parent: parent.map(JointId),
        offset,
        kind: JointKind::Moving,
    };
    Skeleton::new(joints.iter().map(joint).collect()).unwrap()
}

/// A body with a trunk, two arms and two legs with toes.
pub fn biped() -> Skeleton {
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
