use super::output::Output;
use crate::lod::LevelId;
use crate::math::Isa;

/// How a crowd is posed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrowdSettings {
    /// Form, layout and memory of the output.
    pub output: Output,
    /// The instruction set.
    pub isa: Isa,
    /// Number of threads, the caller's included; 0 for as many as the machine has. At most [`Self::MOST_THREADS`] are started. They end
    /// when the crowd is dropped.
    pub threads: usize,
    /// Which characters are not posed in every frame; none by default.
    pub hold: Hold,
    /// Whether the caller's buffers take turns, and [`Crowd::previous_slice`](super::Crowd::previous_slice) tells where the
    /// poses of the frame before are, for motion vectors. Nobody is held then. False by default.
    pub keeps_previous: bool,
}

/// Characters of coarse levels keep a pose for some frames; groups of sixteen take turns. The caller must hand over the same
/// memory in each frame, with its content.
///
/// A held character is up to that many frames behind: at 1.5 m/s and 60 frames a second 25 mm for each.
/// A group that comes into view is posed at once. Which groups are posed does not depend on the number of threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hold {
    /// The finest level whose groups are held.
    pub from: LevelId,
    /// Number of frames for which a pose is kept after its own; 0 by default.
    pub frames: u16,
}

impl CrowdSettings {
    /// Largest number of threads of a crowd.
    pub const MOST_THREADS: usize = 64;
}

impl Default for CrowdSettings {
    /// The widest instruction set of the machine, one thread.
    fn default() -> Self {
        Self {
            output: Output::default(),
            isa: Isa::best(),
            threads: 1,
            hold: Hold::default(),
            keeps_previous: false,
        }
    }
}
