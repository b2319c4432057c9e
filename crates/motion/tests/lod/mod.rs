//! Tests of `sabaki_motion::lod`.

mod alloc;
mod budget;
mod chains;
mod drawn;
mod energy;
mod levels;
mod motion;
mod switching;
