//! The centre of mass of a body, and its horizontal acceleration: what a body has to push for.
//!
//! Source of the masses: Winter, "Biomechanics and Motor Control of Human Movement" (2009), table 4.1. Each segment's mass is taken in its middle.

use glam::Vec3;

use crate::anim::{JointId, Leg, Skeleton};
use crate::maps::entries::limits::head;

/// Time over which velocities are averaged, in seconds.
const WINDOW: f32 = 0.1;

/// The segments of a body.
#[derive(Clone, Debug)]
pub(crate) struct Segments {
    /// The joints at both ends of each segment, and its share of the mass.
    segments: Vec<([JointId; 2], f32)>,
}

impl Segments {
    /// The segments of the limbs and the trunk that a skeleton has; the root alone without any.
    pub(crate) fn of(skeleton: &Skeleton) -> Self {
        let [legs, arms] = [Leg::all(skeleton), Leg::arms(skeleton)];
        let head = head(skeleton);
        let is_above = |joint: JointId, end: JointId| skeleton.ancestry(end).any(|it| it == joint);
        let carries_arms = |&joint: &JointId| arms.iter().all(|arm| is_above(joint, arm.hip));
        let chest = skeleton.ancestry(head).skip(1).find(carries_arms);
        let chest = chest.unwrap_or(JointId::ROOT);
        let neck = skeleton.joint(head).parent.unwrap_or(JointId::ROOT);
        let mut segments = vec![
            ([JointId::ROOT, chest], 0.35),
            ([chest, neck], 0.15),
            ([neck, head], 0.08),
        ];
        for leg in &legs {
            segments.push(([leg.hip, leg.knee], 0.1));
            segments.push(([leg.knee, leg.foot], 0.0465));
            segments.push(([leg.foot, leg.toe_or_foot()], 0.0145));
        }
        for arm in &arms {
            segments.push(([arm.hip, arm.knee], 0.028));
            segments.push(([arm.knee, arm.foot], 0.022));
        }
        Self { segments }
    }

    /// The centre of mass of a body whose joints are at some places.
    pub(crate) fn centre(&self, place: impl Fn(JointId) -> Vec3) -> Vec3 {
        let mut sum = Vec3::ZERO;
        let mut mass = 0.0;
        for &([from, to], share) in &self.segments {
            sum += 0.5 * share * (place(from) + place(to));
            mass += share;
        }
        sum / mass
    }
}

/// Number of frames of a tenth of a second.
pub(crate) fn window(frame_rate: f32) -> usize {
    (WINDOW * frame_rate).round().max(1.0) as usize
}

/// The horizontal acceleration of a point at three times, each `frames` after the one before, in metres per second squared.
pub(crate) fn acceleration(points: [Vec3; 3], frames: usize, frame_rate: f32) -> f32 {
    let [before, now, then] = points;
    let seconds = frames as f32 / frame_rate;
    (before - 2.0 * now + then).with_y(0.0).length() / (seconds * seconds)
}
