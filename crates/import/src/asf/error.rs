use thiserror::Error;

use sabaki::anim::SkeletonError;

/// What is wrong with an ASF or AMC file, and where.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("line {line}: {problem}")]
pub struct AsfError {
    /// From 1.
    pub line: usize,
    /// What.
    pub problem: AsfProblem,
}

/// What is wrong with an ASF or AMC file.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum AsfProblem {
    /// The bytes are no text.
    #[error("not a text file")]
    NotText,
    /// Something else stands where it should.
    #[error("expected {expected}, found {found}")]
    Expected {
        /// What should stand there.
        expected: &'static str,
        /// What does, shortened and quoted.
        found: String,
    },
    /// The file ends before it has one of these.
    #[error("the file has no {0}")]
    Missing(&'static str),
    /// No bone has that name.
    #[error("there is no bone \"{0}\"")]
    NoBone(String),
    /// Something is said twice of a bone, or a bone is said twice.
    #[error("\"{0}\" stands here a second time")]
    Twice(String),
    /// A bone hangs on nothing, or on itself.
    #[error("bone \"{0}\" does not hang on the root")]
    Loose(String),
    /// More bones than a skeleton may have joints.
    #[error("more than {max} joints", max = sabaki::anim::Skeleton::MAX_JOINTS)]
    TooManyJoints,
    /// A bone changes in a way that is not supported.
    #[error(
        "bone \"{bone}\" has the degree of freedom \"{found}\"; only rx, ry and rz are read, and tx, ty and tz of the root"
    )]
    Freedom {
        /// Its name.
        bone: String,
        /// As written.
        found: String,
    },
    /// A frame has not as many numbers for a bone as it has degrees of freedom.
    #[error("frame {frame}: {found} numbers for \"{bone}\", which has {expected}")]
    Values {
        /// From 1.
        frame: usize,
        /// Its name.
        bone: String,
        /// How many numbers.
        found: usize,
        /// How many should be there.
        expected: usize,
    },
    /// A frame says nothing of a bone that moves.
    #[error("frame {frame} has nothing for \"{bone}\"")]
    NoValues {
        /// From 1.
        frame: usize,
        /// Its name.
        bone: String,
    },
    /// The bones form no skeleton.
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
}

/// A word as errors show it.
pub(super) fn quoted(word: &str) -> String {
    const MOST: usize = 40;
    let short: String = word.chars().take(MOST).collect();
    format!("\"{short}\"")
}
