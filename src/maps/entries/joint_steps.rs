//! Compares the rotations of a joint from frame to frame with the limits of its velocity and acceleration.

use glam::{Quat, Vec3};

use super::limits::MotionLimits;
use crate::anim::JointId;
use crate::graph::rotation_vector;

/// Rotation vector of a rotation. Up to 35° it is computed without an arc tangent, from the first terms of the arc sine series, with an error
/// below 1e-8 of the angle. Rotations between two frames are rarely larger.
fn small_turn(rotation: Quat) -> Vec3 {
    /// Square of the sine of half the largest angle for the series.
    const MOST: f32 = 0.09;
    let vector = rotation.xyz();
    let square = vector.length_squared();
    if square > MOST {
        return rotation_vector(rotation);
    }
    let series = [35.0 / 1152.0, 5.0 / 112.0, 3.0 / 40.0, 1.0 / 6.0, 1.0];
    let share = series
        .into_iter()
        .fold(63.0 / 2816.0, |sum, term| sum * square + term);
    vector * (2.0 * share).copysign(rotation.w)
}

/// The limits of a joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointLimits {
    /// Square of the largest rotation angle between two frames, in radians.
    step: f32,
    /// Square of the largest change of the rotation vector between two such steps, in radians.
    change: f32,
}

impl JointLimits {
    pub(super) fn of(limits: &MotionLimits, joint: JointId, rate: f32) -> Self {
        let step = limits.joint_speed[joint.index()] / rate;
        let change = limits.joint_acceleration[joint.index()] / (rate * rate);
        Self {
            step: step * step,
            change: change * change,
        }
    }
}

/// State of the test of a joint, frame by frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointSteps {
    /// Rotation in the last frame.
    pub(super) before: Quat,
    /// Rotation vector of the last step, in the space of the joint's parent.
    pub(super) turn: Vec3,
}

impl JointSteps {
    /// Moves on to the next rotation, and returns whether the step is within the limits.
    pub(super) fn fits(&mut self, rotation: Quat, limits: JointLimits) -> bool {
        let turn = small_turn(rotation * self.before.conjugate());
        let change = turn - self.turn;
        (self.before, self.turn) = (rotation, turn);
        turn.length_squared() <= limits.step && change.length_squared() <= limits.change
    }
}
