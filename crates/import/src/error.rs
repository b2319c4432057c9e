//! Reasons why files cannot be read.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use sabaki::anim::ClipError;
use thiserror::Error;

use crate::fit::MeshError;
use crate::{MOST_ENTRIES, RecordingError, SCALES, TextError};

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
    /// The ASF file of an AMC file was not found under these names.
    #[error("an AMC file needs its skeleton: {}, or the only *.asf file of its folder", .0.join(" or "))]
    NoSkeleton(Vec<String>),
    /// The skeleton differs from that of the first file.
    #[error("its skeleton differs from that of {} in {}", first.display(), shortened(joints))]
    SkeletonDiffers {
        /// First file of the set.
        first: PathBuf,
        /// Names of the joints that differ.
        joints: Vec<String>,
    },
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
    /// The motion cannot be put on the skeleton of the others, because more than a quarter of that skeleton's joints have no joint of
    /// their name in the file.
    #[error("it cannot be put on the skeleton of {}: no joint of it is named {}", first.display(), shortened(missing))]
    NotRetargeted {
        /// First file of the set.
        first: PathBuf,
        /// Names of the joints that the file does not have.
        missing: Vec<String>,
    },
    /// A BVH, OBJ, ASF or AMC file, or a JSON file, is invalid.
    #[error(transparent)]
    Text(#[from] TextError),
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
    /// An exported answer is invalid or belongs to another graph.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The mesh of an OBJ file is invalid.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// No triangles of a glTF or FBX file belong to a skin.
    #[error("the file has no skinned mesh")]
    NoMesh,
    /// The file is damaged, exceeds a limit, or does not fit the other files: names the part of it and the problem.
    #[error("{0}")]
    Invalid(String),
}

impl FileError {
    pub(crate) fn invalid(problem: impl Into<String>) -> Self {
        Self::Invalid(problem.into())
    }

    /// The problem of a part of a file, such as an event, a buffer or a key of an animation.
    pub(crate) fn part(part: impl Display, problem: impl Display) -> Self {
        Self::Invalid(format!("{part}: {problem}"))
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
