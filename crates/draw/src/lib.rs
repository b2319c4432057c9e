//! Records pictures of characters, crowds and culling maps into the host's Vulkan command buffer.
//!
//! A [`scene::Shot`] describes one picture as plain data. A [`Stage`] records a shot into the
//! host's command buffer and draws into the host's image view. An [`Offscreen`] provides such an
//! image if there is no window.
//!
//! # Contract
//! - A [`Stage`] records outside of rendering, on a queue family with graphics. The target is in
//!   the layout `COLOR_ATTACHMENT_OPTIMAL` before and after, and its contents are overwritten. The
//!   host synchronizes all other uses of the target.
//! - Recording changes these states: graphics pipeline, descriptor set 0, push constants, index
//!   buffer, viewport and scissor.
//! - Slots are the host's frames in flight. A slot may be recorded again only after its commands
//!   have finished.
//! - A stage submits nothing and waits for nothing. It allocates nothing as long as a shot fits the
//!   sizes of [`StageDesc`].
//!
//! Architecture invariant: [`scene`] does not depend on Vulkan.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used))]
#![warn(unreachable_pub)]

mod body;
mod offscreen;
pub mod scene;
mod shaders;
mod stage;

pub use body::human_body;
pub use offscreen::Offscreen;
pub use stage::{Picture, Stage, StageDesc, Target};
