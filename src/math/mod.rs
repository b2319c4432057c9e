//! Rigid transforms of the ground plane; the choice of an instruction set; threads.

mod isa;
mod parallel;
mod rigid2;

pub use isa::{Isa, Lookup, Words};
pub use parallel::{in_parallel, thread_count};
pub use rigid2::Rigid2;
