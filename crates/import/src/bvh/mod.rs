//! Reads and writes Biovision hierarchies (BVH), with tolerance for the variants of common
//! programs.
//!
//! Source: the format has no standard. The reader accepts channels in any order and number,
//! keywords in any case, any white space and line ends, names with dots, colons and blanks, motion
//! values with any line breaks, and joints without End Sites. Position channels replace offsets.
//! Rotations are multiplied in the order of the channels. Scales are ignored.

mod file;
mod parse;
mod write;

use sabaki::anim::Skeleton;
use thiserror::Error;

pub use file::{BvhFile, BvhJoint, Channel, MotionError};
pub(crate) use parse::{UsedNames, quoted};
pub(crate) use write::moving_joints;
pub use write::write;

/// Maximum number of channels of a joint.
pub const MOST_CHANNELS: usize = 64;

/// Maximum absolute value of a number in a file. It is far larger than in any motion and far below
/// the overflow of single precision.
pub const LARGEST_VALUE: f64 = 1e12;

/// An error in a BVH file, with its position.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("line {line}, column {column}: {problem}")]
pub struct BvhError {
    /// Line number, from 1. Lines end with LF, CR LF or CR.
    pub line: usize,
    /// Column, in characters, from 1. A byte order mark does not count.
    pub column: usize,
    /// Kind of error.
    pub problem: BvhProblem,
}

/// Kind of error in a BVH file.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum BvhProblem {
    /// The file contains only white space.
    #[error("the file is empty")]
    Empty,
    /// A byte is NUL or not valid UTF-8.
    #[error("not text: a BVH file is ASCII or UTF-8, and this byte is neither")]
    NotText,
    /// An unexpected word.
    #[error("expected {expected}, found {found}")]
    Expected {
        /// Description of what is expected.
        expected: &'static str,
        /// The word that was found, quoted and shortened, or `the end of the file`.
        found: String,
    },
    /// An unknown keyword in a joint.
    #[error("expected OFFSET, CHANNELS, JOINT, End Site or `}}` in \"{joint}\", found {found}")]
    UnknownKeyword {
        /// Name of the joint.
        joint: String,
        /// The keyword.
        found: String,
    },
    /// A number has a decimal comma.
    #[error("{found} has a decimal comma; BVH numbers have a point")]
    DecimalComma {
        /// The word.
        found: String,
    },
    /// A number is NaN or infinite.
    #[error("expected a finite number, found {found}")]
    NotFinite {
        /// The word.
        found: String,
    },
    /// A number is larger than [`LARGEST_VALUE`].
    #[error("{found} is larger than any motion")]
    TooLarge {
        /// The word.
        found: String,
    },
    /// The hierarchy has no ROOT.
    #[error("the hierarchy has no joints")]
    NoJoints,
    /// The file has a second ROOT. Files with several skeletons are not supported.
    #[error("a second ROOT, \"{name}\": only files of one skeleton can be read")]
    SecondRoot {
        /// Name of the second root.
        name: String,
    },
    /// The hierarchy has more joints than the maximum.
    #[error("more than {max} joints", max = Skeleton::MAX_JOINTS)]
    TooManyJoints,
    /// The closing brace of a joint is missing.
    #[error("the block of \"{joint}\" is not closed: expected `}}`, found {found}")]
    Unclosed {
        /// Innermost open joint.
        joint: String,
        /// The word that was found.
        found: String,
    },
    /// A joint or an End Site has no OFFSET.
    #[error("\"{joint}\" has no OFFSET")]
    NoOffset {
        /// Name of the joint.
        joint: String,
    },
    /// OFFSET or CHANNELS is repeated, or CHANNELS follows a child.
    #[error("{keyword} of \"{joint}\" must stand once, before its children")]
    Misplaced {
        /// `OFFSET` or `CHANNELS`.
        keyword: &'static str,
        /// Name of the joint.
        joint: String,
    },
    /// A keyword that is not allowed in an End Site.
    #[error("an End Site has only an OFFSET, found {found} in \"{joint}\"")]
    InEndSite {
        /// Name of the End Site.
        joint: String,
        /// The word.
        found: String,
    },
    /// The number of channels is not between 0 and [`MOST_CHANNELS`].
    #[error("\"{joint}\": expected a number of channels from 0 to {MOST_CHANNELS}, found {found}")]
    ChannelCount {
        /// The joint.
        joint: String,
        /// The word.
        found: String,
    },
    /// The name of a channel is unknown.
    #[error(
        "\"{joint}\": expected a channel (Xposition … Zscale) as number {index} of {count}, found {found}"
    )]
    ChannelName {
        /// The joint.
        joint: String,
        /// Number of the channel, from 1.
        index: usize,
        /// Number of channels of the joint.
        count: usize,
        /// The word.
        found: String,
    },
    /// A joint has the same position channel twice.
    #[error("\"{joint}\" has the channel {channel} twice")]
    ChannelTwice {
        /// The joint.
        joint: String,
        /// Name of the channel.
        channel: &'static str,
    },
    /// No joint has a channel, so the frames would be empty.
    #[error("no joint has a channel: there is no motion to read")]
    NoChannels,
    /// The number of frames is 0.
    #[error("the motion has no frames")]
    NoFrames,
    /// The frame time is not between 1 microsecond and 1 hour.
    #[error("expected a frame time between 0.000001 and 3600 seconds, found {found}")]
    FrameTime {
        /// The word.
        found: String,
    },
    /// The file ends before the last frame.
    #[error(
        "the motion ends early: {frames} frames of {channels} values are {expected} values, found {found} ({whole} whole frames)",
        whole = found / channels
    )]
    TooFewValues {
        /// Number of frames in the header.
        frames: u64,
        /// Number of values in a frame.
        channels: usize,
        /// Number of values in all frames.
        expected: u64,
        /// Number of values in the file.
        found: usize,
    },
    /// The values after the last complete frame do not fill another frame.
    #[error("after frame {frames}, {extra} of {channels} values: the last frame is not whole")]
    LeftOver {
        /// Number of additional values.
        extra: usize,
        /// Number of complete frames.
        frames: usize,
        /// Number of values in a frame.
        channels: usize,
    },
    /// A word that is not a number follows the motion.
    #[error("{found} follows the last frame")]
    Trailing {
        /// The word.
        found: String,
    },
}
