//! Attack in, path and playback rates out.

pub mod cull;
