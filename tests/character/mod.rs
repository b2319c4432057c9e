//! Tests of `sabaki::character`.
mod hybrid_crowd;
mod obstacles;
mod save;
mod steer;
mod threats;
mod world;
