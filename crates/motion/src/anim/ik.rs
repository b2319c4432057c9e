//! Two-bone inverse kinematics of legs in closed form.
//!
//! Source: the law of cosines. The steps (knee, rotation of the whole leg, foot) are those of
//! Kovar, Schreiner & Gleicher, "Footskate Cleanup for Motion Capture Editing" (2002), section 3.3.
//! Differs: bones keep their lengths if the target is out of reach. The leg then gets as close as a
//! straight leg can. It slows down before it is straight, so that the knee does not snap.

use glam::{Quat, Vec2, Vec3};

use super::knee::{Knee, KneePlane, turned};
use super::{Chain, JointId, JointTransform, Leg, Pose, Skeleton};

/// Result of [`Leg::reach`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// Distance between the ankle and its target, in metres. It is 0 within reach, except for
    /// rounding errors.
    pub missed: f32,
}

/// Target of a leg.
#[derive(Clone, Copy, Debug)]
pub struct LegGoal {
    /// The foot's frame, in the space of the motion.
    pub foot: JointTransform,
    /// The way in which the knee bends.
    pub knee: Knee,
}

/// Share of the remaining extension up to which the leg follows its target exactly.
const EXACT_SHARE: f32 = 0.7;

impl Leg {
    /// Bends this leg of `pose` so that the foot's frame becomes `foot`, in the space of the motion. The
    /// knee stays in its plane, the bones keep their lengths, and all other joints keep their
    /// rotations.
    pub fn reach(&self, skeleton: &Skeleton, pose: &mut Pose, foot: JointTransform) -> Reach {
        let knee = Knee::InPlane;
        self.reach_goal(skeleton, pose, LegGoal { foot, knee })
    }

    /// [`Leg::reach`] with a direction for the knee.
    pub fn reach_goal(
        &self,
        skeleton: &Skeleton,
        pose: &mut Pose,
        LegGoal { foot, knee }: LegGoal,
    ) -> Reach {
        let (hip, knee_in_hip, foot_in_knee, toe) = {
            let chain = Chain::of(skeleton, pose);
            let toe = |toe| chain.within(toe, self.foot).translation;
            (
                chain.global(self.hip),
                chain.within(self.knee, self.hip),
                chain.within(self.foot, self.knee),
                self.toe.map_or(Vec3::ZERO, toe),
            )
        };
        let knee_rotation = hip.rotation * knee_in_hip.rotation;
        // Vectors from the hip to the knee, from the knee to the ankle, and from the ankle to the toe.
        let (thigh, shin) = (
            hip.rotation * knee_in_hip.translation,
            knee_rotation * foot_in_knee.translation,
        );
        let forward = knee_rotation * foot_in_knee.rotation * toe;

        let wanted = foot.translation - hip.translation;
        let bones = [thigh.length(), shin.length()];
        let now = (thigh + shin).length();
        let distance = soft_distance(wanted.length(), now, bones);
        let half_angles = [now, distance].map(|c| half_angle(c, bones));
        let by_foot = (thigh + shin)
            .normalize_or_zero()
            .cross(forward.normalize_or_zero());
        let (forward, trusted) = match knee {
            Knee::InPlane => (by_foot, KneePlane::BENT),
            Knee::Forward(Vec3::ZERO) => (by_foot, KneePlane::BLENDED),
            Knee::Forward(hinge) => (hip.rotation * hinge, KneePlane::BLENDED),
        };
        let plane = KneePlane {
            thigh: thigh.normalize_or(Vec3::NEG_Y),
            shin: shin.normalize_or(Vec3::NEG_Y),
            forward,
            trusted,
        };
        let bend = plane.bend(half_angles);
        let swing = match (
            (thigh + bend * shin).try_normalize(),
            wanted.try_normalize(),
        ) {
            (Some(from), Some(to)) => Quat::from_rotation_arc(from, to),
            _ => Quat::IDENTITY,
        };

        let rotation = |id: JointId| pose.rotations[id.index()];
        let above_foot = knee_rotation * foot_in_knee.rotation * rotation(self.foot).conjugate();
        let hip_rotation = turned(rotation(self.hip), hip.rotation, swing);
        let knee_local = turned(rotation(self.knee), knee_rotation, bend);
        let foot_local = ((swing * bend * above_foot).conjugate() * foot.rotation).normalize();
        pose.rotations[self.hip.index()] = hip_rotation;
        pose.rotations[self.knee.index()] = knee_local;
        pose.rotations[self.foot.index()] = foot_local;
        Reach {
            missed: (distance - wanted.length()).abs(),
        }
    }
}

