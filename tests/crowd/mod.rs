//! Tests of `sabaki::crowd`.
mod pose;
