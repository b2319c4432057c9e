//! Rigid transforms of the ground plane; the choice of an instruction set.

mod isa;
mod rigid2;

pub use isa::Isa;
pub use rigid2::Rigid2;
