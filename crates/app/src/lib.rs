//! The parts of the command `sabaki`: pictures without a window, and the window itself.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used))]
#![warn(unreachable_pub)]

pub mod film;
mod painter;
pub mod percentile;
pub mod play;
#[cfg(feature = "window")]
pub mod window;

pub use painter::Painter;
