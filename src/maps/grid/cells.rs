//! Columns of cells around a node, and the columns that an attack touches.

use glam::Vec3;

use crate::math::{Sphere, floor};

/// A column of cells in a node's frame (root on the ground, facing +Z).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellColumn {
    /// Index of the column along x, in cells.
    pub x: i32,
    /// Index of the column along z, in cells.
    pub z: i32,
    /// Occupied cells. Bit `n` is the cell from height `n - 2` to `n - 1`, in cells. The lowest bit
    /// includes all cells below, the highest bit all cells above.
    pub heights: u64,
}

impl CellColumn {
    /// Number of cells below the ground.
    pub(super) const BELOW: i32 = 2;

    /// Maximum distance of a column from the origin, in cells. Columns farther out are moved to
    /// this distance.
    pub(super) const FURTHEST: i32 = 200;

    /// Index of the column at a place along one axis.
    #[inline(always)]
    pub(super) fn index(place: f32, cell: f32) -> i32 {
        floor(place / cell).clamp(-Self::FURTHEST, Self::FURTHEST)
    }

    /// Signed distance from a position to the nearest point of a column along one axis, in metres.
    #[inline(always)]
    pub(super) fn apart(place: f32, cell: f32, index: i32) -> f32 {
        place.clamp(index as f32 * cell, (index + 1) as f32 * cell) - place
    }

    /// Mask of the cells from one bit to another, both included.
    #[inline]
    pub(super) fn between(low: u32, high: u32) -> u64 {
        (u64::MAX >> (63 - high)) & (u64::MAX << low)
    }

    #[inline(always)]
    pub(super) fn bit(height: f32, cell: f32) -> u32 {
        floor(height / cell)
            .saturating_add(Self::BELOW)
            .clamp(0, 63) as u32
    }

    /// Splits the column into its cells.
    pub fn cells(&self) -> impl Iterator<Item = Self> + use<> {
        let Self { x, z, heights } = *self;
        let bits = (0..64).map(|bit| 1 << bit);
        bits.filter(move |bit| heights & bit != 0)
            .map(move |heights| Self { x, z, heights })
    }

    /// Centre of the lowest cell, in metres.
    pub fn middle(&self, cell: f32) -> Vec3 {
        let height = self.heights.trailing_zeros() as i32 - Self::BELOW;
        (Vec3::new(self.x as f32, height as f32, self.z as f32) + 0.5) * cell
    }

    /// Heights of the cells that a sphere reaches in the column `(x, z)`, or 0 if it does not reach
    /// the column.
    fn reached(sphere: Sphere, cell: f32, [x, z]: [i32; 2]) -> u64 {
        let Sphere { centre, radius } = sphere;
        let dx = Self::apart(centre.x, cell, x);
        let dz = Self::apart(centre.z, cell, z);
        let left = radius * radius - dx * dx - dz * dz;
        if left <= 0.0 {
            return 0;
        }
        let half = left.sqrt();
        Self::between(
            Self::bit(centre.y - half, cell),
            Self::bit(centre.y + half, cell),
        )
    }

    /// Calls `visit` for each column that a sphere reaches and that is at most `within` columns
    /// from the origin along x and z.
    pub(super) fn for_each_reached(
        sphere: Sphere,
        cell: f32,
        within: i32,
        mut visit: impl FnMut(Self),
    ) {
        let Sphere { centre, radius } = sphere;
        let furthest = within.min(Self::FURTHEST);
        let span = |place: f32| {
            let (low, high) = (
                Self::index(place - radius, cell),
                Self::index(place + radius, cell),
            );
            low.max(-furthest)..=high.min(furthest)
        };
        for x in span(centre.x) {
            for z in span(centre.z) {
                let heights = Self::reached(sphere, cell, [x, z]);
                if heights != 0 {
                    visit(Self { x, z, heights });
                }
            }
        }
    }
}

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
