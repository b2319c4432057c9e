//! The axis about which a knee bends: the normal of its plane, or an axis in the hip's frame if the leg is nearly straight.
//!
//! The method is ours; the rotations are those of [`Leg::reach`].

use glam::{Quat, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::{Chain, Leg, Pose, Skeleton};
use crate::math::smooth_step;

/// The direction in which [`Leg::reach_goal`] bends a knee.
#[derive(Clone, Copy, Debug)]
pub enum Knee {
    /// The knee bends in its present plane. A straight leg bends towards where the foot points.
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

/// The plane in which a knee bends further.
pub(super) struct KneePlane {
    /// Direction from the hip to the knee.
    pub thigh: Vec3,
    /// Direction from the knee to the ankle.
    pub shin: Vec3,
    /// Normal of the plane in which knees bend, or nearly: the axis about which the shin rotates to straighten the leg. The shorter, the less
    /// it is trusted.
    pub forward: Vec3,
    /// Flexion from which a plane is trusted that agrees with the hinge, and one that contradicts it.
    pub trusted: [f32; 2],
}

impl KneePlane {
    /// [`KneePlane::trusted`] of a knee whose plane is trusted as soon as it is bent.
    pub(super) const BENT: [f32; 2] = [0.04, 0.04];
    /// [`KneePlane::trusted`] of a knee that a blend of two motions may have bent the wrong way, but not far.
    pub(super) const BLENDED: [f32; 2] = [0.25, 0.8];

    /// Rotation of the shin that changes the knee's half angle from one to another, both as sine and cosine.
    pub(super) fn bend(&self, half_angles: [Vec2; 2]) -> Quat {
        let normal = self.normal(half_angles.map(|half| 2.0 * half.y));
        let to = half_angles[1];
        let (sine, cosine) = (2.0 * to.x * to.y, (to.x - to.y) * (to.x + to.y));
        arc(
            self.shin,
            self.thigh * cosine - normal.cross(self.thigh) * sine,
        )
    }

    /// Normal of the plane of the bent leg, perpendicular to the thigh. The flexions are twice the sine of half the angle between thigh
    /// and shin.
    ///
    /// Both are continuous: the plane stays as it is if the flexion does, or if it is large.
    fn normal(&self, [now, wanted]: [f32; 2]) -> Vec3 {
        /// Share of the flexion from which a plane is trusted up to which the hinge counts for more.
        const BY_HINGE: f32 = 0.75;
        /// Length from which the hinge is trusted.
        const TELLS: f32 = 0.25;
        /// A knee that is bent further by this share of its flexion has left a plane in which it is bent the wrong way.
        const LEAVES: f32 = 1.5;
        let hinge = self.forward.reject_from_normalized(self.thigh);
        let told = smooth_step(hinge.length() / TELLS);
        let hinge = hinge.normalize_or(self.thigh.any_orthonormal_vector());
        // Of a straight leg it is what rounding leaves, which may point along the thigh too.
        let plane = self.shin.cross(self.thigh);
        let plane = plane.reject_from_normalized(self.thigh).normalize_or(hinge);
        if wanted <= now {
            return plane;
        }
        // The normal moves this way until the knee is bent as much as is wanted.
        let contradicts = (0.5 - plane.dot(hinge)).clamp(0.0, 1.0);
        let trusted = self.trusted[0] + (self.trusted[1] - self.trusted[0]) * contradicts;
        let distrust = told * (1.0 - smooth_step(2.0 * now / trusted - 1.0));
        let by_hinge = hinge * (BY_HINGE * self.trusted[1] * distrust);
        let way = plane * (now * (1.0 - distrust)) + by_hinge;
        let way = way.normalize_or(plane);
        let cosine = plane.dot(way);
        let (along, more) = (now * cosine, wanted - now);
        let step = (along * along + more * (wanted + now)).sqrt() - along;
        let full = plane * now + way * step;
        if cosine >= 0.0 {
            return full.normalize_or(plane);
        }
        let side = self.thigh.cross(plane);
        let leaves = LEAVES * now * (-2.0 * cosine).min(1.0);
        let angle = full.dot(side).atan2(full.dot(plane)) * smooth_step(more / leaves);
        plane * angle.cos() + side * angle.sin()
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anim::JointTransform;
    use crate::anim::ik::LegGoal;
    use crate::anim::ik::tests::{joints, skeleton};

    fn straight() -> Pose {
        Pose {
            root: Vec3::Y,
            rotations: vec![Quat::IDENTITY; 6],
            translations: Vec::new(),
        }
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
                let goal = LegGoal {
                    foot: JointTransform {
                        translation: hip - Vec3::Y * 0.62,
                        ..ankle
                    },
                    knee: Knee::Forward(hinge),
                };
                assert!(leg.reach_goal(&skeleton, &mut pose, goal).missed < 1e-5);
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
