//! Rigid transforms of the ground plane; the choice of an instruction set; lanes; threads; rounding.

pub mod byte_list;
pub(crate) mod code_rows;
pub(crate) mod isa;
pub(crate) mod lanes;
pub mod parallel;
mod rigid2;
mod round;
mod smooth_step;
mod space;

pub use isa::{Isa, Lookup, Words};
pub use lanes::F32x16;
pub(crate) use lanes::{
    DistinctRows, Kernel, KeyColumns, KeyPlace, KeyRows, KeyUnit, Lanes, RowLines, RowSet,
};
pub use parallel::{in_parallel, thread_count};
pub use rigid2::{Rigid2, Sphere};
pub use round::{floor, round};
pub use smooth_step::smooth_step;
pub use space::Space;
