//! Pictures of characters, crowds and the maps that they are culled by, recorded into the host's Vulkan command buffer.
//!
//! A [`scene::Shot`] describes one picture as plain data. A [`Stage`] records a shot into the host's command buffer and draws
//! into the host's image view. An [`Offscreen`] is such an image where there is no window.
//!
//! # Contract
//! - A [`Stage`] records outside of rendering, on a queue family with graphics. The target is in the layout
//!   `COLOR_ATTACHMENT_OPTIMAL` before and after, and its content is overwritten. The host orders its other uses of it.
//! - Left bound: graphics pipeline, descriptor set 0, push constants, index buffer, viewport, scissor.
//! - Slots are the host's frames in flight. A slot is recorded again only after its commands have finished.
//! - Nothing is submitted or waited for, and nothing is allocated while a shot fits the sizes of [`StageDesc`].
//!
//! Architecture invariant: nothing in [`scene`] knows that Vulkan exists.
#![warn(unreachable_pub)]

mod offscreen;
pub mod scene;
mod shaders;
mod stage;

pub use offscreen::Offscreen;
pub use stage::{Stage, StageDesc, Target};

/// Image layout transitions that `sabaki-app` uses for its window. Not covered by semantic versioning.
#[doc(hidden)]
pub mod internal {
    pub use crate::stage::image_use::{COPIED, DRAWN, Use, copy_to_host, turn};
}
