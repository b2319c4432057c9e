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

use sabaki::anim::{ClipError, Skeleton, SkeletonError};
use thiserror::Error;

use crate::MOST_ENTRIES;
pub(crate) use buffers::ReadPurpose;
pub use file::{GltfAnimation, GltfFile};
pub use mesh::{MOST_VERTICES, SkinJoint, SkinVertex, SkinnedMesh, Texture};
pub use write::write;
#[cfg(feature = "fbx")]
pub(crate) use write::{Buffer, animation_of};

/// Reason why a file cannot be read as a skinned glTF animation.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum GltfError {
    /// The GLB container is truncated, or a chunk is out of range.
    #[error("the GLB container is damaged: {0}")]
    Container(&'static str),
    /// The version is not 2.
    #[error("glTF {0}: only version 2 can be read")]
    Version(String),
    /// The JSON is invalid, or is not glTF.
    #[error("neither a GLB container nor the JSON of glTF: {0}")]
    Json(String),
    /// An index is out of range.
    #[error("{from} names {what} {index}, which is not there")]
    Index {
        /// The object with the index.
        from: String,
        /// Kind of the object that it refers to.
        what: &'static str,
        /// The index.
        index: usize,
    },
    /// A part of the file, such as a buffer, an accessor, an image or a key of an animation, cannot be used.
    #[error("{part}: {problem}")]
    Part {
        /// The part, with its index or name.
        part: String,
        /// Description of the problem.
        problem: String,
    },
    /// The file requires an extension that is not read.
    #[error("it requires the extension {0}, which is not read")]
    Extension(String),
    /// No triangles belong to a skin.
    #[error("the file has no skinned mesh")]
    NoMesh,
    /// The mesh is invalid.
    #[error("the skinned mesh: {0}")]
    Mesh(&'static str),
    /// No skin and no animation refers to a node.
    #[error("the file has no skin and no animated node")]
    NoJoints,
    /// No animation moves the skeleton.
    #[error("the file has no animation of its skeleton")]
    NoAnimation,
    /// A node is its own ancestor or has two parents.
    #[error("node {0} hangs on itself or on two nodes")]
    Tree(usize),
    /// The joints have no common root.
    #[error("the joints hang on several roots: nodes {0} and {1} have no ancestor in common")]
    Roots(usize, usize),
    /// There are more joints, or nodes one below the other, than the maximum.
    #[error("more than {max} joints", max = Skeleton::MAX_JOINTS)]
    TooManyJoints,
    /// The animations would need too much memory.
    #[error("the animations have {keys} keys together; {MOST_ENTRIES} are the most")]
    TooManyKeys {
        /// Number of keys; values of cubic splines count three times.
        keys: u64,
    },
    /// The joints do not form a valid skeleton.
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
    /// The motion is invalid, usually because positions are too far away.
    #[error(transparent)]
    Clip(#[from] ClipError),
}

impl GltfError {
    fn part(part: impl Into<String>, problem: impl Into<String>) -> Self {
        let (part, problem) = (part.into(), problem.into());
        Self::Part { part, problem }
    }

    fn index(from: impl Into<String>, what: &'static str, index: usize) -> Self {
        let from = from.into();
        Self::Index { from, what, index }
    }

    fn animation(name: &str, problem: impl Into<String>) -> Self {
        Self::part(format!("animation \"{name}\""), problem)
    }
}
