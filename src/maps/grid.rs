//! Finds the paths from a node that take the body out of a cell of space.
//!
//! Source: Masaoka & Oshita, section 4.1. They place a grid of cells around each node and file each
//! path that ends in an evasion in the cells that the body occupies at the evasion's start but not
//! at its end. Differs: relative to the place where an evasion starts, these cells are the same for
//! every path. They are stored once for each evasion, heading and part of a cell
//! ([`Grid::HEADINGS`], [`Grid::PARTS`]). A path stores an index into them and an offset. That
//! takes 12 bytes for each path instead of one entry for each path and cell ([`Grid::flat_bytes`]).

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::{Body, BodyTrack, NodePath, PathId, PathTable};
use crate::math::{Rigid2, Sphere, floor, in_parallel};

/// Settings of a [`Grid`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GridSettings {
    /// Side of a cell, in metres, from 0.05 to 1. Default 0.10. The side is doubled until the cells
    /// of all evasions fit a fixed memory limit, which only very large bodies or thousands of
    /// evasions exceed.
    pub cell: f32,
}

impl Default for GridSettings {
    fn default() -> Self {
        Self { cell: 0.10 }
    }
}

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
    const BELOW: i32 = 2;

    /// Maximum distance of a column from the origin, in cells. Columns farther out are moved to
    /// this distance.
    const FURTHEST: i32 = 200;

    fn bit(height: f32, cell: f32) -> u32 {
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
    #[must_use]
    pub fn middle(&self, cell: f32) -> Vec3 {
        let height = self.heights.trailing_zeros() as i32 - Self::BELOW;
        (Vec3::new(self.x as f32, height as f32, self.z as f32) + 0.5) * cell
    }

    /// Heights of the cells that a sphere reaches in the column `(x, z)`, or 0 if it does not reach
    /// the column.
    fn reached(sphere: Sphere, cell: f32, [x, z]: [i32; 2]) -> u64 {
        let Sphere { centre, radius } = sphere;
        let nearest = |value: f32, index: i32| {
            value.clamp(index as f32 * cell, (index + 1) as f32 * cell) - value
        };
        let (dx, dz) = (nearest(centre.x, x), nearest(centre.z, z));
        let left = radius * radius - dx * dx - dz * dz;
        if left <= 0.0 {
            return 0;
        }
        let half = left.sqrt();
        let (low, high) = (
            Self::bit(centre.y - half, cell),
            Self::bit(centre.y + half, cell),
        );
        (u64::MAX >> (63 - high)) & (u64::MAX << low)
    }

    /// Calls `visit` for each column that a sphere reaches and that is at most `within` columns
    /// from the origin along x and z.
    fn for_each_reached(sphere: Sphere, cell: f32, within: i32, mut visit: impl FnMut(Self)) {
        let Sphere { centre, radius } = sphere;
        let furthest = within.min(Self::FURTHEST);
        let of = |value: f32| floor(value / cell).clamp(-Self::FURTHEST, Self::FURTHEST);
        let span =
            |value: f32| of(value - radius).max(-furthest)..=of(value + radius).min(furthest);
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

/// The cells that an evasion vacates, relative to the cell that the evasion starts in.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct VacatedCells {
    x: i32,
    z: i32,
    width: u32,
    depth: u32,
    /// Index of the first entry in `heights`, `[x][z]`.
    first: u32,
}

/// Cells of a path: an index into `vacated` and an offset in cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Filed {
    vacated: u32,
    x: i32,
    z: i32,
}

/// The grids of all nodes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Grid {
    cell: f32,
    vacated: Vec<VacatedCells>,
    heights: Vec<u64>,
    /// Cells of each path, by path.
    filed: Vec<Filed>,
}

/// Input of [`Grid::new`].
pub(super) struct GridSource<'a> {
    pub body: &'a Body,
    /// Maximum distance of any part of the body from the root, in metres.
    pub reach: f32,
    /// Track of each evasion, with the sample at which the evasion ends.
    pub evasions: Vec<(&'a BodyTrack, usize)>,
    pub paths: &'a PathTable,
}

impl Grid {
    /// Number of headings that have their own cells.
    pub const HEADINGS: u32 = 72;

    /// Number of parts of a cell along x and along z that have their own cells.
    pub const PARTS: u32 = 2;

