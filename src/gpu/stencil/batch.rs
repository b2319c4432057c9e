//! Drawings that share a target.

use super::shelves::Place;

/// Drawings that are drawn into the target at once.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Batch {
    /// Positions among the drawings, and where each lies.
    pub(crate) members: Vec<(usize, Place)>,
    /// Columns and rows of the target that are in use.
    pub(crate) used: [u32; 2],
    /// Discs and whole maps.
    pub(super) instances: u32,
}
