//! Legs and arms of a skeleton: the frames of joint chains, the axis about which a knee bends, and two-bone inverse kinematics in
//! closed form.
//!
//! Source: the law of cosines. The steps (knee, rotation of the whole leg, foot) are those of Kovar, Schreiner & Gleicher,
//! "Footskate Cleanup for Motion Capture Editing" (2002), section 3.3. Differs: bones keep their lengths if the target is out of
//! reach. The leg then gets as close as a straight leg can. It slows down before it is straight, so that the knee does not snap.
//! The axis of the knee is ours: the normal of its plane, or an axis in the hip's frame if the leg is nearly straight.

use glam::{Quat, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::{JointId, JointKind, JointTransform, Limbs, Pose, Skeleton, carried};
use crate::math::smooth_step;

/// The joints of a leg: two bones and a foot; of an arm, two bones and a hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Leg {
    /// Joint that carries the thigh. It carries nothing but this leg.
    pub hip: JointId,
    /// Joint between the two bones.
    pub knee: JointId,
    /// Ankle, which carries the foot.
    pub foot: JointId,
    /// Point at the front of the foot: the ball or the end of the toes. `None` if the foot has no
    /// second point.
    pub toe: Option<JointId>,
}

impl Leg {
    /// Minimum length of the leg's two bones, as a share of the leg's length. It excludes twist
    /// joints and joints that lie on the pelvis.
    const SHORTEST_BONE: f32 = 0.3;

    /// Finds the legs above the feet that joint names or the structure identify ([`Limbs`](super::Limbs)), or none if they identify no
    /// feet. Joints between a leg's three joints (twist joints) move with the bone that contains
    /// them.
    #[must_use]
    pub fn all(skeleton: &Skeleton) -> Vec<Self> {
        let known = Limbs::known(skeleton);
        Self::above(skeleton, &known.map_or_else(Vec::new, |limbs| limbs.feet))
    }

    /// The arms above the hands that names or the structure tell, as two bones and an end: shoulder, elbow, hand.
    #[must_use]
    pub fn arms(skeleton: &Skeleton) -> Vec<Self> {
        let known = Limbs::known(skeleton);
        Self::above(skeleton, &known.map_or_else(Vec::new, |limbs| limbs.hands))
    }

    fn above(skeleton: &Skeleton, feet: &[JointId]) -> Vec<Self> {
        let no_part = carried(skeleton);
        let carried = |joint: JointId| {
            let on_it = feet.iter().filter(|&&foot| skeleton.carries(joint, foot));
            on_it.count()
        };
        let leg = |&foot: &JointId| {
            let own: Vec<JointId> = skeleton
                .ancestry(foot)
                .take_while(|&joint| joint != JointId::ROOT && carried(joint) == 1)
                .collect();
            let bone = |joint: JointId| skeleton.joint(joint).offset.length();
            // Length of the chain, without the bone that leads to its first joint.
            let length: f32 = own.iter().rev().skip(1).map(|&joint| bone(joint)).sum();
            let shortest = Self::SHORTEST_BONE * length;
            let above = |from: usize| {
                let mut sum = 0.0;
                (from + 1..own.len()).find(|&index| {
                    sum += bone(own[index - 1]);
                    sum > 0.0 && sum >= shortest
                })
            };
            let knee = above(0)?;
            let hip = above(knee)?;
            let toe = toe(skeleton, foot, &no_part);
            let (hip, knee) = (own[hip], own[knee]);
            Some(Self {
                hip,
                knee,
                foot,
                toe,
            })
        };
        feet.iter().filter_map(leg).collect()
    }

    /// The toe, or the ankle if the foot has no second point.
    pub fn toe_or_foot(&self) -> JointId {
        self.toe.unwrap_or(self.foot)
    }

    /// Length of both bones, in metres.
    pub fn length(&self, skeleton: &Skeleton) -> f32 {
        let bones = skeleton
            .ancestry(self.foot)
            .take_while(|&joint| joint != self.hip);
        bones
            .map(|joint| skeleton.joint(joint).offset.length())
            .sum()
    }

    /// Whether the leg's joints exist in `skeleton` and form a chain. It checks legs that come from
    /// a file.
    pub fn is_sound(&self, skeleton: &Skeleton) -> bool {
        let known = |joint: JointId| joint.index() < skeleton.len();
        let below = |joint, above| {
            known(joint) && skeleton.ancestry(joint).skip(1).any(|other| other == above)
        };
        self.hip != JointId::ROOT
            && below(self.knee, self.hip)
            && below(self.foot, self.knee)
            && self.toe.is_none_or(|toe| below(toe, self.foot))
    }
}

