use glam::Vec3;

use sabaki::anim::{Clip, Facing, JointId, Limbs, Pose, Skeleton, forward_kinematics};

/// Warnings about clips that are readable but suspicious, one line each.
#[must_use]
pub fn clip_warnings(skeleton: &Skeleton, clips: &[Clip]) -> Vec<String> {
    [sides(skeleton), upright(skeleton, clips)]
        .into_iter()
        .flatten()
        .collect()
}

/// Warns if the names of a skeleton with limbs do not tell left from right.
fn sides(skeleton: &Skeleton) -> Option<String> {
    /// Minimum number of limb ends: two feet, a head and a hand.
    const ENDS: usize = 4;
    let ends = skeleton
        .ids()
        .filter(|&id| skeleton.children(id).next().is_none())
        .count();
    let doubtful = ends >= ENDS && !Facing::of(skeleton).is_of_hips();
    doubtful.then(|| {
        "no joint names tell left from right (as LeftLeg, l_leg, leg.L or Bip01 L Leg do): the character is taken to face along its \
         root's Z axis, and its trunk and limbs to be as thick as its neck"
            .to_owned()
    })
}

/// The joint that all legs start from: the nearest common ancestor of all feet. It is the root of many skeletons, but not of those whose
/// root lies on the ground.
fn hips(skeleton: &Skeleton, feet: &[JointId]) -> JointId {
    let above = |joint: JointId, foot: JointId| skeleton.ancestry(foot).any(|id| id == joint);
    let mut candidates = feet
        .iter()
        .take(usize::from(feet.len() > 1))
        .flat_map(|&foot| skeleton.ancestry(foot).skip(1));
    candidates
        .find(|&joint| feet.iter().all(|&foot| above(joint, foot)))
        .unwrap_or(JointId::ROOT)
}

/// Warns if the hips of the figure are not above its feet along Y, over all clips.
fn upright(skeleton: &Skeleton, clips: &[Clip]) -> Option<String> {
    /// Number of samples of each clip.
    const SAMPLES: usize = 8;
    let limbs = Limbs::of(skeleton);
    if limbs.hands.is_empty() || limbs.feet.is_empty() {
        return None;
    }
    let hips = hips(skeleton, &limbs.feet);
    let (mut pose, mut joints) = (Pose::default(), Vec::new());
    let mut up = Vec3::ZERO;
    for clip in clips {
        for frame in (0..clip.frames()).step_by(clip.frames().div_ceil(SAMPLES)) {
            clip.pose(frame, &mut pose);
            forward_kinematics(skeleton, &pose, &mut joints);
            let feet = limbs.feet.iter().map(|id| joints[id.index()].translation);
            up += joints[hips.index()].translation - feet.sum::<Vec3>() / limbs.feet.len() as f32;
        }
    }
    let axis = up.abs().max_position();
    let doubtful = up.length() > 0.0 && (axis != 1 || up.y < 0.0);
    doubtful.then(|| {
        let sign = if up[axis] < 0.0 { '-' } else { '+' };
        let name = ['X', 'Y', 'Z'][axis];
        format!("the figure seems to stand along {sign}{name}, but +Y is taken for up: say which way is up (--up), or turn the files before use")
    })
}
