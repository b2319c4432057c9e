//! Rigid transforms of the ground plane; the choice of an instruction set; threads; rounding.

mod isa;
mod parallel;
mod rigid2;
mod round;

pub use isa::{Isa, Lookup, Words};
pub use parallel::{in_parallel, thread_count};
pub use rigid2::Rigid2;
pub use round::{floor, round};