/// The foot's child that moves or, if there is none, the farthest child. Things that are no part of the body are no toes.
fn toe(skeleton: &Skeleton, foot: JointId, no_part: &[bool]) -> Option<JointId> {
    let rank = |&id: &JointId| {
        let joint = skeleton.joint(id);
        (joint.kind == JointKind::Moving, joint.offset.length())
    };
    skeleton
        .children(foot)
        .filter(|id| rank(id).1 > 1e-3 && !no_part[id.index()])
        .max_by(|a, b| {
            let (a, b) = (rank(a), rank(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        })
}

/// Computes joint frames from the chain of ancestors, without evaluating the whole body. `local`
/// returns a joint's rotation and position in its parent's frame; the root's are in the space of
/// the motion.
pub struct Chain<'a, L> {
    /// Skeleton of the chain.
    pub skeleton: &'a Skeleton,
    /// Rotation and position of a joint in its parent's frame, in metres.
    pub local: L,
}

impl<'a> Chain<'a, ()> {
    /// Creates a chain from a pose.
    pub fn of(
        skeleton: &'a Skeleton,
        pose: &'a Pose,
    ) -> Chain<'a, impl Fn(JointId) -> (Quat, Vec3)> {
        Chain {
            skeleton,
            local: |id| pose.local(skeleton, id),
        }
    }
}

impl<L: Fn(JointId) -> (Quat, Vec3)> Chain<'_, L> {
    /// Frame of a joint in the space of the motion.
    pub fn global(&self, joint: JointId) -> JointTransform {
        self.below(joint, None)
    }

    /// Frame of a joint relative to one of its ancestors.
    pub fn within(&self, joint: JointId, above: JointId) -> JointTransform {
        self.below(joint, Some(above))
    }

    fn below(&self, joint: JointId, above: Option<JointId>) -> JointTransform {
        let parent = |id: JointId| {
            self.skeleton
                .joint(id)
                .parent
                .filter(|&id| Some(id) != above)
        };
        if Some(joint) == above {
            return JointTransform::IDENTITY;
        }
        let (rotation, translation) = (self.local)(joint);
        let mut frame = JointTransform {
            rotation,
            translation,
        };
        let mut next = parent(joint);
        while let Some(id) = next {
            let (rotation, translation) = (self.local)(id);
            frame = JointTransform {
                rotation: rotation * frame.rotation,
                translation: rotation * frame.translation + translation,
            };
            next = parent(id);
        }
        frame
    }
}

/// The direction in which [`Leg::reach_by_knee`] bends a knee.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Knee {
    /// The knee bends in its present plane. A straight leg bends towards where the foot points.
    #[default]
    InPlane,
    /// The knee bends in its present plane if it is clearly bent, otherwise about this axis in the hip's frame. If the axis
    /// is zero, the direction of the foot determines the plane.
    ///
    /// The plane of a nearly straight leg is unreliable, and a blend of two motions may bend a knee the wrong way.
    Forward(Vec3),
}

/// Limit of the rotation of a knee the wrong way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct KneeLimit {
    /// Axis about which the shin rotates to straighten the knee, in the hip's frame; zero if it is unknown.
    pub hinge: Vec3,
    /// Smallest sine of the knee's flexion about the hinge.
    pub flexion: f32,
}

impl KneeLimit {
    /// Whether the hinge is zero or a unit vector and the flexion is finite. Checks values that come from a file.
    pub fn is_sound(&self) -> bool {
        let is_axis = self.hinge == Vec3::ZERO || self.hinge.is_normalized();
        self.hinge.is_finite() && is_axis && self.flexion.is_finite()
    }
}

impl Leg {
    /// Axis about which the shin rotates to straighten the knee, in the hip's frame. Its length is the sine of the flexion.
    pub fn knee_hinge(&self, skeleton: &Skeleton, pose: &Pose) -> Vec3 {
        let chain = Chain::of(skeleton, pose);
        let knee = chain.within(self.knee, self.hip);
        let shin = knee.rotation * chain.within(self.foot, self.knee).translation;
        let lengths = shin.length() * knee.translation.length();
        shin.cross(knee.translation) / lengths.max(1e-6)
    }

