use glam::Vec3;

use super::steer::SteerScratch;
use crate::anim::{JointTransform, Pose};
use crate::query::clearance::MotionBody;
use crate::query::{Answer, QueryContext};

/// Scratch of one thread.
#[derive(Default)]
pub(super) struct Worker {
    pub plan: PlanScratch,
    pub steer: SteerScratch,
    pub pose: Pose,
    pub joints: Vec<JointTransform>,
    pub centres: Vec<Vec3>,
}

/// Scratch of planning.
#[derive(Default)]
pub(super) struct PlanScratch {
    pub context: QueryContext,
    pub answer: Answer,
    pub body: MotionBody,
}
