use thiserror::Error;

use sabaki::anim::Skeleton;

/// Why a text is no BVH file, and where.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("line {line}, column {column}: {problem}")]
pub struct BvhError {
    /// From 1. A line ends with LF, CR LF or a lone CR.
    pub line: usize,
    /// From 1, in characters. A byte order mark does not count.
    pub column: usize,
    /// What is wrong there.
    pub problem: BvhProblem,
}

/// What is wrong at a place of a BVH file.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum BvhProblem {
    /// There is nothing but white space.
    #[error("the file is empty")]
    Empty,
    /// A byte that is no UTF-8, or NUL.
    #[error("not text: a BVH file is ASCII or UTF-8, and this byte is neither")]
    NotText,
    /// Something else was due.
    #[error("expected {expected}, found {found}")]
    Expected {
        /// What was due.
        expected: &'static str,
        /// What stands there, quoted and shortened, or `the end of the file`.
        found: String,
    },
    /// A word that has no meaning inside a joint.
    #[error("expected OFFSET, CHANNELS, JOINT, End Site or `}}` in \"{joint}\", found {found}")]
    UnknownKeyword {
        /// The joint whose block it is.
        joint: String,
        /// The word.
        found: String,
    },
    /// A number is written with a decimal comma.
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
    /// A number is beyond [`super::LARGEST_VALUE`].
    #[error("{found} is larger than any motion")]
    TooLarge {
        /// The word.
        found: String,
    },
    /// HIERARCHY holds no ROOT.
    #[error("the hierarchy has no joints")]
    NoJoints,
    /// A second ROOT: several characters in one file are not supported.
    #[error("a second ROOT, \"{name}\": only files of one skeleton can be read")]
    SecondRoot {
        /// Its name.
        name: String,
    },
    /// One more joint than an index can name.
    #[error("more than {max} joints", max = Skeleton::MAX_JOINTS)]
    TooManyJoints,
    /// The braces of a joint are not closed.
    #[error("the block of \"{joint}\" is not closed: expected `}}`, found {found}")]
    Unclosed {
        /// The innermost open joint.
        joint: String,
        /// What stands there.
        found: String,
    },
    /// A joint or End Site has no OFFSET.
    #[error("\"{joint}\" has no OFFSET")]
    NoOffset {
        /// The joint.
        joint: String,
    },
    /// OFFSET or CHANNELS stands twice in a joint, or CHANNELS after a child.
    #[error("{keyword} of \"{joint}\" must stand once, before its children")]
    Misplaced {
        /// `OFFSET` or `CHANNELS`.
        keyword: &'static str,
        /// The joint.
        joint: String,
    },
    /// A keyword that an End Site cannot have.
    #[error("an End Site has only an OFFSET, found {found} in \"{joint}\"")]
    InEndSite {
        /// The End Site.
        joint: String,
        /// The word.
        found: String,
    },
    /// The number of channels is not 0 to 6.
    #[error("\"{joint}\": expected a number of channels from 0 to 6, found {found}")]
    ChannelCount {
        /// The joint.
        joint: String,
        /// The word.
        found: String,
    },
    /// No channel has that name.
    #[error(
        "\"{joint}\": expected a channel (Xposition … Zrotation) as number {index} of {count}, found {found}"
    )]
    ChannelName {
        /// The joint.
        joint: String,
        /// From 1.
        index: usize,
        /// How many were announced.
        count: usize,
        /// The word.
        found: String,
    },
    /// A position channel stands twice in one joint.
    #[error("\"{joint}\" has the channel {channel} twice")]
    ChannelTwice {
        /// The joint.
        joint: String,
        /// The channel.
        channel: &'static str,
    },
    /// No joint has a channel, so that no frame holds a value.
    #[error("no joint has a channel: there is no motion to read")]
    NoChannels,
    /// `Frames: 0`.
    #[error("the motion has no frames")]
    NoFrames,
    /// The frame time is not within 1 microsecond and 1 hour.
    #[error("expected a frame time between 0.000001 and 3600 seconds, found {found}")]
    FrameTime {
        /// The word.
        found: String,
    },
    /// The file ends early.
    #[error(
        "the motion ends early: {frames} frames of {channels} values are {expected} values, found {found} ({whole} whole frames)",
        whole = found / channels
    )]
    TooFewValues {
        /// As the header says.
        frames: u64,
        /// Values of one frame.
        channels: usize,
        /// Values of all frames.
        expected: u64,
        /// Values in the file.
        found: usize,
    },
    /// After the last whole frame there are values that do not fill another.
    #[error("after frame {frames}, {extra} of {channels} values: the last frame is not whole")]
    LeftOver {
        /// How many.
        extra: usize,
        /// Whole frames.
        frames: usize,
        /// Values of one frame.
        channels: usize,
    },
    /// Something that is no number follows the motion.
    #[error("{found} follows the last frame")]
    Trailing {
        /// The word.
        found: String,
    },
}