    /// Rotates a knee that is bent further the wrong way than it may be, about the hinge, to the limit.
    pub fn limit_knee(&self, skeleton: &Skeleton, pose: &mut Pose, limit: KneeLimit) {
        let KneeLimit { hinge, flexion } = limit;
        if hinge == Vec3::ZERO {
            return;
        }
        let sine = self.knee_hinge(skeleton, pose).dot(hinge);
        if sine >= flexion {
            return;
        }
        let angle = sine.max(-1.0).asin() - flexion.clamp(-1.0, 1.0).asin();
        let turn = Quat::from_axis_angle(hinge, angle);
        let in_hip = Chain::of(skeleton, pose).within(self.knee, self.hip);
        let rotation = &mut pose.rotations[self.knee.index()];
        *rotation = turned(*rotation, in_hip.rotation, turn);
    }
}

/// Flexion from which the plane of a knee is trusted that agrees with the hinge, and one that contradicts it: of a knee whose plane is
/// trusted as soon as it is bent.
const BENT: [f32; 2] = [0.04, 0.04];
/// The same of a knee that a blend of two motions may have bent the wrong way, but not far.
const BLENDED: [f32; 2] = [0.25, 0.8];

/// Normal of the plane in which a knee bends, perpendicular to the unit vector `thigh` from the hip to the knee; `shin` points from the
/// knee to the ankle. `forward` is the normal of the plane in which knees bend, or nearly: the axis about which the shin rotates to
/// straighten the leg. The shorter it is, the less it is trusted. The flexions, now and wanted, are twice the sine of half the angle
/// between thigh and shin.
///
/// Both are continuous: the plane stays as it is if the flexion does, or if it is large.
fn knee_normal(
    [thigh, shin]: [Vec3; 2],
    forward: Vec3,
    trusted: [f32; 2],
    [now, wanted]: [f32; 2],
) -> Vec3 {
    /// Share of the flexion from which a plane is trusted up to which the hinge counts for more.
    const BY_HINGE: f32 = 0.75;
    /// Length from which the hinge is trusted.
    const TELLS: f32 = 0.25;
    /// A knee that is bent further by this share of its flexion has left a plane in which it is bent the wrong way.
    const LEAVES: f32 = 1.5;
    let hinge = forward.reject_from_normalized(thigh);
    let told = smooth_step(hinge.length() / TELLS);
    let hinge = hinge.normalize_or(thigh.any_orthonormal_vector());
    // Of a straight leg it is what rounding leaves, which may point along the thigh too.
    let plane = shin.cross(thigh);
    let plane = plane.reject_from_normalized(thigh).normalize_or(hinge);
    if wanted <= now {
        return plane;
    }
    // The normal moves this way until the knee is bent as much as is wanted.
    let contradicts = (0.5 - plane.dot(hinge)).clamp(0.0, 1.0);
    let enough = trusted[0] + (trusted[1] - trusted[0]) * contradicts;
    let distrust = told * (1.0 - smooth_step(2.0 * now / enough - 1.0));
    let by_hinge = hinge * (BY_HINGE * trusted[1] * distrust);
    let way = plane * (now * (1.0 - distrust)) + by_hinge;
    let way = way.normalize_or(plane);
    let cosine = plane.dot(way);
    let (along, more) = (now * cosine, wanted - now);
    let step = (along * along + more * (wanted + now)).sqrt() - along;
    let full = plane * now + way * step;
    if cosine >= 0.0 {
        return full.normalize_or(plane);
    }
    let side = thigh.cross(plane);
    let leaves = LEAVES * now * (-2.0 * cosine).min(1.0);
    let angle = full.dot(side).atan2(full.dot(plane)) * smooth_step(more / leaves);
    plane * angle.cos() + side * angle.sin()
}

/// The shortest rotation from one unit vector to another, accurate for small angles too.
fn arc(from: Vec3, to: Vec3) -> Quat {
    let axis = from.cross(to);
    let turn = Quat::from_xyzw(axis.x, axis.y, axis.z, 1.0 + from.dot(to));
    match turn.length_squared() > 1e-6 {
        true => turn.normalize(),
        false => Quat::from_rotation_arc(from, to),
    }
}

/// The local rotation of a joint after a rotation of the space in which its rotation is `global`.
pub(super) fn turned(local: Quat, global: Quat, turn: Quat) -> Quat {
    let parent = global * local.conjugate();
    (parent.conjugate() * turn * parent * local).normalize()
}

/// Share of the remaining extension up to which the leg follows its target exactly.
const EXACT_SHARE: f32 = 0.7;

