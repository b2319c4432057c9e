//! Finds the paths from a node that take the body out of a cell of space.
//!
//! Source: Masaoka & Oshita, section 4.1. They place a grid of cells around each node and list each
//! path that ends in an evasion in the cells that the body occupies at the evasion's start but not
//! at its end. Differs: relative to the place where an evasion starts, these cells are the same for
//! every path. They are stored once for each evasion, heading and part of a cell
//! ([`HEADINGS`], [`PARTS`]). An index into them, an offset and quarter turns follow from the placement of a path.
//!
//! The cells of an evasion are computed on first use. They depend only on the graph.

use std::sync::OnceLock;

use super::cells::CellColumn;
use super::paths::NodePath;
use super::vacated::{ALL_HEADINGS, HEADINGS, KINDS, PARTS, VacatedCells, VacatedKinds};
use crate::graph::MotionGraph;
use crate::maps::regions::{Body, Evasion, EvasionTracks};
use crate::math::{Sphere, floor, in_parallel};

/// Cells of a path: the kind of its evasion's cells, and the quarter turns and the offset in cells that place them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct PathOffset {
    kind: u32,
    quarters: u32,
    x: i32,
    z: i32,
}

/// Turns a pair (x, z) back by quarters of a turn about +Y.
#[inline]
fn turned_back([x, z]: [i32; 2], quarters: u32) -> [i32; 2] {
    match quarters % 4 {
        0 => [x, z],
        1 => [-z, x],
        2 => [-x, -z],
        _ => [z, -x],
    }
}

impl PathOffset {
    /// Maximum offset, in cells. All columns are closer to a node's root.
    const FURTHEST: i32 = (1 << 13) - 1;

    /// The column of its kind that a column of the node's frame is.
    #[inline]
    fn in_kind(self, x: i32, z: i32) -> [i32; 2] {
        turned_back([x - self.x, z - self.z], self.quarters)
    }

    /// The column of the node's frame that a column of its kind is.
    fn in_node(self, x: i32, z: i32) -> [i32; 2] {
        let [x, z] = turned_back([x, z], 4 - self.quarters);
        [self.x + x, self.z + z]
    }

    /// The columns along x of the node's frame that cells reach.
    fn across(self, cells: &VacatedCells) -> std::ops::RangeInclusive<i32> {
        let last = [cells.width, cells.depth].map(|count| count as i32 - 1);
        let ends = [[0, 0], last].map(|[x, z]| self.in_node(cells.x + x, cells.z + z)[0]);
        ends[0].min(ends[1])..=ends[0].max(ends[1])
    }
}

/// Computed parts of the grids of all nodes.
#[derive(Clone, Debug, Default)]
pub(in crate::maps) struct GridCells {
    cell: f32,
    evasions: Vec<OnceLock<VacatedKinds>>,
}

impl GridCells {
    /// Maximum number of evasions.
    pub(in crate::maps) const MOST_EVASIONS: usize = 1 << 16;

    /// Side of a cell, in metres.
    pub(in crate::maps) const CELL: f32 = 0.10;

    /// The cells of a body whose parts are at most `reach` metres from its root. `cell` is the side of a cell, in metres, from 0.05 to 1.
    pub(in crate::maps) fn new(cell: f32, reach: f32, evasions: usize) -> Self {
        Self {
            cell: Self::fitting_cell(cell.clamp(0.05, 1.0), reach, evasions),
            evasions: (0..evasions).map(|_| OnceLock::new()).collect(),
        }
    }

    /// Maximum number of columns of all evasions: 32 MB.
    const MOST_COLUMNS: f32 = (1 << 24) as f32;

    /// Side of a cell. It is doubled until the columns of all evasions fit [`GridCells::MOST_COLUMNS`],
    /// which only very large bodies or thousands of evasions exceed.
    fn fitting_cell(cell: f32, reach: f32, evasions: usize) -> f32 {
        let count = KINDS as f32 * evasions as f32;
        let columns = |cell: f32| {
            let side = (2.0 * reach / cell + 3.0).min(2.0 * CellColumn::FURTHEST as f32 + 1.0);
            count * side * side
        };
        std::iter::successors(Some(cell), |cell| Some(2.0 * cell))
            .take(64)
            .find(|&cell| columns(cell) <= Self::MOST_COLUMNS)
            .unwrap_or(cell)
    }