/// Position of the hip, and the maximum distance from it at which [`Leg::reach`] brings the ankle to its
/// target exactly.
pub fn free_distance<L: Fn(JointId) -> (Quat, Vec3)>(
    chain: &Chain<'_, L>,
    leg: &Leg,
) -> (Vec3, f32) {
    let hip = chain.global(leg.hip);
    let knee = chain.within(leg.knee, leg.hip);
    let foot = chain.within(leg.foot, leg.knee).translation;
    let bones = knee.translation.length() + foot.length();
    let now = knee.point(foot).length();
    (hip.translation, now + EXACT_SHARE * (bones - now).max(0.0))
}

/// Distance from hip to ankle for a wanted distance, given the current distance `now`. It equals
/// the wanted distance while that is shorter than the current one or keeps some bend in the knee.
/// Beyond that, it approaches the length of the straight leg. Value and slope are continuous.
fn soft_distance(wanted: f32, now: f32, [a, b]: [f32; 2]) -> f32 {
    let room = (a + b - now).max(0.0);
    let free = now + EXACT_SHARE * room;
    let distance = if wanted <= free {
        wanted
    } else {
        let rest = (1.0 - EXACT_SHARE) * room;
        let share = if rest > 0.0 {
            (wanted - free) / rest
        } else {
            0.0
        };
        free + rest * (1.0 - (-share).exp())
    };
    distance.max((a - b).abs() + 1e-3 * (a + b))
}

