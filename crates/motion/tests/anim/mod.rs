//! Tests of `sabaki_motion::anim`.

mod compressed;
mod resampled;
mod rig;
