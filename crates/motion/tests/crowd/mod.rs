//! Tests of `sabaki_motion::crowd`.

mod alloc;
mod changes;
mod errors;
mod extremes;
mod frame;
mod inactive;
mod pose;
mod sharing;
