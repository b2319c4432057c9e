//! Tests of `sabaki::character`.
mod troupe;
