use thiserror::Error;

use sabaki::anim::SkeletonError;

use crate::options::MOST_ENTRIES;

/// An error in an ASF or AMC file, with its line.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("line {line}: {problem}")]
pub struct AsfError {
    /// Line number, from 1.
    pub line: usize,
    /// Kind of error.
    pub problem: AsfProblem,
}

/// Kind of error in an ASF or AMC file.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum AsfProblem {
    /// The file is not text.
    #[error("not a text file")]
    NotText,
    /// An unexpected word.
    #[error("expected {expected}, found {found}")]
    Expected {
        /// Description of what is expected.
        expected: &'static str,
        /// The word that was found, quoted and shortened.
        found: String,
    },
    /// The file lacks a required section.
    #[error("the file has no {0}")]
    Missing(&'static str),
    /// The skeleton has no bone of this name.
    #[error("there is no bone \"{0}\"")]
    NoBone(String),
    /// A property or a bone is defined twice.
    #[error("\"{0}\" stands here a second time")]
    Twice(String),
    /// A bone is not connected to the root.
    #[error("bone \"{0}\" does not hang on the root")]
    Loose(String),
    /// The skeleton has more joints than the maximum.
    #[error("more than {max} joints", max = sabaki::anim::Skeleton::MAX_JOINTS)]
    TooManyJoints,
    /// A bone has a degree of freedom that is not supported.
    #[error(
        "bone \"{bone}\" has the degree of freedom \"{found}\"; only rx, ry and rz are read, and tx, ty and tz of the root"
    )]
    Freedom {
        /// Name of the bone.
        bone: String,
        /// The degree of freedom, as in the file.
        found: String,
    },
    /// A frame has the wrong number of values for a bone.
    #[error("frame {frame}: {found} numbers for \"{bone}\", which has {expected}")]
    Values {
        /// Frame number, from 1.
        frame: usize,
        /// Name of the bone.
        bone: String,
        /// Number of values that were found.
        found: usize,
        /// Number of values that are expected.
        expected: usize,
    },
    /// A frame has no values for a moving bone.
    #[error("frame {frame} has nothing for \"{bone}\"")]
    NoValues {
        /// Frame number, from 1.
        frame: usize,
        /// Name of the bone.
        bone: String,
    },
    /// The motion has more than [`MOST_ENTRIES`](crate::MOST_ENTRIES) frames times bones.
    #[error(
        "more frames of {bones} bones than {MOST_ENTRIES} rotations in all, which are the most"
    )]
    TooManyFrames {
        /// Number of bones of the skeleton.
        bones: usize,
    },
    /// The bones do not form a valid skeleton.
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
}

/// A word, quoted and shortened for an error message.
pub(super) fn quoted(word: &str) -> String {
    const MOST: usize = 40;
    let short: String = word.chars().take(MOST).collect();
    format!("\"{short}\"")
}
