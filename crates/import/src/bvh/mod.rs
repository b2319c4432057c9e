//! Reads and writes Biovision hierarchies (BVH), with tolerance for the variants of common
//! programs.
//!
//! Source: the format has no standard. The reader accepts channels in any order and number,
//! keywords in any case, any white space and line ends, names with dots, colons and blanks, motion
//! values with any line breaks, and joints without End Sites. Position channels replace offsets.
//! Rotations are multiplied in the order of the channels. Scales are ignored.

mod parse;
mod write;

pub(crate) use parse::UsedNames;
pub use parse::parse;
pub(crate) use write::moving_joints;
pub use write::write;

/// Maximum number of channels of a joint.
pub const MOST_CHANNELS: usize = 64;

/// Maximum absolute value of a number in a file. It is far larger than in any motion and far below
/// the overflow of single precision.
pub const LARGEST_VALUE: f64 = 1e12;
