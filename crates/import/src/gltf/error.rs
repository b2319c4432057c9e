use thiserror::Error;

use super::MOST_ENTRIES;
use sabaki::anim::{ClipError, Skeleton, SkeletonError};

/// Why a file is no skinned animation in glTF.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum GltfError {
    /// A GLB container is cut off, or its parts do not lie where it says.
    #[error("the GLB container is damaged: {0}")]
    Container(&'static str),
    /// The version is not 2.
    #[error("glTF {0}: only version 2 can be read")]
    Version(String),
    /// The JSON is none, or not glTF's.
    #[error("{0}")]
    Json(String),
    /// An index points to nothing.
    #[error("{from} names {what} {index}, which is not there")]
    Index {
        /// What holds the index.
        from: String,
        /// Of what kind.
        what: &'static str,
        /// The index.
        index: usize,
    },
    /// A buffer cannot be had.
    #[error("buffer {buffer}: {problem}")]
    Buffer {
        /// Index of the buffer.
        buffer: usize,
        /// Why.
        problem: String,
    },
    /// An accessor does not lie within its buffer, or does not hold what it is used for.
    #[error("accessor {accessor}: {problem}")]
    Accessor {
        /// Index of the accessor.
        accessor: usize,
        /// Why.
        problem: &'static str,
    },
    /// Neither a skin nor an animation names a node.
    #[error("the file has no skin and no animated node")]
    NoJoints,
    /// There is no animation that moves the skeleton.
    #[error("the file has no animation of its skeleton")]
    NoAnimation,
    /// A node is its own ancestor, or has two parents.
    #[error("node {0} hangs on itself or on two nodes")]
    Tree(usize),
    /// The joints do not hang together.
    #[error("the joints hang on several roots: nodes {0} and {1} have no ancestor in common")]
    Roots(usize, usize),
    /// More joints than an index can name.
    #[error("more than {max} joints", max = Skeleton::MAX_JOINTS)]
    TooManyJoints,
    /// A key's time or value makes no sense.
    #[error("animation \"{animation}\", node \"{node}\", key {key}: {problem}")]
    Key {
        /// Name of the animation.
        animation: String,
        /// Name of the node.
        node: String,
        /// Zero-based.
        key: usize,
        /// What is wrong.
        problem: &'static str,
    },
    /// An animation's `extras` hold events that are none.
    #[error("animation \"{animation}\": the events in its extras: {problem}")]
    Events {
        /// Name of the animation.
        animation: String,
        /// What is wrong.
        problem: String,
    },
    /// The animation would fill the memory.
    #[error(
        "animation \"{animation}\": {frames} frames of {joints} joints; {MOST_ENTRIES} rotations in all are the most"
    )]
    TooLong {
        /// Name of the animation.
        animation: String,
        /// How many frames.
        frames: u64,
        /// Joints of the skeleton.
        joints: usize,
    },
    /// The joints form no skeleton.
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
    /// The motion is none: as a rule, places out of all range.
    #[error(transparent)]
    Clip(#[from] ClipError),
}
