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
