//! The kernel: poses groups of sixteen characters. Its loop stands at the head of `pose`.
#![allow(
    clippy::needless_range_loop,
    reason = "the index is a part of the lanes"
)]

pub(super) mod batches;
mod chain;
mod fade;
mod joint_math;
pub(super) mod moments;
mod pose;
mod sampling;
pub(super) mod write;
