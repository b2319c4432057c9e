//! The kernel: poses groups of sixteen characters. Its loop stands at the head of `pose`.

pub(super) mod batches;
mod chain;
mod fade;
mod joint_math;
pub(super) mod moments;
mod pose;
mod sampling;
pub(super) mod write;
