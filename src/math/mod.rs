//! Rigid transforms of the ground plane; the choice of an instruction set; lanes; squares of bits; threads; rounding.

pub(crate) mod bit_square;
pub(crate) mod byte_list;
pub(crate) mod code_rows;
mod isa;
pub(crate) mod lanes;
mod parallel;
mod rigid2;
mod round;
pub(crate) mod section;
mod sorted_indices;
pub(crate) mod sparse_words;
mod sphere;
mod worker_pool;

pub use isa::Isa;
pub(crate) use isa::Lookup;
pub(crate) use isa::Words;
pub use lanes::F32x16;
pub(crate) use lanes::{
    Apart, DistinctRows, Kernel, KeyColumns, KeyRows, KeyUnit, Lanes, NextColumns, PartWrite,
    RowLines, RowSet, Sixteen, StridedLines, UnitHalves, prefetch_for_write,
};
#[cfg(feature = "vulkan")]
pub(crate) use parallel::each;
pub(crate) use parallel::{both, fill, lock};
pub use parallel::{in_parallel, thread_count};
pub use rigid2::Rigid2;
pub use round::{floor, round};
pub(crate) use sorted_indices::{sort_rarely, sorted_indices};
pub use sphere::Sphere;
pub(crate) use worker_pool::WorkerPool;
