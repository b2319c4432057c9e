//! Tests candidates exactly.
//!
//! Source: Masaoka & Oshita, section 5.4. A candidate is tested against the attack and the obstacles
//! ([`clearance`](super::clearance)) and gets a [`Score`](super::Score). The [`Evaluator`] tests as few candidates as the choice needs.

mod candidate;
mod evaluator;
mod workers;

pub(crate) use candidate::evasions_end;
pub(super) use evaluator::{Bound, Evaluator};
