//! Tests of `sabaki::crowd`.
mod errors;
mod extremes;
mod frame;
mod pose;
mod rebuild;
mod sharing;
