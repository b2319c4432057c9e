//! glTF 2.0: skinned animation in and out.
//!
//! Source: Khronos, "glTF 2.0 Specification", 3.5 (nodes), 3.6 (buffers and accessors), 3.7.3 (skins), 3.11 (animations), 4 (GLB).
//!
//! Only what moves a skeleton is read: nodes, skins, animations and their numbers; meshes and materials are not looked at, whatever
//! extensions they ask for. A scale of nodes goes into the places of the joints below, since joints have none here: exact where it is
//! the same along all axes.

mod accessor;
mod animation;
mod container;
mod error;
mod file;
mod nodes;
mod times;
mod write;

pub use error::GltfError;
pub use file::{GltfAnimation, GltfFile, MOST_ENTRIES};
pub use write::{write, write_labelled};
