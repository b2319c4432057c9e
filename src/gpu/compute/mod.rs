//! Maps counted by a compute shader.
//!
//! Source: none; Masaoka & Oshita cull with the stencil buffer. The maps are those of the other paths.

mod blocks;
mod canvas;
mod commands;
mod culler;
mod gathered;
mod planes;
mod slot;

pub use culler::{Culler, CullerDesc, InputWay, Ticket};
