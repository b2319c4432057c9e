//! The parts of the command `sabaki` that tests, benches and examples use too: embedded motions, random attacks, a headless
//! Vulkan device, pictures without a window, and the window itself.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used))]
#![warn(unreachable_pub)]

pub mod demo;
pub mod film;
pub mod headless;
pub mod live;
mod painter;
pub mod percentile;
pub mod play;
#[cfg(feature = "window")]
mod present;
#[cfg(feature = "window")]
pub mod window;

pub use painter::Painter;