    pub(super) fn new(source: &GridSource<'_>, settings: GridSettings) -> Self {
        let mut grid = Self {
            cell: Self::fitting_cell(source, settings.cell.clamp(0.05, 1.0)),
            ..Self::default()
        };
        let of_evasions = in_parallel(0, source.evasions.len(), |evasion| {
            let (track, end) = source.evasions[evasion];
            let mut own = Self {
                cell: grid.cell,
                ..Self::default()
            };
            for kind in 0..Self::HEADINGS * Self::PARTS * Self::PARTS {
                let ends = [0, end].map(|tick| own.occupied(source.body, track, tick, kind));
                own.push_vacated(&ends);
            }
            own
        });
        for own in of_evasions {
            let first = grid.heights.len() as u32;
            let moved = |cells: VacatedCells| VacatedCells {
                first: first + cells.first,
                ..cells
            };
            grid.vacated.extend(own.vacated.into_iter().map(moved));
            grid.heights.extend(own.heights);
        }
        let paths = source.paths.all();
        grid.filed = in_parallel(0, paths.len(), |path| grid.file(&paths[path]));
        grid
    }

    /// Maximum number of columns of all evasions: 128 MB.
    const MOST_COLUMNS: f32 = (1 << 24) as f32;

    /// Side of a cell. It is doubled until the columns of all evasions fit [`Grid::MOST_COLUMNS`],
    /// which only very large bodies or thousands of evasions exceed.
    fn fitting_cell(source: &GridSource<'_>, cell: f32) -> f32 {
        let kinds = (Self::HEADINGS * Self::PARTS * Self::PARTS) as f32;
        let count = kinds * source.evasions.len() as f32;
        let columns = |cell: f32| {
            let side =
                (2.0 * source.reach / cell + 3.0).min(2.0 * CellColumn::FURTHEST as f32 + 1.0);
            count * side * side
        };
        std::iter::successors(Some(cell), |cell| Some(2.0 * cell))
            .take(64)
            .find(|&cell| columns(cell) <= Self::MOST_COLUMNS)
            .unwrap_or(cell)
    }

    /// Columns of cells that the body occupies at one sample of an evasion that starts in cell `(0,
    /// 0)`. `kind` encodes the heading and the part of the cell.
    fn occupied(&self, body: &Body, track: &BodyTrack, tick: usize, kind: u32) -> Vec<CellColumn> {
        let part = |index: u32| (index as f32 + 0.5) / Self::PARTS as f32 * self.cell;
        let heading = (kind / (Self::PARTS * Self::PARTS)) as f32 + 0.5;
        let placement = Rigid2::new(
            heading / Self::HEADINGS as f32 * std::f32::consts::TAU,
            part(kind / Self::PARTS % Self::PARTS),
            part(kind % Self::PARTS),
        );
        let mut columns = Vec::new();
        for (index, sphere) in body.spheres.iter().enumerate() {
            let centre = placement.point(track.centre(tick, index));
            let sphere = Sphere::new(centre, sphere.radius);
            CellColumn::for_each_reached(sphere, self.cell, i32::MAX, |c| columns.push(c));
        }
        columns
    }

    /// Adds the cells that are in the first set and not in the second.
    fn push_vacated(&mut self, [start, end]: &[Vec<CellColumn>; 2]) {
        let ends = |of: fn(&CellColumn) -> i32| {
            let low = start.iter().map(of).min().unwrap_or(0);
            let high = start.iter().map(of).max().unwrap_or(-1);
            (low, (high - low + 1) as u32)
        };
        let ((x, width), (z, depth)) = (ends(|c| c.x), ends(|c| c.z));
        let vacated = VacatedCells {
            x,
            z,
            width,
            depth,
            first: self.heights.len() as u32,
        };
        self.heights
            .resize(self.heights.len() + (width * depth) as usize, 0);
        for column in start {
            if let Some(at) = vacated.position(column.x, column.z) {
                self.heights[at] |= column.heights;
            }
        }
        for column in end {
            if let Some(at) = vacated.position(column.x, column.z) {
                self.heights[at] &= !column.heights;
            }
        }
        self.vacated.push(vacated);
    }

