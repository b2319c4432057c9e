//! Maps drawn and compared with the stencil buffer.
//!
//! Source: Masaoka & Oshita, sections 4.3 (maps) and 5.3 (culling). Where the paper uses OpenGL, this records Vulkan.

mod atlas;
pub(crate) mod bits;
mod candidates;
mod commands;
mod culler;
mod drawing;
mod packing;
mod passes;
mod rasterizer;
mod readback;
mod slot;

pub use culler::{Culler, CullerDesc, Ticket};
pub use packing::{Batch, Plan};
pub use rasterizer::{MapKind, Rasterizer, RasterizerDesc};
