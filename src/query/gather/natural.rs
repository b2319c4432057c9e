//! The natural motion, which the character plays if it does not evade, and where the attack hits it.

use crate::anim::{JointTransform, Pose, forward_kinematics};
use crate::graph::Motion;
use crate::maps::{BakedGraph, Stance};
use crate::query::clearance::{ExactTest, Extent, MotionBody, Sampling};
use crate::query::request::{ActiveRequest, Query};

/// The natural motion of a query. It is computed when it is first needed.
#[derive(Clone, Debug, Default)]
pub(in crate::query) struct NaturalMotion {
    motion: Motion,
    pose: Pose,
    joints: Vec<JointTransform>,
    /// Time of the contact, or `Some(None)` if the natural motion is not hit; `None` if it is not computed yet.
    contact: Option<Option<f32>>,
    /// Whether `motion` is the natural motion of this query.
    has_motion: bool,
}

impl NaturalMotion {
    /// Discards the motion of an earlier query.
    pub(in crate::query) fn start(&mut self) {
        (self.contact, self.has_motion) = (None, false);
    }

    /// Whether layers are enabled and the root of the natural motion moves over the ground at walking speed or faster.
    pub(in crate::query) fn walks(&mut self, query: Query<'_>, request: &ActiveRequest) -> bool {
        /// Time over which the speed is measured, in seconds, and minimum speed of a walk, in metres per second.
        const WALK: (f32, f32) = (0.3, 0.4);
        let Query { baked, settings } = query;
        if settings.entries.layers == 0 || !baked.entries().has_layers() {
            return false;
        }
        let motion = self.motion(baked, request);
        let [now, then] = [0.0, WALK.0].map(|seconds| motion.root(baked.graph(), seconds));
        (then - now).with_y(0.0).length() > WALK.0 * WALK.1
    }

    /// [`NaturalMotion::contact`], if it was needed.
    pub(in crate::query) fn known_contact(&self) -> Option<f32> {
        self.contact.flatten()
    }

    /// Time at which the attack hits the natural motion, in seconds.
    pub(super) fn contact(
        &mut self,
        baked: &BakedGraph,
        request: &ActiveRequest,
        body: &mut MotionBody,
    ) -> Option<f32> {
        if let Some(known) = self.contact {
            return known;
        }
        self.motion(baked, request);
        let test = ExactTest {
            extent: Extent::UNTIL_HIT,
            sampling: Sampling::CoarseFirst,
            ..ExactTest::new(baked, &request.attack)
        };
        let found = test.on_motion(&self.motion, body);
        let found = (!found.is_clean()).then_some(found.time);
        self.contact = Some(found);
        found
    }

    /// Time until which the root of the natural motion enters no obstacle, in seconds.
    pub(super) fn free_until(&mut self, baked: &BakedGraph, request: &ActiveRequest) -> f32 {
        if !request.removes_blocked() {
            return f32::INFINITY;
        }
        let motion = self.motion(baked, request);
        let end = motion.moment_at(request.attack.end());
        let hit = request.obstacles.until(baked.graph(), end, 0.0);
        hit.map_or(f32::INFINITY, |hit| hit.time)
    }

    pub(super) fn motion(&mut self, baked: &BakedGraph, request: &ActiveRequest) -> &Motion {
        if !std::mem::replace(&mut self.has_motion, true) {
            self.motion.restart(baked.graph(), request.playhead, []);
            self.motion.continue_blend(&request.blend, 0.0);
            self.motion
                .extend(baked.graph(), request.attack.end() + 0.5);
        }
        &self.motion
    }

    pub(super) fn stance(
        &mut self,
        baked: &BakedGraph,
        request: &ActiveRequest,
        seconds: f32,
    ) -> Stance {
        self.motion(baked, request);
        let (graph, joints) = (baked.graph(), &mut self.joints);
        self.motion.sample(graph, seconds, &mut self.pose);
        forward_kinematics(graph.skeleton(), &self.pose, joints);
        baked.stance(joints)
    }
}
