//! Tests of `sabaki::anim`.
mod compressed;
