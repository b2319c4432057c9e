//! Biovision hierarchies (BVH), written and read as all the programs out there do.
//!
//! Source: the format has no standard. Read are any order and number of channels, keywords in any case, any white
//! space and line ends, names with dots, colons and blanks, motion values cut into lines at will, joints without End
//! Sites. Position channels replace offsets; rotations are multiplied in the order of the channels.

mod channel;
mod error;
mod euler;
mod file;
mod hierarchy;
mod lexer;
mod motion;
mod names;
mod write;

pub use channel::Channel;
pub use error::{BvhError, BvhProblem};
pub use file::{BvhFile, BvhJoint, MotionError};
pub(crate) use names::Taken;
pub use write::write;

/// The largest number that a file may hold: far beyond any motion in any unit, and far below where single precision
/// overflows.
pub const LARGEST_VALUE: f64 = 1e12;
