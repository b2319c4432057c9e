//! The keys of all clips on all levels, in the form that the kernel reads.
//!
//! ```text
//! clip, level ─▶ tracks: a joint under one parent, 16-bit keys ─▶ key bank: columns and rows
//! ```

pub(super) mod animation_set;
pub(super) mod clip_times;
pub(super) mod key_bank;
pub(super) mod level_clips;
pub(super) mod tracks;
