//! Which paths from a node take the body out of a cell of space?
//!
//! Source: Masaoka & Oshita, section 4.1: around every node a grid of cells; every path from it
//! that ends in an evasion is filed in the cells that the body occupies at the evasion's start and
//! not at its end. Differs: which cells those are, relative to where the evasion starts, is the
//! same for every path to it. They are kept once for each evasion, heading and part of a cell
//! ([`Grid::HEADINGS`], [`Grid::PARTS`]), and a path says which of those it is filed under, and
//! where: 12 bytes a path instead of an entry a path and cell ([`Grid::flat_bytes`]).

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::{Body, BodyTrack, NodePath, PathId, PathTable};
use crate::math::{Rigid2, floor};

/// How space is cut into cells.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GridSettings {
    /// Side of a cell, metres, 0.05 to 1. Default 0.10. Doubled as often as it takes where the body is so large, or evasions
    /// are so many, that their cells would fill the memory.
    pub cell: f32,
}

impl Default for GridSettings {
    fn default() -> Self {
        Self { cell: 0.10 }
    }
}

/// Cells on top of each other, in a node's frame (root on the ground, facing +Z).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellColumn {
    /// Cells along x.
    pub x: i32,
    /// Cells along z.
    pub z: i32,
    /// Bit `n` stands for the cell from height `n - 2` to `n - 1`, counted in cells; the lowest and
    /// the highest bit for all below and above.
    pub heights: u64,
}

impl CellColumn {
    /// Cells below the ground.
    const BELOW: i32 = 2;

    /// Cells from the origin; what would lie further out lies there.
    const FURTHEST: i32 = 200;

    fn bit(height: f32, cell: f32) -> u32 {
        floor(height / cell)
            .saturating_add(Self::BELOW)
            .clamp(0, 63) as u32
    }

    /// Its cells one by one.
    pub fn cells(&self) -> impl Iterator<Item = Self> + use<> {
        let Self { x, z, heights } = *self;
        let bits = (0..64).map(|bit| 1 << bit);
        bits.filter(move |bit| heights & bit != 0)
            .map(move |heights| Self { x, z, heights })
    }

    /// The middle of its lowest cell, metres.
    #[must_use]
    pub fn middle(&self, cell: f32) -> Vec3 {
        let height = self.heights.trailing_zeros() as i32 - Self::BELOW;
        (Vec3::new(self.x as f32, height as f32, self.z as f32) + 0.5) * cell
    }

    /// The heights that a sphere reaches in the column of cells `(x, z)`; none where it does not
    /// reach the column.
    fn reached(centre: Vec3, radius: f32, cell: f32, (x, z): (i32, i32)) -> u64 {
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

    /// Calls `visit` with every column that a sphere reaches, no more than `within` columns from the origin along x and z.
    fn for_each_reached(
        (centre, radius): (Vec3, f32),
        cell: f32,
        within: i32,
        mut visit: impl FnMut(Self),
    ) {
        let furthest = within.min(Self::FURTHEST);
        let of = |value: f32| floor(value / cell).clamp(-Self::FURTHEST, Self::FURTHEST);
        let span =
            |value: f32| of(value - radius).max(-furthest)..=of(value + radius).min(furthest);
        for x in span(centre.x) {
            for z in span(centre.z) {
                let heights = Self::reached(centre, radius, cell, (x, z));
                if heights != 0 {
                    visit(Self { x, z, heights });
                }
            }
        }
    }
}

/// The cells that an evasion vacates, relative to the cell that it starts in.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Vacated {
    x: i32,
    z: i32,
    width: u32,
    depth: u32,
    /// Of its heights, `[x][z]`.
    first: u32,
}

/// Under what a path is filed.
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
    vacated: Vec<Vacated>,
    heights: Vec<u64>,
    /// By path.
    filed: Vec<Filed>,
}

/// What the grids of a graph are made of.
pub(super) struct GridSource<'a> {
    pub body: &'a Body,
    /// No part of the body is further from the root, metres.
    pub reach: f32,
    /// The track of each evasion, and the sample at which it ends.
    pub evasions: Vec<(&'a BodyTrack, usize)>,
    pub paths: &'a PathTable,
}

impl Grid {
    /// Headings that are told apart.
    pub const HEADINGS: u32 = 72;

    /// Parts of a cell that are told apart, along x and along z.
    pub const PARTS: u32 = 2;

