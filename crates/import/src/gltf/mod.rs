//! Reads and writes skinned animations and meshes in glTF 2.0.
//!
//! Source: Khronos, "glTF 2.0 Specification", 3.5 (nodes), 3.6 (buffers and accessors), 3.7.3 (skins), 3.11 (animations), 4 (GLB).
//!
//! [`GltfFile`] reads only the data that moves a skeleton: nodes, skins and animations. Meshes and materials
//! are ignored, including the extensions that they require. Compressed buffers (`EXT_meshopt_compression`) are decoded. Joints have no scale, so the scale of a
//! node is applied to the positions of the joints below it. This is exact if the scale is uniform, mirrored or not; otherwise joints are
//! turned so that their bones keep their directions.
//! [`SkinnedMesh`] reads the meshes of all skins.

mod animation;
mod buffers;
mod file;
mod mesh;
mod nodes;
mod write;

pub(crate) use buffers::ReadPurpose;
pub use file::{GltfAnimation, GltfFile};
pub use mesh::{MOST_VERTICES, SkinJoint, SkinVertex, SkinnedMesh, Texture};
pub use write::write;
#[cfg(feature = "fbx")]
pub(crate) use write::{Buffer, animation_of};

use std::fmt::Display;

use crate::FileError;

/// An object of a list of the file, which another one names by its index.
fn named<'a, T>(
    list: &'a [T],
    index: usize,
    from: impl Display,
    what: &str,
) -> Result<&'a T, FileError> {
    let missing = || FileError::Invalid(format!("{from} names {what} {index}, which is not there"));
    list.get(index).ok_or_else(missing)
}
