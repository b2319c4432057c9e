//! Tests of `sabaki_motion::crowd`.
mod errors;
mod extremes;
mod frame;
mod pose;
mod rebuild;
mod sharing;
