//! Pictures: fighters who dodge, crowds, the maps that they are culled by.
//!
//! [`scene`] says what there is to see, as plain data: a [`scene::Shot`] is one picture. [`Stage`] draws a shot on a
//! Vulkan device that the caller brings, as any renderer would be brought together with [`gpu`](crate::gpu): it records into the
//! caller's command buffer, and draws into an image view of the caller's. [`Offscreen`] is such an image where there is no window.
//! What moves is [`live`]: a fighter who walks and dodges, a crowd on the march; [`window`] shows it in a window of our own.
//!
//! # Contract
//! - A [`Stage`] records outside of rendering, on a queue family with graphics. The target is in the layout
//!   `COLOR_ATTACHMENT_OPTIMAL` before and after; what it held is drawn over. The caller orders its other uses of it.
//! - What is left bound: graphics pipeline, descriptor set 0, push constants, index buffer, viewport, scissor.
//! - Slots are the caller's frames in flight: one is recorded again when its commands have finished.
//! - Nothing is submitted or waited for, and nothing is allocated while a shot fits what the stage was made for.
//!
//! Architecture invariant: nothing in [`scene`] knows that Vulkan exists.

pub mod film;
pub mod live;
mod offscreen;
mod painter;
mod present;
pub mod scene;
mod shaders;
mod stage;
pub mod window;

pub use offscreen::Offscreen;
pub use painter::Painter;
pub use stage::{Stage, StageDesc, Target};