    /// Kind and offset of a path's cells.
    fn offset(&self, path: &NodePath) -> PathOffset {
        let turns = path.placement.heading() / std::f32::consts::TAU;
        let heading = ((turns - floor(turns) as f32) * ALL_HEADINGS as f32) as u32;
        let heading = heading.min(ALL_HEADINGS - 1);
        let quarters = heading / HEADINGS;
        let place = |metres: f32| {
            let cells = metres / self.cell;
            let whole = floor(cells);
            let part = ((cells - whole as f32) * PARTS as f32) as u32;
            let furthest = PathOffset::FURTHEST;
            (whole.clamp(-furthest, furthest), part.min(PARTS - 1))
        };
        let ((x, x_part), (z, z_part)) = (place(path.placement.x), place(path.placement.z));
        // About the middle of the cell, its parts turn with the body. The cell then lies where it did.
        let turned = |part: u32| 2 * part as i32 - (PARTS as i32 - 1);
        let parts = turned_back([turned(x_part), turned(z_part)], quarters);
        let [x_part, z_part] = parts.map(|part| ((part + PARTS as i32 - 1) / 2) as u32);
        let kind = (heading % HEADINGS * PARTS + x_part) * PARTS + z_part;
        PathOffset {
            kind,
            quarters,
            x,
            z,
        }
    }
}

/// The grids of all nodes.
#[derive(Clone, Copy, Debug)]
pub struct Grid<'a> {
    pub(in crate::maps) cells: &'a GridCells,
    pub(in crate::maps) graph: &'a MotionGraph,
    pub(in crate::maps) body: &'a Body,
    pub(in crate::maps) evasions: &'a [Evasion],
    pub(in crate::maps) tracks: &'a EvasionTracks,
}

impl<'a> Grid<'a> {
    /// Computes the cells of all evasions.
    pub(in crate::maps) fn prepare(self) {
        in_parallel(0, self.cells.evasions.len(), |evasion| {
            self.evasion(evasion);
        });
    }

    #[inline]
    fn evasion(self, evasion: usize) -> &'a VacatedKinds {
        self.cells.evasions[evasion].get_or_init(|| {
            let track = self
                .tracks
                .get(self.graph, self.body, self.evasions, evasion);
            let seconds = self.graph.seconds(self.evasions[evasion].edge);
            let ends = [0.0, seconds].map(|seconds| track.nearest_tick(seconds));
            let [first, last] = ends.map(|sample| -> Vec<Sphere> {
                let own = self.body.spheres.iter().enumerate();
                own.map(|(index, own)| Sphere::new(track.centre(sample, index), own.radius))
                    .collect()
            });
            VacatedKinds::new(&first, &last, self.cells.cell)
        })
    }

    /// Position of a path's cells, and the cells of its evasion.
    #[inline]
    fn vacated(self, path: &NodePath) -> (PathOffset, &'a VacatedCells, &'a VacatedKinds) {
        let offset = self.cells.offset(path);
        let of_evasion = self.evasion(path.goal as usize);
        (offset, &of_evasion.kinds[offset.kind as usize], of_evasion)
    }

    /// Side of a cell, in metres.
    pub fn cell(self) -> f32 {
        self.cells.cell
    }

    /// Cells of `column` that a path vacates. The column is in the node's frame.
    #[inline]
    pub fn vacates(self, path: &NodePath, column: CellColumn) -> u64 {
        let (offset, vacated, of_evasion) = self.vacated(path);
        let [x, z] = offset.in_kind(column.x, column.z);
        vacated
            .position(x, z)
            .map_or(0, |at| of_evasion.heights(vacated, at) & column.heights)
    }

    /// Whether a path vacates a cell of `columns`, which must be sorted ([`TouchedCells::merge`](super::TouchedCells::merge)).
    pub fn vacates_any(self, path: &NodePath, columns: &[CellColumn]) -> bool {
        let (offset, vacated, of_evasion) = self.vacated(path);
        let across = offset.across(vacated);
        let start = columns.partition_point(|column| column.x < *across.start());
        columns[start..]
            .iter()
            .take_while(|column| column.x <= *across.end())
            .any(|column| {
                let [x, z] = offset.in_kind(column.x, column.z);
                vacated
                    .position(x, z)
                    .is_some_and(|at| of_evasion.heights(vacated, at) & column.heights != 0)
            })
    }

    /// All cells that a path vacates, in the frame of its node.
    pub fn cells(self, path: &NodePath) -> impl Iterator<Item = CellColumn> + use<'a> {
        let (offset, vacated, of_evasion) = self.vacated(path);
        (0..vacated.width).flat_map(move |x| {
            (0..vacated.depth).map(move |z| {
                let heights = of_evasion.heights(vacated, (x * vacated.depth + z) as usize);
                let [x, z] = offset.in_node(vacated.x + x as i32, vacated.z + z as i32);
                CellColumn { x, z, heights }
            })
        })
    }
}
