//! The cells that an attack touches.

use super::CellColumn;
use crate::math::{Sphere, floor};

/// The cells that an attack touches, in the frame of a node. Its buffers are reused.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TouchedCells {
    columns: Vec<CellColumn>,
    /// Number of columns that triggers the next merge.
    limit: usize,
}

impl TouchedCells {
    /// Initial number of columns that triggers a merge: 1.5 MB. An attack touches a few hundred
    /// columns.
    const FIRST_LIMIT: usize = 1 << 16;

    /// Removes all cells.
    pub fn clear(&mut self) {
        self.columns.clear();
        self.limit = 0;
    }

    /// Adds the cells that a sphere touches, within `reach` metres
    /// of the node's root along x and along z.
    pub fn add(&mut self, sphere: Sphere, cell: f32, reach: f32) {
        let Sphere { centre, radius } = sphere;
        if centre.x.abs() - radius > reach || centre.z.abs() - radius > reach {
            return;
        }
        // Paths have no cells beyond their reach.
        let within = floor(reach / cell).saturating_add(1);
        let columns = &mut self.columns;
        CellColumn::for_each_reached(sphere, cell, within, |c| columns.push(c));
        if self.columns.len() > self.limit.max(Self::FIRST_LIMIT) {
            self.merge();
            self.limit = 2 * self.columns.len();
        }
    }

    /// Sorts the columns and merges duplicates. Call it after the last [`TouchedCells::add`].
    pub fn merge(&mut self) -> &[CellColumn] {
        self.columns.sort_unstable_by_key(|c| (c.x, c.z));
        self.columns.dedup_by(|later, kept| {
            let same = (later.x, later.z) == (kept.x, kept.z);
            if same {
                kept.heights |= later.heights;
            }
            same
        });
        &self.columns
    }
}
