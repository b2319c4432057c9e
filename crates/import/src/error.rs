//! Reasons why files cannot be read.

use std::path::{Path, PathBuf};

use sabaki::anim::ClipError;
use thiserror::Error;

use crate::asf::AsfError;
use crate::bvh::{BvhError, MotionError};
use crate::gltf::GltfError;
use crate::{
    AttacksError, BodyFileError, EventsError, LONGEST_CLIP, MassFileError, ObjError,
    RecordingError, SCALES,
};

/// Reason why a file cannot be read, with the file.
#[derive(Debug, Error)]
pub enum ReadError {
    /// The file system returned an error.
    #[error("{}: {source}", path.display())]
    Io {
        /// Path of the file or folder.
        path: PathBuf,
        /// Error of the file system.
        source: std::io::Error,
    },
    /// The file is larger than [`sabaki::archive::LARGEST_FILE`].
    #[error("{}: larger than {} MB", path.display(), sabaki::archive::LARGEST_FILE / 1_000_000)]
    TooLarge {
        /// The file.
        path: PathBuf,
    },
    /// The contents of the file are invalid, or do not fit the skeleton or the graph.
    #[error("{}: {error}", path.display())]
    Contents {
        /// The file.
        path: PathBuf,
        /// Error and position.
        error: Box<ContentsError>,
    },
    /// A file holds several motions, but one is expected.
    #[error("{}: it holds several motions: {}", path.display(), shortened(clips))]
    Several {
        /// The file.
        path: PathBuf,
        /// Names of the motions.
        clips: Vec<String>,
    },
    /// The given scale is out of range.
    #[error("a scale of {0} metres per unit is not possible; it must be {least:e} to {most:e}", least = SCALES.start(), most = SCALES.end())]
    Scale(f64),
    /// The given frame rate is invalid.
    #[error("{0} frames a second are not possible")]
    Rate(f64),
    /// The ASF file of an AMC file was not found.
    #[error("{}: an AMC file needs its skeleton: {}, or the only *.asf file of its folder", path.display(), names.join(" or "))]
    NoSkeleton {
        /// The AMC file.
        path: PathBuf,
        /// File names that were tried.
        names: Vec<String>,
    },
    /// The motion is longer than [`LONGEST_CLIP`].
    #[error(
        "{}: the motion lasts {seconds} s; {} s is the most",
        path.display(),
        LONGEST_CLIP
    )]
    TooLong {
        /// The file.
        path: PathBuf,
        /// Duration, in seconds.
        seconds: f64,
    },
    /// Several files of a set cannot be used.
    #[error("{} of {files} files cannot be used", errors.len())]
    Files {
        /// Number of files in the set.
        files: usize,
        /// The error of each unusable file, in the order of the files.
        errors: Vec<ReadError>,
    },
    /// No path was given.
    #[error("no clip was named")]
    NoPaths,
    /// A folder contains no motion file.
    #[error("{}: no motion file (BVH, AMC, glTF, FBX) there", path.display())]
    NoClips {
        /// The folder.
        path: PathBuf,
    },
    /// Two files of one set have the same name.
    #[error("{}: a second clip of that name; the first is {}", path.display(), first.display())]
    DuplicateClip {
        /// The second file.
        path: PathBuf,
        /// The first file.
        first: PathBuf,
    },
    /// The skeleton of a file differs from that of the first file.
    #[error(
        "{}: its skeleton differs from that of {} in {}",
        path.display(),
        first.display(),
        shortened(joints)
    )]
    SkeletonDiffers {
        /// The file.
        path: PathBuf,
        /// First file of the set.
        first: PathBuf,
        /// Names of the joints that differ.
        joints: Vec<String>,
    },
    /// A file of joints names a joint that the skeleton does not have.
    #[error("{}: the skeleton has no joint \"{joint}\"", path.display())]
    UnknownJoint {
        /// The file.
        path: PathBuf,
        /// Name of the joint.
        joint: String,
    },
    /// The files of one skeleton are in different units.
    #[error(
        "{}: its bones are {times:.4} times as long as those of {}, which has the same joints: bring both to one unit, or bake them apart",
        path.display(),
        first.display()
    )]
    UnitDiffers {
        /// The file.
        path: PathBuf,
        /// File whose unit most files have.
        first: PathBuf,
        /// Length of a chain of bones, in lengths of that chain in the other file.
        times: f64,
    },
    /// The files of one skeleton have different axes that point up.
    #[error(
        "{}: its figure stands along {own}, but that of {}, which has the same joints, along {up}: turn one of them, or bake them apart",
        path.display(),
        first.display()
    )]
    UpDiffers {
        /// The file.
        path: PathBuf,
        /// First file of the skeleton.
        first: PathBuf,
        /// Axis along which the file's figure stands.
        own: &'static str,
        /// Axis along which most figures stand.
        up: &'static str,
    },
    /// The motion of a file cannot be put on the skeleton of the others, because more than a quarter of that skeleton's joints have no joint of
    /// their name in the file.
    #[error(
        "{}: it cannot be put on the skeleton of {}: no joint of it is named {}",
        path.display(),
        first.display(),
        shortened(missing)
    )]
    NotRetargeted {
        /// The file.
        path: PathBuf,
        /// First file of the set.
        first: PathBuf,
        /// Names of the joints that the file does not have.
        missing: Vec<String>,
    },
    /// The motion of a file is invalid on the skeleton of the others, for example because its root is too far away there.
    #[error("{}: on the skeleton of the other files: {error}", path.display())]
    Retargeted {
        /// The file.
        path: PathBuf,
        /// Reason why the motion is invalid.
        error: ClipError,
    },
}

