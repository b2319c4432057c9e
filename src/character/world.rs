use std::time::Instant;

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::event::{CharacterId, ThreatId};
use super::flights::Flights;
use super::settings::CharacterSettings;
use super::steer::{SteerScratch, Steering};
use super::strike::Limb;
use super::threat::{Threat, Window};
use crate::anim::{JointTransform, Pose, forward_kinematics};
use crate::crowd::ExternalPose;
use crate::graph::{JointReach, Motion, MotionMoment};
use crate::maps::BakedGraph;
use crate::query::clearance::AdditiveLayer;
use crate::query::{Answer, Attack, Obstacle, QueryContext};

/// Data that all characters of a kind share in a step.
pub(super) struct World<'a> {
    pub baked: &'a BakedGraph,
    pub settings: &'a CharacterSettings,
    pub steering: &'a Steering,
    pub threats: &'a [KnownThreat],
    pub flights: &'a Flights,
    /// Obstacles, at the start of the step.
    pub obstacles: &'a [Obstacle],
    /// All characters, if they avoid or strike each other.
    pub bodies: &'a [OtherBody],
    /// Time at the start of the step, in seconds.
    pub now: f64,
    pub dt: f32,
}

impl<'a> World<'a> {
    /// Time at the end of the step, in seconds.
    pub(super) fn end(&self) -> f64 {
        self.now + f64::from(self.dt)
    }

    /// Those of the threats with these indices that a character has to avoid.
    pub(super) fn threats_of<'l>(
        &self,
        id: CharacterId,
        indices: &'l [u32],
    ) -> impl Iterator<Item = &'a KnownThreat> + use<'a, 'l> {
        let threats = self.threats;
        let each = indices.iter().map(move |&index| &threats[index as usize]);
        each.filter(move |known| known.is_for(id))
    }

    /// Index of a threat, if it still exists.
    pub(super) fn threat_index(&self, id: ThreatId) -> Option<usize> {
        let found = self.threats.binary_search_by_key(&id, |known| known.id);
        found.ok()
    }
}

/// A threat and the number of its changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct KnownThreat {
    pub id: ThreatId,
    pub version: u32,
    /// The threat; for a limb the ball around all of its way.
    pub threat: Threat,
    /// The striking limb that it is, if it is one.
    pub limb: Option<Limb>,
}

/// A character as the others see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OtherBody {
    pub id: CharacterId,
    /// Position on the ground (x, z), in metres.
    pub place: Vec2,
    /// Height of its ground, in metres.
    pub height: f32,
    /// Height of its root above that ground, in metres.
    pub root: f32,
    /// Velocity on the ground (x, z), in metres per second.
    pub velocity: Vec2,
    /// [`CharacterSettings::body_radius`].
    pub radius: f32,
}

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
    /// Indices of the threats near the character that is stepped.
    pub threats: Vec<u32>,
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
    pub(super) fn pose_body(
        &mut self,
        baked: &BakedGraph,
        moment: MotionMoment<'_>,
        additive: &AdditiveLayer,
    ) {
        let graph = baked.graph();
        moment.motion.sample(graph, moment.seconds, &mut self.pose);
        additive.apply(&mut self.pose);
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
    /// Whether the plan had all the time of the step.
    pub is_first: bool,
    pub answer: Answer,
    pub steer: SteerScratch,
    pub pose: Pose,
    /// Obstacles as they are when the answer is taken over.
    pub ahead: Vec<Obstacle>,
    /// The obstacles of `ahead`, larger by the margin of plans.
    pub wider: Vec<Obstacle>,
    /// The threats that may reach the body.
    pub near: Vec<NearThreat>,
    /// The attack of the threats as they are, and that of an attempt; `None` before the first plan.
    pub attacks: Option<[Attack; 2]>,
    /// Memory of motions.
    spare: Vec<Motion>,
}

impl PlanScratch {
    /// An empty motion, in the memory of an earlier one.
    pub(super) fn motion(&mut self) -> Motion {
        let mut motion = self.spare.pop().unwrap_or_default();
        motion.clear();
        motion
    }

    /// Keeps the memory of a motion for the next ones.
    pub(super) fn keep_memory(&mut self, motion: Motion) {
        /// Motions that one thread begins may end in another.
        const MOST: usize = 16;
        if self.spare.len() < MOST {
            self.spare.push(motion);
        }
    }
}

/// A threat that may reach the body within the horizon, and when.
#[derive(Clone, Copy)]
pub(super) struct NearThreat {
    /// Index of the threat.
    pub index: u32,
    pub window: Window,
}
