//! Gathers the candidates of a query.
//!
//! Source: Masaoka & Oshita, section 5.1. Paths to an evasion come first ([`gather_evasions`]). The others are gathered only if the
//! choice may depend on them: evasions that are entered without an edge, evasions of the upper body alone, and moves without an evasion.

mod candidates;
mod entries;
mod evasions;
mod layers;
mod moves;
mod natural;

pub(crate) use candidates::MoveId;
pub use candidates::SearchReport;
pub(super) use candidates::{Candidate, CandidateKind, CandidateList, EntryCandidate};
pub(super) use entries::gather_entries;
pub(super) use evasions::{gather_evasions, reject_blocked};
pub(super) use layers::gather_layers;
pub(crate) use moves::MoveSearch;
pub(super) use moves::gather_moves;

#[derive(Clone, Debug, Default)]
pub(super) struct GatherScratch {
    pub evasions: evasions::EvasionScratch,
    pub natural: natural::NaturalMotion,
    pub ranking: layers::LayerRanking,
}