/// Reason why the contents of a file cannot be used.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ContentsError {
    /// A BVH file is invalid.
    #[error(transparent)]
    Bvh(#[from] BvhError),
    /// A glTF file is invalid or has no skinned animation.
    #[error(transparent)]
    Gltf(#[from] GltfError),
    /// An FBX file cannot be read.
    #[cfg(feature = "fbx")]
    #[error(transparent)]
    Fbx(#[from] crate::FbxError),
    /// An ASF or AMC file is invalid.
    #[error(transparent)]
    Asf(#[from] AsfError),
    /// The scale makes lengths infinite, or the motion is too large.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// A file of joints is no such file.
    #[error(transparent)]
    Joints(#[from] crate::JsonError),
    /// An events file is invalid or does not fit the clips.
    #[error(transparent)]
    Events(#[from] EventsError),
    /// An attack file is invalid.
    #[error(transparent)]
    Attacks(#[from] AttacksError),
    /// An exported answer is invalid or belongs to another graph.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A body file is invalid or does not fit the skeleton.
    #[error(transparent)]
    Body(#[from] BodyFileError),
    /// A file of masses is invalid or does not fit the skeleton.
    #[error(transparent)]
    Masses(#[from] MassFileError),
    /// An OBJ file is invalid or contains no mesh.
    #[error(transparent)]
    Obj(#[from] ObjError),
}

impl ReadError {
    /// Adds the path of a file to an error in its contents, for `map_err`.
    pub fn in_file<E: Into<ContentsError>>(path: &Path) -> impl FnOnce(E) -> Self {
        |error| Self::Contents {
            path: path.to_owned(),
            error: Box::new(error.into()),
        }
    }
}

/// The first names of a list, quoted, and the number of the remaining names.
pub(crate) fn shortened(joints: &[String]) -> String {
    const MOST: usize = 8;
    let named: Vec<String> = joints
        .iter()
        .take(MOST)
        .map(|j| format!("\"{j}\""))
        .collect();
    let named = named.join(", ");
    match joints.len().saturating_sub(MOST) {
        0 => named,
        more => format!("{named} and {more} more"),
    }
}
