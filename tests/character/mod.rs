//! Tests of `sabaki::character`.
mod hybrid_crowd;
mod save;
mod steer;
mod threats;
mod world;