    pub(super) fn new(source: &GridSource<'_>, settings: GridSettings) -> Self {
        let mut grid = Self {
            cell: Self::fitting_cell(source, settings.cell.clamp(0.05, 1.0)),
            ..Self::default()
        };
        for (track, end) in &source.evasions {
            for kind in 0..Self::HEADINGS * Self::PARTS * Self::PARTS {
                let ends = [0, *end].map(|tick| grid.occupied(source.body, track, tick, kind));
                grid.push_vacated(&ends);
            }
        }
        grid.filed = source.paths.all().iter().map(|p| grid.file(p)).collect();
        grid
    }

    /// Most columns of all evasions, 128 MB.
    const MOST_COLUMNS: f32 = (1 << 24) as f32;

    /// The side of a cell, doubled until the evasions of a giant, or of thousands, fit into [`Grid::MOST_COLUMNS`]. That of
    /// anybody else stays what it was.
    fn fitting_cell(source: &GridSource<'_>, cell: f32) -> f32 {
        let kinds = (Self::HEADINGS * Self::PARTS * Self::PARTS) as f32;
        let count = kinds * source.evasions.len() as f32;
        let columns = |cell: f32| {
            let side =
                (2.0 * source.reach / cell + 3.0).min(2.0 * CellColumn::FURTHEST as f32 + 1.0);
            count * side * side
        };
        let sides = std::iter::successors(Some(cell), |cell| Some(2.0 * cell)).take(64);
        { sides }
            .find(|&cell| columns(cell) <= Self::MOST_COLUMNS)
            .unwrap_or(cell)
    }

    /// The columns of cells that the body occupies at one sample of an evasion that starts in cell
    /// `(0, 0)`; `kind` says in which part of it and facing where.
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
            let sphere = (centre, sphere.radius);
            CellColumn::for_each_reached(sphere, self.cell, i32::MAX, |c| columns.push(c));
        }
        columns
    }

    /// Adds the cells of the first set that are not in the second.
    fn push_vacated(&mut self, [start, end]: &[Vec<CellColumn>; 2]) {
        let ends = |of: fn(&CellColumn) -> i32| {
            let low = start.iter().map(of).min().unwrap_or(0);
            let high = start.iter().map(of).max().unwrap_or(-1);
            (low, (high - low + 1) as u32)
        };
        let ((x, width), (z, depth)) = (ends(|c| c.x), ends(|c| c.z));
        let vacated = Vacated {
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

    /// Side of a cell, metres.
    #[must_use]
    pub fn cell(&self) -> f32 {
        self.cell
    }

    /// The cells of a column, in the node's frame, that a path vacates.
    #[must_use]
    #[inline]
    pub fn vacates(&self, path: PathId, column: CellColumn) -> u64 {
        let filed = self.filed[path.0 as usize];
        let vacated = &self.vacated[filed.vacated as usize];
        vacated
            .position(column.x - filed.x, column.z - filed.z)
            .map_or(0, |at| self.heights[at] & column.heights)
    }

    /// Whether a path vacates a cell of `columns`, which come in order ([`TouchedCells::merge`]).
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

    /// What it takes in memory, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(self.vacated.as_slice())
            + size_of_val(self.heights.as_slice())
            + size_of_val(self.filed.as_slice())
    }

    /// What it would take as a list of paths for every cell of every node, two bytes an entry.
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

impl Vacated {
    #[inline]
    fn position(&self, x: i32, z: i32) -> Option<usize> {
        let (x, z) = (x.wrapping_sub(self.x) as u32, z.wrapping_sub(self.z) as u32);
        (x < self.width && z < self.depth)
            .then(|| self.first as usize + (x * self.depth + z) as usize)
    }
}

/// The cells that an attack touches, in the frame of a node. Buffers are kept from one attack to
/// the next.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TouchedCells {
    columns: Vec<CellColumn>,
    /// Columns that are noted before they are merged.
    room: usize,
}

impl TouchedCells {
    /// Columns that are noted at first before they are merged, 1.5 MB. An attack touches some hundreds.
    const ROOM: usize = 1 << 16;

    /// Forgets all.
    pub fn clear(&mut self) {
        self.columns.clear();
        self.room = 0;
    }

    /// Adds the cells that a sphere (centre and radius, metres) reaches, as far as they lie within `reach` (metres) of the
    /// node's root along x and along z.
    pub fn add(&mut self, (centre, radius): (Vec3, f32), cell: f32, reach: f32) {
        if centre.x.abs() - radius > reach || centre.z.abs() - radius > reach {
            return;
        }
        // Beyond reach there is nothing to look up.
        let within = floor(reach / cell).saturating_add(1);
        let columns = &mut self.columns;
        CellColumn::for_each_reached((centre, radius), cell, within, |c| columns.push(c));
        if self.columns.len() > self.room.max(Self::ROOM) {
            self.merge();
            self.room = 2 * self.columns.len();
        }
    }

    /// Columns in order, each once. Call it when all spheres are in.
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
