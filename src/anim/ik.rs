//! Two-bone inverse kinematics in closed form: a leg that brings its foot to a place.
//!
//! Source: the law of cosines; the steps (knee, then the whole leg's turn, then the foot) are those
//! of Kovar, Schreiner & Gleicher, "Footskate Cleanup for Motion Capture Editing" (2002), section
//! 3.3. Differs: bones are not stretched where a place is out of reach. The leg then comes as near as
//! a straight leg can, and slows down before it is straight, so that the knee does not snap.

use glam::{Quat, Vec3};

use super::{Chain, JointId, JointTransform, Leg, Pose, Skeleton};

/// What became of a leg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// How far the ankle is from where it should be, metres; 0 within reach, but for rounding.
    pub missed: f32,
}

/// Of what is left until the leg is straight, the share up to which it follows exactly.
const FREELY: f32 = 0.7;

/// Bends `leg` of `pose` so that the foot's frame is `foot` (in the space of the motion). The knee
/// stays in its plane, the bones keep their lengths, nothing but the leg moves.
pub fn reach(skeleton: &Skeleton, pose: &mut Pose, leg: &Leg, foot: JointTransform) -> Reach {
    let (hip, knee_in_hip, foot_in_knee, toe) = {
        let chain = Chain::of(skeleton, pose);
        let toe = |toe| chain.within(toe, leg.foot).translation;
        (
            chain.global(leg.hip),
            chain.within(leg.knee, leg.hip),
            chain.within(leg.foot, leg.knee),
            leg.toe.map_or(Vec3::ZERO, toe),
        )
    };
    let knee_rotation = hip.rotation * knee_in_hip.rotation;
    // From the hip to the knee, from there to the ankle, from there to the toe.
    let (thigh, shin) = (
        hip.rotation * knee_in_hip.translation,
        knee_rotation * foot_in_knee.translation,
    );
    let forward = knee_rotation * foot_in_knee.rotation * toe;

    let wanted = foot.translation - hip.translation;
    let bones = [thigh.length(), shin.length()];
    let now = (thigh + shin).length();
    let distance = soft_distance(wanted.length(), now, bones);
    let bend = inner_angle(distance, bones) - inner_angle(now, bones);
    let bend = Quat::from_axis_angle(knee_axis(thigh, shin, forward), bend);
    let swing = match (
        (thigh + bend * shin).try_normalize(),
        wanted.try_normalize(),
    ) {
        (Some(from), Some(to)) => Quat::from_rotation_arc(from, to),
        _ => Quat::IDENTITY,
    };

    // A turn in the space of the motion, as one in the frame of the joint's parent.
    let turned = |local: Quat, global: Quat, turn: Quat| {
        let parent = global * local.conjugate();
        (parent.conjugate() * turn * parent * local).normalize()
    };
    let rotation = |id: JointId| pose.rotations[id.index()];
    let above_foot = knee_rotation * foot_in_knee.rotation * rotation(leg.foot).conjugate();
    let hip_rotation = turned(rotation(leg.hip), hip.rotation, swing);
    let knee_local = turned(rotation(leg.knee), knee_rotation, bend);
    let foot_local = ((swing * bend * above_foot).conjugate() * foot.rotation).normalize();
    pose.rotations[leg.hip.index()] = hip_rotation;
    pose.rotations[leg.knee.index()] = knee_local;
    pose.rotations[leg.foot.index()] = foot_local;
    Reach {
        missed: (distance - wanted.length()).abs(),
    }
}

/// Where the hip is, and the furthest from there that [`reach`] brings the ankle without missing.
pub(crate) fn free_distance<L: Fn(JointId) -> (Quat, Vec3)>(
    chain: &Chain<'_, L>,
    leg: &Leg,
) -> (Vec3, f32) {
    let hip = chain.global(leg.hip);
    let knee = chain.within(leg.knee, leg.hip);
    let foot = chain.within(leg.foot, leg.knee).translation;
    let bones = knee.translation.length() + foot.length();
    let now = knee.point(foot).length();
    (hip.translation, now + FREELY * (bones - now).max(0.0))
}

/// The distance from hip to ankle that the leg takes on for a wanted one, when it is `now` that far:
/// the wanted one as long as it is shorter than now or leaves some bend in the knee; beyond, ever
/// nearer to straight. Without a jump in value or slope.
fn soft_distance(wanted: f32, now: f32, [a, b]: [f32; 2]) -> f32 {
    let room = (a + b - now).max(0.0);
    let free = now + FREELY * room;
    let distance = if wanted <= free {
        wanted
    } else {
        let rest = (1.0 - FREELY) * room;
        let share = if rest > 0.0 {
            (wanted - free) / rest
        } else {
            0.0
        };
        free + rest * (1.0 - (-share).exp())
    };
    distance.max((a - b).abs() + 1e-3 * (a + b))
}

/// The angle in a triangle opposite to the side `c`, by its half's tangent: sound near 0 and π.
fn inner_angle(c: f32, [a, b]: [f32; 2]) -> f32 {
    let sine = ((c - (a - b)) * (c + (a - b))).max(0.0).sqrt();
    let cosine = ((a + b - c) * (a + b + c)).max(0.0).sqrt();
    2.0 * sine.atan2(cosine)
}

/// About which the shin turns to straighten the leg. Where the leg is straight, the way that the foot
/// points says where the knee bends to.
fn knee_axis(thigh: Vec3, shin: Vec3, forward: Vec3) -> Vec3 {
    /// How little bend, as a sine, leaves the choice to the foot.
    const STRAIGHT: f32 = 1e-3;
    let bent = shin.cross(thigh);
    let by_foot = (thigh + shin).cross(forward);
    let guess = by_foot.normalize_or(thigh.any_orthogonal_vector().normalize_or(Vec3::X));
    (bent + guess * (STRAIGHT * thigh.length() * shin.length())).normalize_or(guess)
}
