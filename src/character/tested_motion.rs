//! The test of one motion against the threats and the obstacles of a plan.

use super::scratch::PlanScratch;
use super::world::World;
use crate::graph::Motion;
use crate::query::clearance::{Clearance, ExactTest, Extent, ObstacleTest, Sampling};
use crate::query::{Attack, evasions_end};

/// A motion, tested against threats and obstacles.
pub(super) struct TestedMotion {
    pub motion: Motion,
    pub clearance: Clearance,
    /// Depth in an obstacle times its weight, in metres; 0 for none.
    pub entered: f32,
    /// When threats have passed and evasions have ended, in seconds.
    pub end: f32,
}

impl TestedMotion {
    pub(super) fn is_clean(&self) -> bool {
        self.clearance.is_clean() && self.entered == 0.0
    }

    /// Depth of the hit, or of the entry times the obstacle's weight, in metres.
    pub(super) fn harm(&self) -> f32 {
        self.entered.max(-self.clearance.metres)
    }
}

/// The one with the least harm.
pub(super) fn least_harm(
    before: Option<TestedMotion>,
    other: TestedMotion,
) -> Option<TestedMotion> {
    match before {
        Some(before) if before.harm() <= other.harm() => Some(before),
        _ => Some(other),
    }
}

/// Tests motions against an attack and the obstacles of a plan.
#[derive(Clone, Copy)]
pub(super) struct PlanTest<'a> {
    pub world: &'a World<'a>,
    pub attack: &'a Attack,
}

impl PlanTest<'_> {
    /// A motion whose clearance is known, with what it enters left out.
    pub(super) fn known(&self, mut motion: Motion, clearance: Clearance) -> TestedMotion {
        let graph = self.world.baked.graph();
        motion.extend(graph, self.attack.end() + 0.1);
        let end = evasions_end(graph, &motion, self.attack.end());
        motion.extend(graph, end);
        TestedMotion {
            motion,
            clearance,
            entered: 0.0,
            end,
        }
    }

    /// Tests a motion, which is extended until the attack's end, until it is known whether it is clean.
    pub(super) fn until_hit(&self, mut motion: Motion, scratch: &mut PlanScratch) -> TestedMotion {
        motion.extend(self.world.baked.graph(), self.attack.end() + 0.1);
        let test = ExactTest {
            extent: Extent::UNTIL_HIT,
            ..ExactTest::new(self.world.baked, self.attack)
        };
        let clearance = test.on_motion(&motion, scratch.context.body());
        let mut tested = self.known(motion, clearance);
        if clearance.is_clean() {
            tested.entered = self.entered(&tested, 0.0, scratch);
        }
        tested
    }

    /// Measures the deepest hit and the most harmful entry.
    pub(super) fn measure(&self, tested: &mut TestedMotion, scratch: &mut PlanScratch) {
        let test = ExactTest {
            sampling: Sampling::CoarseFirst,
            ..ExactTest::new(self.world.baked, self.attack)
        };
        tested.clearance = test.on_motion(&tested.motion, scratch.context.body());
        tested.entered = self.entered(tested, f32::INFINITY, scratch);
    }

    /// Largest harm by an obstacle, or one above `enough`, in metres; 0 for none.
    fn entered(&self, tested: &TestedMotion, enough: f32, scratch: &mut PlanScratch) -> f32 {
        let test = ObstacleTest {
            baked: self.world.baked,
            obstacles: &scratch.ahead,
            seconds: (0.0, tested.end),
            enough,
        };
        let entered = scratch.context.body().worst_entry(&test, &tested.motion);
        entered.map_or(0.0, |entered| entered.harm)
    }
}