/// Sine and cosine of half the angle opposite to side `c` in a triangle. It computes no angle and
/// is accurate near 0 and π.
fn half_angle(c: f32, [a, b]: [f32; 2]) -> Vec2 {
    let sine = ((c - (a - b)) * (c + (a - b))).max(0.0).sqrt();
    let cosine = ((a + b - c) * (a + b + c)).max(0.0).sqrt();
    Vec2::new(sine, cosine).normalize_or(Vec2::Y)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::anim::{Joint, JointKind, forward_kinematics};
    use proptest::prelude::*;

    const BONES: [f32; 2] = [0.43, 0.40];

    pub(in crate::anim) fn skeleton() -> Skeleton {
        let joint = |(name, parent, offset): (&str, Option<u16>, Vec3)| Joint {
            name: name.into(),
            parent: parent.map(JointId),
            offset,
            kind: JointKind::Moving,
        };
        let joints = [
            ("Hips", None, Vec3::ZERO),
            ("LeftUpLeg", Some(0), Vec3::new(0.1, -0.05, 0.0)),
            ("LeftUpLegTwist", Some(1), Vec3::NEG_Y * 0.2),
            ("LeftLeg", Some(2), Vec3::NEG_Y * (BONES[0] - 0.2)),
            ("LeftFoot", Some(3), Vec3::NEG_Y * BONES[1]),
            ("LeftToe", Some(4), Vec3::new(0.0, -0.05, 0.15)),
        ];
        Skeleton::new(joints.map(joint).to_vec()).unwrap()
    }

    fn turn() -> impl Strategy<Value = Quat> {
        prop::array::uniform3(-3.0f32..3.0).prop_map(|v| Quat::from_scaled_axis(Vec3::from(v)))
    }

    fn pose() -> impl Strategy<Value = Pose> {
        let place = prop::array::uniform3(-2.0f32..2.0).prop_map(Vec3::from);
        // The knee bends about one axis; all other rotations are arbitrary.
        let rotations = (turn(), turn(), -0.5f32..0.5, 0.0f32..2.6, turn());
        (place, rotations).prop_map(|(root, (hips, hip, twist, knee, foot))| Pose {
            root,
            rotations: vec![
                hips,
                hip,
                Quat::from_rotation_y(twist),
                Quat::from_rotation_x(knee),
                foot,
                Quat::IDENTITY,
            ],
            translations: Vec::new(),
        })
    }

    pub(in crate::anim) fn joints(pose: &Pose) -> Vec<JointTransform> {
        let mut joints = Vec::new();
        forward_kinematics(&skeleton(), pose, &mut joints);
        joints
    }

    proptest! {
        #[test]
        fn the_foot_comes_where_it_should_or_as_near_as_the_leg_goes(
            pose in pose(), away in prop::array::uniform3(-0.9f32..0.9), foot in turn(),
        ) {
            let (skeleton, before) = (skeleton(), joints(&pose));
            let leg = Leg::all(&skeleton)[0];
            let hip = before[1].translation;
            let wanted = JointTransform { rotation: foot, translation: hip + Vec3::from(away) };
            let mut bent = pose.clone();
            let missed = leg.reach(&skeleton, &mut bent, wanted).missed;
            let after = joints(&bent);
            let [knee, ankle] = [3, 4].map(|joint| after[joint].translation);
            prop_assert!((hip.distance(knee) - BONES[0]).abs() < 1e-5);
            prop_assert!((knee.distance(ankle) - BONES[1]).abs() < 1e-5);
            prop_assert!((ankle.distance(wanted.translation) - missed).abs() < 2e-3, "{} {missed}", ankle.distance(wanted.translation));
            prop_assert!(after[4].rotation.angle_between(foot) < 3e-3);
            // A target that the leg can reach without losing its bend is reached, and the bones
            // stay connected.
            let (now, far) = (hip.distance(before[4].translation), Vec3::from(away).length());
            let free = now + EXACT_SHARE * (BONES[0] + BONES[1] - now);
            if far < free && far > 0.05 {
                prop_assert!(missed < 1e-5, "{missed} at {far} of {free}");
            }
            prop_assert!(hip.distance(ankle) < BONES[0] + BONES[1] + 1e-5);
            // Nothing else moves.
            for joint in [0, 2, 5] {
                prop_assert_eq!(bent.rotations[joint], pose.rotations[joint]);
            }
            prop_assert_eq!(bent.root, pose.root);
        }

        #[test]
        fn a_foot_that_is_there_stays_and_so_does_the_knee(pose in pose()) {
            let (skeleton, before) = (skeleton(), joints(&pose));
            let mut same = pose.clone();
            let leg = Leg::all(&skeleton)[0];
            prop_assert!(leg.reach(&skeleton, &mut same, before[4]).missed < 1e-5);
            // If the leg is nearly straight, the knee's position hardly determines its angle.
            for (a, b) in joints(&same).iter().zip(&before) {
                prop_assert!(a.translation.distance(b.translation) < 1e-3);
            }
        }

        #[test]
        fn the_knee_stays_in_its_plane(pose in pose(), nearer in 0.3f32..0.95) {
            // A target on the line to the hip gives the leg no reason to rotate.
            let (skeleton, before) = (skeleton(), joints(&pose));
            let [hip, knee, ankle] = [1, 3, 4].map(|joint| before[joint].translation);
            let normal = (knee - hip).cross(ankle - hip);
            prop_assume!(normal.length() > 0.02);
            let mut bent = pose.clone();
            let wanted = JointTransform { translation: hip.lerp(ankle, nearer), ..before[4] };
            Leg::all(&skeleton)[0].reach(&skeleton, &mut bent, wanted);
            let moved = joints(&bent)[3].translation - hip;
            prop_assert!(moved.dot(normal.normalize()).abs() < 5e-3);
            prop_assert!(moved.dot(knee - hip - (knee - hip).project_onto(ankle - hip)) > 0.0, "it bends the same way");
        }
    }

    #[test]
    fn beyond_its_reach_a_leg_slows_down_before_it_is_straight() {
        let (now, full) = (0.7, BONES[0] + BONES[1]);
        let at = |wanted: f32| soft_distance(wanted, now, BONES);
        let mut before = at(0.1);
        for step in 1..2000 {
            let wanted = 0.1 + step as f32 * 1e-3;
            let distance = at(wanted);
            assert!(distance >= before && distance - before < 1.01e-3 && distance <= full);
            if wanted < now + EXACT_SHARE * (full - now) {
                assert_eq!(distance, wanted);
            }
            before = distance;
        }
        assert!(full - before < 1e-3);
    }
}
