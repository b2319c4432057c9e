//! The compute culling path: maps counted by a compute shader.
//!
//! Source: none; Masaoka & Oshita cull with the stencil buffer. The maps are those of the other paths.

mod blocks;
mod commands;
mod gathered;
mod path;
mod plane_bits;
mod planes;
mod slot;

pub(super) use path::ComputePath;
