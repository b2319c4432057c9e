//! Tests of `sabaki::crowd`.
mod frame;
mod pose;
mod rebuild;