    fn file(&self, path: &NodePath) -> Filed {
        let turns = path.placement.heading() / std::f32::consts::TAU;
        let heading = ((turns - floor(turns) as f32) * Self::HEADINGS as f32) as u32;
        let place = |metres: f32| {
            let cells = metres / self.cell;
            let whole = floor(cells);
            let part = ((cells - whole as f32) * Self::PARTS as f32) as u32;
            (whole, part.min(Self::PARTS - 1))
        };
        let ((x, x_part), (z, z_part)) = (place(path.placement.x), place(path.placement.z));
        let kinds = Self::HEADINGS * Self::PARTS * Self::PARTS;
        let kind = (heading.min(Self::HEADINGS - 1) * Self::PARTS + x_part) * Self::PARTS + z_part;
        Filed {
            vacated: path.evasion * kinds + kind,
            x,
            z,
        }
    }

    /// Side of a cell, in metres.
    #[must_use]
    pub fn cell(&self) -> f32 {
        self.cell
    }

    /// Cells of `column` that a path vacates. The column is in the node's frame.
    #[must_use]
    #[inline]
    pub fn vacates(&self, path: PathId, column: CellColumn) -> u64 {
        let filed = self.filed[path.0 as usize];
        let vacated = &self.vacated[filed.vacated as usize];
        vacated
            .position(column.x - filed.x, column.z - filed.z)
            .map_or(0, |at| self.heights[at] & column.heights)
    }

    /// Whether a path vacates a cell of `columns`, which must be sorted ([`TouchedCells::merge`]).
    #[must_use]
    pub fn vacates_any(&self, path: PathId, columns: &[CellColumn]) -> bool {
        let filed = self.filed[path.0 as usize];
        let vacated = &self.vacated[filed.vacated as usize];
        let first = filed.x + vacated.x;
        let start = columns.partition_point(|column| column.x < first);
        columns[start..]
            .iter()
            .take_while(|column| column.x < first + vacated.width as i32)
            .any(|&column| self.vacates(path, column) != 0)
    }

    /// All cells that a path vacates, in the frame of its node.
    pub fn cells(&self, path: PathId) -> impl Iterator<Item = CellColumn> + '_ {
        let filed = self.filed[path.0 as usize];
        let vacated = self.vacated[filed.vacated as usize];
        (0..vacated.width).flat_map(move |x| {
            (0..vacated.depth).map(move |z| CellColumn {
                x: filed.x + vacated.x + x as i32,
                z: filed.z + vacated.z + z as i32,
                heights: self.heights[(vacated.first + x * vacated.depth + z) as usize],
            })
        })
    }

    /// Memory of the grids, in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(self.vacated.as_slice())
            + size_of_val(self.heights.as_slice())
            + size_of_val(self.filed.as_slice())
    }

    /// Memory of the same data as a list of paths for each cell of each node, with two bytes for
    /// each entry.
    #[must_use]
    pub fn flat_bytes(&self) -> usize {
        let cells = |filed: &Filed| -> usize {
            let vacated = &self.vacated[filed.vacated as usize];
            let first = vacated.first as usize;
            let heights = &self.heights[first..first + (vacated.width * vacated.depth) as usize];
            heights.iter().map(|h| h.count_ones() as usize).sum()
        };
        2 * self.filed.iter().map(cells).sum::<usize>()
    }
}

impl VacatedCells {
    #[inline]
    fn position(&self, x: i32, z: i32) -> Option<usize> {
        let (x, z) = (x.wrapping_sub(self.x) as u32, z.wrapping_sub(self.z) as u32);
        (x < self.width && z < self.depth)
            .then(|| self.first as usize + (x * self.depth + z) as usize)
    }
}

/// The cells that an attack touches, in the frame of a node. Its buffers are reused.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TouchedCells {
    columns: Vec<CellColumn>,
    /// Number of columns that triggers the next merge.
    room: usize,
}

impl TouchedCells {
    /// Initial number of columns that triggers a merge: 1.5 MB. An attack touches a few hundred
    /// columns.
    const ROOM: usize = 1 << 16;

    /// Removes all cells.
    pub fn clear(&mut self) {
        self.columns.clear();
        self.room = 0;
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
        if self.columns.len() > self.room.max(Self::ROOM) {
            self.merge();
            self.room = 2 * self.columns.len();
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
