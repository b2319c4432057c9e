//! Reads and writes skinned animations and meshes in glTF 2.0.
//!
//! Source: Khronos, "glTF 2.0 Specification", 3.5 (nodes), 3.6 (buffers and accessors), 3.7.3 (skins), 3.11 (animations), 4 (GLB).
//!
//! [`GltfFile`] reads only the data that moves a skeleton: nodes, skins and animations. Meshes and materials
//! are ignored, including the extensions that they require. Joints have no scale, so the scale of a
//! node is applied to the positions of the joints below it. This is exact if the scale is uniform.
//! [`SkinnedMesh`] reads the mesh of the same skin.

mod accessor;
mod animation;
mod channels;
mod container;
mod error;
mod file;
mod mesh;
mod nodes;
mod texture;
mod times;
mod write;

pub use error::GltfError;
pub use file::{GltfAnimation, GltfFile};
pub use mesh::{MOST_VERTICES, SkinJoint, SkinVertex, SkinnedMesh};
pub use texture::Texture;
pub use write::{write, write_labelled};
