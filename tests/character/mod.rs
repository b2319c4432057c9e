//! Tests of `sabaki::character`.
mod hybrid_crowd;
