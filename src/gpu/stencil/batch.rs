//! A batch of drawings in one target.

use super::shelves::Place;

/// Drawings that are drawn into the target together.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Batch {
    /// Index and position in the target of each drawing.
    pub(crate) members: Vec<(usize, Place)>,
    /// Number of used columns and rows of the target.
    pub(crate) used: [u32; 2],
    /// Number of instances: discs and whole maps.
    pub(super) instances: u32,
}
