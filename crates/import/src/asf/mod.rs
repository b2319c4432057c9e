//! Acclaim's skeletons (ASF) and motions (AMC), read.
//!
//! Source: J. Schafer, "Acclaim Skeleton File Definition" (Acclaim Advanced Technologies, 1994); where that is silent, as the files of CMU's
//! library are meant. A bone turns about its own axes C, which stand in the skeleton: its rotation from its parent is C M C⁻¹, M the turns
//! that the motion has for it, the first named first. A bone's joint stands at its start, so that a joint's offset is its parent's bone.
//!
//! Differs: bones that change their place or length (`tx`, `l`) are refused; units of length are found as in BVH files, since files say
//! them in units that nobody agrees upon.

mod error;
mod lines;
mod motion;
mod skeleton;

pub use error::{AsfError, AsfProblem};
pub use motion::AmcFile;
pub use skeleton::AsfFile;
