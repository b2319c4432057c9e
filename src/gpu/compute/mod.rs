//! Maps counted by a compute shader.
//!
//! Source: none; Masaoka & Oshita cull with the stencil buffer. The maps are those of the other paths.

mod commands;
mod culler;
mod gathered;
mod pages;
mod slot;

pub use culler::{Culler, CullerDesc, InputWay, Ticket};
