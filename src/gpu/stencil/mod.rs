//! Maps drawn and compared with the stencil buffer.
//!
//! Source: Masaoka & Oshita, sections 4.3 (maps) and 5.3 (culling). Where the paper uses OpenGL, this records Vulkan.

mod atlas;
mod balance;
mod batch;
mod boxes;
mod cells;
mod commands;
mod drawing;
mod gathered;
mod map_bits;
mod maps;
mod packed;
mod packing;
mod path;
mod rasterizer;
mod readback;
mod rules;
mod shelves;
mod slant;
mod slot;
mod way_back;

pub use batch::Batch;
pub(super) use path::StencilPath;
pub use rasterizer::{BatchMaps, MapKind, Rasterizer, RasterizerDesc};
