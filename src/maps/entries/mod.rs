//! Entries and exits: cuts that need no edge of the graph. Entries lead from any moment of the clips into evasions, exits from any moment back
//! into natural motion.
//!
//! Source: the cut is that of [`Entry`](crate::graph::Entry) (Bollo, GDC 2018). The table is computed by the bake: each moment of the
//! clips is paired with each moment of each evasion and of its lead-in. A pair is kept if the blended motion stays within the limits that
//! are measured in the clips ([`MotionLimits`]). An entry takes four bytes.
mod examine;
pub(crate) mod find;
mod finder;
mod frames;
mod layers;
mod limits;
mod report;
mod stance;
mod table;
mod targets;
#[cfg(test)]
mod tests;

pub use find::{EntryShare, MomentShare};
pub(crate) use limits::head;
pub use report::{EntryReport, Stretches};
pub(crate) use stance::Stance;
pub(super) use stance::TargetStances;
pub(crate) use table::{EntryTable, KnownEntry};
