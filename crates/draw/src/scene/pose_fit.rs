//! Poses in which the bones have given directions, to bind meshes in.

use glam::{Quat, Vec3};

use super::mesh::{after, inverse};
use sabaki::anim::{
    Clip, Facing, JointId, JointKind, JointTransform, Limbs, Pose, Skeleton, forward_kinematics,
};

/// Frames of a clip that are looked at, at most.
const FRAMES: usize = 64;

/// The pose of the clips in which the head is highest and the feet are lowest above the lowest joint, at the origin, facing +Z: the joints'
/// frames. With no clips, the rest pose.
#[must_use]
pub fn standing_pose(skeleton: &Skeleton, clips: &[Clip]) -> Vec<JointTransform> {
    let head = skeleton.ids().find(|&id| {
        skeleton
            .joint(id)
            .name
            .to_ascii_lowercase()
            .contains("head")
    });
    let feet = Limbs::of(skeleton).feet;
    let height = |joints: &[JointTransform]| {
        let heights = joints.iter().map(|joint| joint.translation.y);
        let top = match head {
            Some(head) => joints[head.index()].translation.y,
            None => heights.clone().fold(f32::MIN, f32::max),
        };
        let lowest = heights.fold(f32::MAX, f32::min);
        let lifted = feet
            .iter()
            .map(|&foot| joints[foot.index()].translation.y - lowest);
        top - lowest - lifted.sum::<f32>()
    };
    let mut joints = Vec::new();
    let mut pose = Pose {
        root: Vec3::ZERO,
        rotations: vec![Quat::IDENTITY; skeleton.len()],
        translations: Vec::new(),
    };
    let mut best = (f32::MIN, Vec::new());
    for clip in clips {
        for frame in (0..clip.frames()).step_by(clip.frames().div_ceil(FRAMES).max(1)) {
            clip.pose(frame, &mut pose);
            forward_kinematics(skeleton, &pose, &mut joints);
            let height = height(&joints);
            if height > best.0 {
                best = (height, joints.clone());
            }
        }
    }
    if best.1.is_empty() {
        forward_kinematics(skeleton, &pose, &mut best.1);
    }
    let back = Facing::of(skeleton).placement(&best.1).inverse();
    let upright = JointTransform {
        rotation: back.rotation(),
        translation: back.point(Vec3::ZERO),
    };
    best.1.iter().map(|joint| after(&upright, joint)).collect()
}

/// Turns the bones of a pose to wanted directions, joint after joint, and keeps what directions leave open.
///
/// `wanted` has the direction from a joint's parent to the joint. The root stays where it is. Joints that no direction turns keep their
/// rotation relative to their parents; feet keep theirs relative to the ground, pointing ahead.
pub(crate) fn straightened(
    skeleton: &Skeleton,
    pose: &[JointTransform],
    wanted: &[Option<Vec3>],
) -> Vec<JointTransform> {
    let feet = Limbs::of(skeleton).feet;
    let mut out: Vec<JointTransform> = Vec::with_capacity(pose.len());
    for id in skeleton.ids() {
        let old = &pose[id.index()];
        let parent = skeleton.joint(id).parent;
        let mut joint = match parent {
            Some(parent) => {
                let local = after(&inverse(&pose[parent.index()]), old);
                after(&out[parent.index()], &local)
            }
            None => *old,
        };
        let pairs: Vec<(Vec3, Vec3)> = skeleton
            .children(id)
            .filter_map(|child| {
                let away =
                    old.rotation.conjugate() * (pose[child.index()].translation - old.translation);
                Some((away.try_normalize()?, wanted[child.index()]?))
            })
            .collect();
        if !pairs.is_empty() {
            joint.rotation = turned(joint.rotation, &pairs, parent.is_none());
        } else if feet.contains(&id) {
            joint.rotation = ahead(skeleton, id, old);
        }
        out.push(joint);
    }
    out
}

/// The rotation near `start` that turns the first of each pair closest to the second. If `anew`, starts a quarter turn about the vertical apart
/// are tried too.
fn turned(start: Quat, pairs: &[(Vec3, Vec3)], anew: bool) -> Quat {
    let miss = |rotation: Quat| -> f32 {
        let pairs = pairs.iter();
        pairs
            .map(|&(own, wanted)| (rotation * own).distance_squared(wanted))
            .sum()
    };
    if let [(own, wanted)] = *pairs
        && !anew
    {
        return Quat::from_rotation_arc((start * own).normalize(), wanted) * start;
    }
    let mut best = start;
    for quarter in 0..if anew { 4 } else { 1 } {
        let mut rotation =
            Quat::from_rotation_y(quarter as f32 * std::f32::consts::FRAC_PI_2) * start;
        for _ in 0..200 {
            let torque: Vec3 = pairs
                .iter()
                .map(|&(own, wanted)| (rotation * own).cross(wanted))
                .sum();
            let step = torque / pairs.len() as f32;
            rotation = (Quat::from_scaled_axis(step) * rotation).normalize();
        }
        if quarter == 0 || miss(rotation) < miss(best) {
            best = rotation;
        }
    }
    best
}

/// A foot's rotation with the toes turned towards +Z about the vertical.
fn ahead(skeleton: &Skeleton, foot: JointId, old: &JointTransform) -> Quat {
    let toes = skeleton
        .children(foot)
        .map(|child| old.rotation * skeleton.joint(child).offset)
        .find(|offset| offset.length() > 1e-3);
    let Some(toes) = toes else {
        return old.rotation;
    };
    Quat::from_rotation_y(-toes.x.atan2(toes.z)) * old.rotation
}

/// Whether a joint has no child but end sites.
pub(super) fn is_last(skeleton: &Skeleton, id: JointId) -> bool {
    let moving = |child: JointId| skeleton.joint(child).kind == JointKind::Moving;
    !skeleton.children(id).any(moving)
}
