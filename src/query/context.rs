use super::cull::{Counted, cpu};
use super::evaluate::EvaluateScratch;
use super::gather::GatherScratch;
use super::place::PlaceScratch;
use super::state::QueryState;

/// The memory of queries: the state of the current one, and scratch. A query allocates nothing once its context has held similar
/// ones. Every thread needs its own, and so does every query that waits for its counts.
#[derive(Clone, Debug, Default)]
pub struct QueryContext {
    pub(super) state: QueryState,
    pub(super) scratch: Scratch,
    pub(super) culler: ChoiceCuller,
}

/// Scratch of the stages.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    pub gather: GatherScratch,
    pub place: PlaceScratch,
    pub evaluate: EvaluateScratch,
}

/// The CPU's culler, counting what a choice needs.
#[derive(Clone, Debug)]
pub(super) struct ChoiceCuller(pub cpu::Culler);

impl Default for ChoiceCuller {
    fn default() -> Self {
        Self(cpu::Culler::default().counting(Counted::FOR_A_CHOICE))
    }
}
