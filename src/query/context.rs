use std::time::Instant;

use super::clearance::MotionBody;
use super::cull::{Counted, cpu};
use super::evaluate::EvaluateScratch;
use super::gather::GatherScratch;
use super::place::PlaceScratch;
use super::state::QueryState;

/// The memory of queries: the state of the current query, and scratch. A query allocates nothing if its context has been used for similar
/// queries. Every thread needs its own context, and so does every query that waits for its counts.
#[derive(Clone, Debug, Default)]
pub struct QueryContext {
    pub(super) state: QueryState,
    pub(super) scratch: Scratch,
    pub(super) culler: ChoiceCuller,
}

impl QueryContext {
    /// The memory of exact tests, with the poses of the latest query or plan.
    pub(crate) fn body(&mut self) -> &mut MotionBody {
        self.scratch.evaluate.body()
    }

    /// Sets the time at which the tests of a plan end, or `None`, and removes the poses of earlier queries.
    pub(crate) fn start_plan(&mut self, deadline: Option<Instant>) {
        self.forget_poses();
        self.body().set_deadline(deadline);
    }

    /// Ends a plan. Returns `false` if its time was over before: its results are to be discarded.
    pub(crate) fn end_plan(&mut self) -> bool {
        let body = self.body();
        let in_time = !body.is_late();
        body.set_deadline(None);
        in_time
    }

    /// Removes the poses of earlier queries.
    pub(crate) fn forget_poses(&mut self) {
        self.scratch.evaluate.forget_poses();
    }
}

/// Scratch of the stages.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    pub gather: GatherScratch,
    pub place: PlaceScratch,
    pub evaluate: EvaluateScratch,
}

/// The CPU culler, which counts the parts that a choice needs.
#[derive(Clone, Debug)]
pub(super) struct ChoiceCuller(pub cpu::Culler);

impl Default for ChoiceCuller {
    fn default() -> Self {
        Self(cpu::Culler::default().counting(Counted::FOR_A_CHOICE))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::time::Duration;

    use glam::Vec3;

    use super::*;
    use crate::anim::Pose;
    use crate::graph::{EdgeId, Playhead};
    use crate::maps::SphereKey;
    use crate::math::Rigid2;
    use crate::query::warp::fixture::baked;
    use crate::query::{Answer, Attack, PlanScope, Query, QuerySettings, Request};

    #[test]
    fn what_follows_a_plan_that_was_late_is_what_it_would_have_been() {
        let key = |t: f32, z: f32| SphereKey {
            t,
            center: Vec3::new(0.0, 1.3, z),
            radius: 0.1,
        };
        let attack = Attack::new(vec![vec![key(0.5, 3.0), key(1.0, -1.0)]]).unwrap();
        let settings = QuerySettings::default();
        let plan = |context: &mut QueryContext, deadline: Option<Instant>| {
            let playhead = Playhead::at(baked().graph(), EdgeId(0), 0.0, Rigid2::IDENTITY);
            let scope = PlanScope {
                plain: &attack,
                margin: 0.03,
                evasions_only: false,
            };
            let mut answer = Answer::default();
            context.start_plan(deadline);
            let request = Request::new(playhead, &attack);
            Query::new(baked(), &settings).answer_plan(request, scope, context, &mut answer);
            (context.end_plan(), answer)
        };
        let (in_time, alone) = plan(&mut QueryContext::default(), None);
        assert!(in_time);
        assert!(alone.clearance().metres < 1.0);
        let mut context = QueryContext::default();
        let now = Instant::now();
        assert!(!plan(&mut context, Some(now)).0);
        for deadline in [None, Some(now + Duration::from_secs(600))] {
            let (in_time, after) = plan(&mut context, deadline);
            assert!(in_time);
            assert_eq!(after.avoided, alone.avoided);
            assert_eq!(after.clearance(), alone.clearance());
            let moments = [after, alone.clone()].map(|answer| {
                let mut pose = Pose::default();
                answer.motion.sample(baked().graph(), 0.9, &mut pose);
                pose
            });
            assert_eq!(moments[0], moments[1]);
        }
    }
}
