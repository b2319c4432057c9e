//! Maps drawn and compared with the stencil buffer.
//!
//! Source: Masaoka & Oshita, sections 4.3 (maps) and 5.3 (culling). Where the paper uses OpenGL, this records Vulkan.

mod drawing;
mod packing;
mod passes;
mod rasterizer;

pub use packing::{Batch, Plan};
pub use rasterizer::{MapKind, Rasterizer, RasterizerDesc};
