//! The cells that an evasion vacates, for each heading and part of a cell in which it may start.

use rustc_hash::FxHashMap;

use super::cells::CellColumn;
use crate::math::{Rigid2, Sphere};

/// Number of headings that have their own cells. They are those of a quarter of a turn: the cells of the others are the same, turned.
pub(super) const HEADINGS: u32 = 18;

/// Number of headings of a whole turn.
pub(super) const ALL_HEADINGS: u32 = 4 * HEADINGS;

/// Number of parts of a cell along x and along z that have their own cells.
pub(super) const PARTS: u32 = 2;

/// Number of headings and parts, each of which has its own cells.
pub(super) const KINDS: u32 = HEADINGS * PARTS * PARTS;

/// The cells that an evasion vacates, relative to the cell that it starts in.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct VacatedCells {
    pub(super) x: i32,
    pub(super) z: i32,
    pub(super) width: u32,
    pub(super) depth: u32,
    /// Index of the first column, `[x][z]`.
    pub(super) first: u32,
    /// Index of the first of its heights in [`VacatedKinds::heights`].
    first_heights: u32,
}

impl VacatedCells {
    /// The smallest rectangle around columns.
    fn around(columns: &[CellColumn]) -> Self {
        let ends = |place: fn(&CellColumn) -> i32| {
            let places = columns.iter().map(place);
            let (low, high) = (
                places.clone().min().unwrap_or(0),
                places.max().unwrap_or(-1),
            );
            (low, (high - low + 1) as u32)
        };
        let ((x, width), (z, depth)) = (ends(|column| column.x), ends(|column| column.z));
        Self {
            x,
            z,
            width,
            depth,
            ..Self::default()
        }
    }

    /// Number of a column among those of the kind.
    #[inline]
    pub(super) fn position(&self, x: i32, z: i32) -> Option<usize> {
        let (x, z) = (x.wrapping_sub(self.x) as u32, z.wrapping_sub(self.z) as u32);
        (x < self.width && z < self.depth).then(|| (x * self.depth + z) as usize)
    }
}

/// The cells that one evasion vacates.
#[derive(Clone, Debug)]
pub(super) struct VacatedKinds {
    pub(super) kinds: Vec<VacatedCells>,
    /// Number of each column's heights, from the first of its kind on.
    columns: Vec<u16>,
    /// The heights of all columns, each once.
    heights: Vec<u64>,
}

impl VacatedKinds {
    /// The cells that a body vacates whose spheres are at `first`, and then at `last`.
    pub(super) fn new(first: &[Sphere], last: &[Sphere], cell: f32) -> Self {
        let (mut kinds, mut columns, mut all) = (Vec::new(), Vec::new(), Vec::new());
        let (mut known, mut heights) = (FxHashMap::default(), Vec::new());
        let (mut reached, mut first_heights) = (Vec::new(), 0);
        for kind in 0..KINDS {
            let placement = kind_placement(kind, cell);
            reached.clear();
            for_each_reached(first, placement, cell, |column| reached.push(column));
            let mut cells = VacatedCells::around(&reached);
            heights.clear();
            heights.resize((cells.width * cells.depth) as usize, 0u64);
            for column in &reached {
                if let Some(at) = cells.position(column.x, column.z) {
                    heights[at] |= column.heights;
                }
            }
            for_each_reached(last, placement, cell, |column| {
                if let Some(at) = cells.position(column.x, column.z) {
                    heights[at] &= !column.heights;
                }
            });
            // So that their numbers fit. A kind has fewer columns than that ([`GridCells`](super::node_grid::GridCells)).
            if known.len() + heights.len() > usize::from(u16::MAX) {
                known.clear();
                first_heights = all.len();
            }
            (cells.first, cells.first_heights) = (columns.len() as u32, first_heights as u32);
            columns.extend(heights.iter().map(|&heights| {
                *known.entry(heights).or_insert_with(|| {
                    all.push(heights);
                    (all.len() - 1 - first_heights) as u16
                })
            }));
            kinds.push(cells);
        }
        columns.shrink_to_fit();
        Self {
            kinds,
            columns,
            heights: all,
        }
    }

    #[inline]
    pub(super) fn heights(&self, kind: &VacatedCells, column: usize) -> u64 {
        let number = self.columns[kind.first as usize + column];
        self.heights[kind.first_heights as usize + usize::from(number)]
    }
}

/// The middle of a kind's part of cell `(0, 0)` and of its range of headings.
fn kind_placement(kind: u32, cell: f32) -> Rigid2 {
    let part = |index: u32| (index as f32 + 0.5) / PARTS as f32 * cell;
    let heading = (kind / (PARTS * PARTS)) as f32 + 0.5;
    Rigid2::new(
        heading / ALL_HEADINGS as f32 * std::f32::consts::TAU,
        part(kind / PARTS % PARTS),
        part(kind % PARTS),
    )
}

/// Calls `visit` for each column that a sphere of a placed body reaches, for each such sphere.
fn for_each_reached(
    body: &[Sphere],
    placement: Rigid2,
    cell: f32,
    mut visit: impl FnMut(CellColumn),
) {
    for &Sphere { centre, radius } in body {
        let sphere = Sphere::new(placement.point(centre), radius);
        CellColumn::for_each_reached(sphere, cell, i32::MAX, &mut visit);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use glam::Vec3;
    use proptest::prelude::*;

    use super::*;

    /// Heights by column that a body reaches.
    fn occupied(body: &[Sphere], placement: Rigid2, cell: f32) -> BTreeMap<(i32, i32), u64> {
        let mut columns = BTreeMap::new();
        for_each_reached(body, placement, cell, |column| {
            *columns.entry((column.x, column.z)).or_default() |= column.heights;
        });
        columns
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn they_are_those_of_the_start_without_those_of_the_end(
            spheres in prop::collection::vec((prop::array::uniform3(-1.5f32..1.5), 0.01f32..0.4), 1..12),
            moves in prop::array::uniform3(-0.5f32..0.5),
            cell in 0.05f32..0.3,
        ) {
            let [first, last] = [Vec3::ZERO, Vec3::from_array(moves)].map(|way| -> Vec<Sphere> {
                spheres.iter().map(|&(place, radius)| Sphere::new(Vec3::from_array(place) + way, radius)).collect()
            });
            let found = VacatedKinds::new(&first, &last, cell);
            for kind in (0..KINDS).step_by(7) {
                let placement = kind_placement(kind, cell);
                let [mut start, end] = [&first, &last].map(|body| occupied(body, placement, cell));
                for (column, heights) in &mut start {
                    *heights &= !end.get(column).copied().unwrap_or(0);
                }
                let cells = found.kinds[kind as usize];
                for x in cells.x - 2..cells.x + cells.width as i32 + 2 {
                    for z in cells.z - 2..cells.z + cells.depth as i32 + 2 {
                        let expected = start.remove(&(x, z)).unwrap_or(0);
                        let heights = cells.position(x, z).map_or(0, |at| found.heights(&cells, at));
                        prop_assert_eq!(heights, expected, "{} {}", x, z);
                    }
                }
                prop_assert!(start.is_empty());
            }
        }
    }
}
