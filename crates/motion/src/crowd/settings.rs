use super::output::Output;
use crate::lod::LevelId;
use crate::math::Isa;

/// Settings of a crowd.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrowdSettings {
    /// Form, layout and write mode of the output.
    pub output: Output,
    /// Instruction set of the kernels. Default: the widest one of the machine.
    pub isa: Isa,
    /// Number of threads, including the caller's; 0 for as many as the machine has. At most [`Self::MOST_THREADS`] are
    /// started. They end when the crowd is dropped. Default 1.
    pub threads: usize,
    /// Which characters are not posed in every frame. Default: none.
    pub hold: Hold,
    /// Whether the caller alternates between buffers, and [`Crowd::previous_slice`](super::Crowd::previous_slice) returns
    /// the poses of the previous frame, for motion vectors. No character is held then. Default false.
    pub keeps_previous: bool,
}

/// Lets characters of coarse levels keep a pose for some frames; groups of sixteen are posed in turn. The caller must pass
/// the same memory, with its content, in each frame.
///
/// A held character is up to `frames` frames behind: 25 mm per frame at 1.5 m/s and 60 frames a second. A group that comes
/// into view is posed at once. Which groups are posed does not depend on the number of threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hold {
    /// The finest level whose groups are held. Default 0.
    pub from: LevelId,
    /// Number of frames for which a pose is kept after its own frame. Default 0.
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
