//! Reasons why files cannot be read.

use std::path::{Path, PathBuf};

use sabaki::anim::ClipError;
use thiserror::Error;

use crate::gltf::GltfError;
use crate::{LONGEST_CLIP, MOST_ENTRIES, ObjError, RecordingError, SCALES, TextError};

/// Reason why files cannot be read.
#[derive(Debug, Error)]
pub enum ReadError {
    /// A file or folder cannot be used.
    #[error("{}: {error}", path.display())]
    File {
        /// Path of the file or folder.
        path: PathBuf,
        /// The reason.
        error: Box<FileError>,
    },
    /// The given scale is out of range.
    #[error("a scale of {0} metres per unit is not possible; it must be {least:e} to {most:e}", least = SCALES.start(), most = SCALES.end())]
    Scale(f64),
    /// The given frame rate is invalid.
    #[error("{0} frames a second are not possible")]
    Rate(f64),
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
}

/// Reason why a file cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FileError {
    /// The file system returned an error.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// The file is larger than [`sabaki::archive::LARGEST_FILE`].
    #[error("larger than {} MB", sabaki::archive::LARGEST_FILE / 1_000_000)]
    TooLarge,
    /// The file holds several motions of these names, but one is expected.
    #[error("it holds several motions: {}", shortened(.0))]
    Several(Vec<String>),
    /// The ASF file of an AMC file was not found under these names.
    #[error("an AMC file needs its skeleton: {}, or the only *.asf file of its folder", .0.join(" or "))]
    NoSkeleton(Vec<String>),
    /// The motion lasts longer than [`LONGEST_CLIP`], in seconds.
    #[error("the motion lasts {0} s; {LONGEST_CLIP} s is the most")]
    TooLong(f64),
    /// The folder contains no motion file.
    #[error("no motion file (BVH, AMC, glTF, FBX) there")]
    NoClips,
    /// Another file of the set has the same name.
    #[error("a second clip of that name; the first is {}", .0.display())]
    DuplicateClip(PathBuf),
    /// The skeleton differs from that of the first file.
    #[error("its skeleton differs from that of {} in {}", first.display(), shortened(joints))]
    SkeletonDiffers {
        /// First file of the set.
        first: PathBuf,
        /// Names of the joints that differ.
        joints: Vec<String>,
    },
    /// A file of joints or masses names a joint that the skeleton does not have.
    #[error("the skeleton has no joint \"{0}\"")]
    UnknownJoint(String),
    /// The files of one skeleton are in different units.
    #[error(
        "its bones are {times:.4} times as long as those of {}, which has the same joints: bring both to one unit, or bake them apart",
        first.display()
    )]
    UnitDiffers {
        /// File whose unit most files have.
        first: PathBuf,
        /// Length of a chain of bones, in lengths of that chain in the other file.
        times: f64,
    },
    /// The files of one skeleton have different axes that point up.
    #[error(
        "its figure stands along {own}, but that of {}, which has the same joints, along {up}: turn one of them, or bake them apart",
        first.display()
    )]
    UpDiffers {
        /// First file of the skeleton.
        first: PathBuf,
        /// Axis along which the file's figure stands.
        own: &'static str,
        /// Axis along which most figures stand.
        up: &'static str,
    },
    /// The motion cannot be put on the skeleton of the others, because more than a quarter of that skeleton's joints have no joint of
    /// their name in the file.
    #[error("it cannot be put on the skeleton of {}: no joint of it is named {}", first.display(), shortened(missing))]
    NotRetargeted {
        /// First file of the set.
        first: PathBuf,
        /// Names of the joints that the file does not have.
        missing: Vec<String>,
    },
    /// The motion is invalid on the skeleton of the others, for example because its root is too far away there.
    #[error("on the skeleton of the other files: {0}")]
    Retargeted(ClipError),
    /// A BVH, ASF or AMC file, or a JSON file, is invalid.
    #[error(transparent)]
    Text(#[from] TextError),
    /// A glTF file is invalid or has no skinned animation.
    #[error(transparent)]
    Gltf(#[from] GltfError),
    /// An FBX file cannot be read.
    #[cfg(feature = "fbx")]
    #[error(transparent)]
    Fbx(#[from] crate::FbxError),
    /// The skeleton or the motion is invalid, usually because of an unsuitable scale.
    #[error(transparent)]
    Clip(#[from] ClipError),
    /// The motion would take too much memory.
    #[error("{frames} frames of {joints} joints; {MOST_ENTRIES} rotations in all are the most")]
    TooManyEntries {
        /// Number of frames.
        frames: usize,
        /// Number of joints of the skeleton, with end sites.
        joints: usize,
    },
    /// There is no clip of the name that an events file has.
    #[error("events for \"{file}\", but there is no such clip")]
    NoClip {
        /// Name of the clip's file, as written.
        file: String,
    },
    /// The name that an events file has stands for several clips.
    #[error(
        "events for \"{file}\", which may be any of the clips {}",
        shortened(clips)
    )]
    SeveralClips {
        /// Name of the clip's file, as written.
        file: String,
        /// Names of these clips.
        clips: Vec<String>,
    },
    /// An attack file has no attack.
    #[error("the file holds no attack")]
    NoAttack,
    /// A body file has no sphere.
    #[error("the file holds no sphere")]
    NoSphere,
    /// An event, an attack, a sphere or a mass of a JSON file is not possible, or does not fit the clip or the skeleton.
    #[error("{entry}: {problem}")]
    Entry {
        /// The entry, with its index from 0, and with the file or joint that it names.
        entry: String,
        /// Description of the problem.
        problem: String,
    },
    /// An exported answer is invalid or belongs to another graph.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// An OBJ file is invalid or contains no mesh.
    #[error(transparent)]
    Obj(#[from] ObjError),
}

impl FileError {
    pub(crate) fn entry(entry: String, problem: impl ToString) -> Self {
        let problem = problem.to_string();
        Self::Entry { entry, problem }
    }
}

impl ReadError {
    /// Adds the path of a file to an error, for `map_err`.
    pub fn in_file<E: Into<FileError>>(path: &Path) -> impl FnOnce(E) -> Self {
        |error| Self::File {
            path: path.to_owned(),
            error: Box::new(error.into()),
        }
    }
}

/// The first names of a list, quoted, and the number of the remaining names.
pub(crate) fn shortened(joints: &[String]) -> String {
    const MOST: usize = 8;
    let named = joints.iter().take(MOST).map(|joint| format!("\"{joint}\""));
    let named = named.collect::<Vec<_>>().join(", ");
    match joints.len().saturating_sub(MOST) {
        0 => named,
        more => format!("{named} and {more} more"),
    }
}
