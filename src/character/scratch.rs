use std::time::Instant;

use glam::Vec3;

use super::steer::SteerScratch;
use crate::anim::{JointTransform, Pose, forward_kinematics};
use crate::crowd::ExternalPose;
use crate::graph::{JointReach, MotionMoment};
use crate::maps::BakedGraph;
use crate::query::{Answer, Obstacle, QueryContext};

/// Scratch of one thread.
#[derive(Default)]
pub(super) struct Worker {
    pub plan: PlanScratch,
    pub steer: SteerScratch,
    pub pose: Pose,
    pub joints: Vec<JointTransform>,
    pub centres: Vec<Vec3>,
    /// Sphere centres a little later.
    pub later_centres: Vec<Vec3>,
    /// Obstacles near the character that is stepped.
    pub obstacles: Vec<Obstacle>,
    pub external: ExternalPose,
    /// The pose without its blend.
    pub unblended: Pose,
    pub unblended_joints: Vec<JointTransform>,
    pub reaches: Vec<JointReach>,
}

impl Worker {
    /// Writes the sphere centres of the body at a moment to `centres`, in the world, in metres.
    pub(super) fn pose_body(&mut self, baked: &BakedGraph, moment: MotionMoment<'_>) {
        let graph = baked.graph();
        moment.motion.sample(graph, moment.seconds, &mut self.pose);
        forward_kinematics(graph.skeleton(), &self.pose, &mut self.joints);
        baked.body().centres(&self.joints, &mut self.centres);
    }
}

/// Scratch of planning.
#[derive(Default)]
pub(super) struct PlanScratch {
    pub context: QueryContext,
    /// Time at which plans are broken off; `None`: never.
    pub deadline: Option<Instant>,
    pub answer: Answer,
    /// Obstacles as they are when the answer is taken over.
    pub ahead: Vec<Obstacle>,
    /// The obstacles of `ahead`, larger by the margin of plans.
    pub wider: Vec<Obstacle>,
}
