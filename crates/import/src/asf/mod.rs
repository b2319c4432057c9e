//! Reads Acclaim skeletons (ASF) and motions (AMC).
//!
//! Source: J. Schafer, "Acclaim Skeleton File Definition" (Acclaim Advanced Technologies, 1994).
//! Where the definition is ambiguous, files are read as CMU's library intends them. A bone rotates
//! about its own axes C, which are fixed in the skeleton. Its rotation relative to its parent is C
//! M C⁻¹, where M is the product of the motion's rotations, the first named applied first. A bone's
//! joint is at its start, so a joint's offset is its parent's bone.
//!
//! Differs: bones that translate or change their length (`tx`, `l`) are rejected. The unit of
//! length is estimated as for BVH files, because the units in the files are not reliable.

mod error;
mod lines;
mod motion;
mod skeleton;

pub use error::{AsfError, AsfProblem};
pub use motion::{AmcClipDesc, AmcFile, AmcFrame};
pub use skeleton::AsfFile;