impl Leg {
    /// Bends this leg of `pose` so that the foot's frame becomes `foot`, in the space of the motion. The
    /// knee stays in its plane, the bones keep their lengths, and all other joints keep their
    /// rotations. Returns the distance between the ankle and its target, in metres: 0 within reach, except for rounding errors.
    pub fn reach(&self, skeleton: &Skeleton, pose: &mut Pose, foot: JointTransform) -> f32 {
        self.reach_by_knee(skeleton, pose, foot, Knee::InPlane)
    }

    /// [`Leg::reach`] with a direction for the knee.
    pub fn reach_by_knee(
        &self,
        skeleton: &Skeleton,
        pose: &mut Pose,
        foot: JointTransform,
        knee: Knee,
    ) -> f32 {
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
            Knee::InPlane => (by_foot, BENT),
            Knee::Forward(Vec3::ZERO) => (by_foot, BLENDED),
            Knee::Forward(hinge) => (hip.rotation * hinge, BLENDED),
        };
        let bones = [thigh, shin].map(|bone| bone.normalize_or(Vec3::NEG_Y));
        let flexions = half_angles.map(|half| 2.0 * half.y);
        let normal = knee_normal(bones, forward, trusted, flexions);
        // The rotation of the shin that changes the knee's half angle.
        let to = half_angles[1];
        let (sine, cosine) = (2.0 * to.x * to.y, (to.x - to.y) * (to.x + to.y));
        let bend = arc(bones[1], bones[0] * cosine - normal.cross(bones[0]) * sine);
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
        (distance - wanted.length()).abs()
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
mod tests {
    use super::*;
    use crate::anim::{Joint, JointKind, forward_kinematics};
    use proptest::prelude::*;

    const BONES: [f32; 2] = [0.43, 0.40];

    fn skeleton() -> Skeleton {
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

    fn joints(pose: &Pose) -> Vec<JointTransform> {
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
            let missed = leg.reach(&skeleton, &mut bent, wanted);
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
            prop_assert!(leg.reach(&skeleton, &mut same, before[4]) < 1e-5);
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

    fn straight() -> Pose {
        Pose::at_rest(&skeleton(), Vec3::Y)
    }

    /// Knees from bent the wrong way, which blends of two motions may cause, to bent well.
    #[test]
    fn a_knee_bends_forward_and_never_jumps() {
        const STEP: f32 = 1e-3;
        let skeleton = skeleton();
        let leg = Leg::all(&skeleton)[0];
        // The hinge is not quite the knee's axis; without one the foot tells.
        for hinge in [Vec3::ZERO, Vec3::new(-0.95, 0.0, 0.3)] {
            let mut before = None::<Vec3>;
            for step in 0..1000 {
                let knee = -0.35 + step as f32 * STEP;
                let foot = Quat::from_rotation_y(0.3) * Quat::from_rotation_x(-knee);
                let mut pose = straight();
                (pose.rotations[3], pose.rotations[4]) = (Quat::from_rotation_x(knee), foot);
                let (hip, ankle) = (joints(&pose)[1].translation, joints(&pose)[4]);
                let foot = JointTransform {
                    translation: hip - Vec3::Y * 0.62,
                    ..ankle
                };
                let missed = leg.reach_by_knee(&skeleton, &mut pose, foot, Knee::Forward(hinge));
                assert!(missed < 1e-5);
                let knee = joints(&pose)[3].translation - hip;
                assert!(knee.z > 0.2, "{knee} at {step}");
                let jump = before.map_or(0.0, |before| before.distance(knee));
                assert!(jump < 2.0 * STEP, "{jump} at {step}");
                before = Some(knee);
            }
        }
    }

    #[test]
    fn a_knee_that_is_bent_the_wrong_way_is_straightened() {
        let skeleton = skeleton();
        let leg = Leg::all(&skeleton)[0];
        let mut pose = straight();
        pose.rotations[2] = Quat::from_rotation_y(0.4);
        pose.rotations[3] = Quat::from_rotation_x(0.5);
        let hinge = leg.knee_hinge(&skeleton, &pose);
        assert!((hinge.length() - 0.5f32.sin()).abs() < 1e-5, "{hinge}");
        let hinge = hinge.normalize();
        for (knee, least) in [(-0.3f32, 0.0f32), (-0.3, -0.1), (0.2, 0.0)] {
            pose.rotations[3] = Quat::from_rotation_x(knee);
            let flexion = least.sin();
            leg.limit_knee(&skeleton, &mut pose, KneeLimit { hinge, flexion });
            let flexion = leg.knee_hinge(&skeleton, &pose).dot(hinge).asin();
            assert!((flexion - knee.max(least)).abs() < 1e-3, "{flexion}");
        }
    }
}
