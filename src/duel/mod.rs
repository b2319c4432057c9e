//! Duels: two fighters of one graph attack and avoid in turn.
//!
//! Source: a task that Masaoka & Oshita leave for later (section 7). Attacks are chosen as in Lee & Lee, "Precomputing Avatar Behavior
//! from Human Motion Data" (2004): by a grid at each node over the position of the opponent
//! ([`AttackGrid`](crate::maps::AttackGrid)). Differs: if the grid has no attack, the fighters approach by a search through the graph.
//! Two moving fighters must also stay apart and inside the arena, which no precomputed table ensures.
//!
//! A [`Duel`] keeps its own time. [`Duel::challenge`] advances it to the next attack and announces it. The caller answers it by a
//! [`Query`](crate::query::Query) with any culling path. [`Duel::settle`] plays attack and answer, tests the answer exactly, and
//! passes the turn to the other fighter. The motions of both fighters can be played back.
//!
//! The same settings give the same duel, bit for bit, on any number of threads.

mod choose_attack;
mod duel_state;
mod fighter;
mod footwork;
mod record;
mod rng;
mod settings;
mod spacing;
mod trunk;

pub use duel_state::Duel;
pub use fighter::Fighter;
pub use record::{Challenge, Exchange, Score, Side};
pub use settings::{DuelError, DuelSettings, LeadTime};
pub use trunk::Trunk;
