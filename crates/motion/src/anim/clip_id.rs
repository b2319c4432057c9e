use serde::{Deserialize, Serialize};

/// Index of a clip in a set: the clips of a motion graph, or those of the animations of a crowd and then its layers.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct ClipId(pub u32);

impl ClipId {
    /// The index as a `usize`.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}
