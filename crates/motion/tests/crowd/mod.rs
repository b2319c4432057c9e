//! Tests of `sabaki_motion::crowd`.
mod alloc;
mod culling;
mod errors;
mod extremes;
mod frame;
mod inactive;
mod pose;
mod rebuild;
mod rotations;
mod sharing;
