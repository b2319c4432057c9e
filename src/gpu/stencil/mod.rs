//! Maps drawn and compared with the stencil buffer.
//!
//! Source: Masaoka & Oshita, sections 4.3 (maps) and 5.3 (culling). Where the paper uses OpenGL, this records Vulkan.

mod atlas;
mod balance;
mod cells;
mod commands;
mod culler;
mod drawing;
mod gathered;
mod maps;
mod packing;
mod passes;
mod rasterizer;
mod readback;
mod shelves;
mod slot;
mod tally;

pub use culler::{Culler, CullerDesc, Ticket};
pub use packing::{Batch, Plan};
pub use rasterizer::{MapKind, Rasterizer, RasterizerDesc};
pub use tally::Counting;
