use std::ops::RangeInclusive;

use super::up::Up;

/// Maximum duration of a clip, in seconds: ten hours. Longer clips come from wrong frame times and
/// would exhaust memory.
pub const LONGEST_CLIP: f64 = 36_000.0;

/// Maximum number of frames times joints of a motion file; of a glTF file, of all its animations together, and of their keys. It limits memory, because a
/// few bytes of a file can stand for many frames of many joints.
pub const MOST_ENTRIES: u64 = 1 << 26;

/// Range of [`ReadOptions::scale`], in metres per unit: from a millionth of a millimetre to a thousand kilometres.
pub const SCALES: RangeInclusive<f64> = 1e-9..=1e6;

/// Options for reading files.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// Scale of the files, in metres per unit. Default `None`: BVH files are scaled by the
    /// skeleton's stature, glTF files by 1.
    pub scale: Option<f64>,
    /// Axis that points up in the files. Default +Y.
    pub up: Up,
    /// Frame rate of AMC files, which do not contain it, in frames per second. Default `None`:
    /// [`AmcFile::USUAL_RATE`](super::asf::AmcFile::USUAL_RATE).
    pub amc_rate: Option<f64>,
    /// Leaves out files that cannot be read, and files whose skeleton differs from that of the largest group of files, instead of
    /// refusing a set of clips. Default `false`.
    pub keep_going: bool,
    /// Puts motions of other skeletons on that of the largest group of files, by the joints' names, instead of refusing them. A warning
    /// says what this costs. Default `false`.
    pub retarget: bool,
}
