//! Finds the paths from a node that take the body out of a cell of space.
//!
//! Source: Masaoka & Oshita, section 4.1. They place a grid of cells around each node and list each
//! path that ends in an evasion in the cells that the body occupies at the evasion's start but not
//! at its end. Differs: relative to the place where an evasion starts, these cells are the same for
//! every path. They are stored once for each evasion, heading and part of a cell
//! ([`HEADINGS`], [`PARTS`]). A path stores an index into them and an offset. That takes 8 bytes
//! for each path instead of one entry for each path and cell.
//!
//! The cells of an evasion, and the index of a path, are computed on first use. They depend only on the graph.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

use super::cells::CellColumn;
use super::paths::{NodePath, PathId, PathTable};
use super::vacated::{HEADINGS, KINDS, PARTS, VacatedCells, VacatedKinds};
use crate::graph::MotionGraph;
use crate::maps::regions::{Body, BodyTrack, Evasion, EvasionTracks};
use crate::math::{Sphere, floor, in_parallel};

/// Cells of a path: an evasion, the kind of its cells, and an offset in cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct PathOffset {
    evasion: u32,
    kind: u32,
    x: i32,
    z: i32,
}

impl PathOffset {
    /// Maximum offset, in cells. All columns are closer to a node's root.
    const FURTHEST: i32 = (1 << 13) - 1;

    /// Number of bits of the kind in a packed value. The highest bit of the value is always set.
    const KIND: u32 = 9;
    const OFFSET: u32 = 14;

    fn packed(self) -> u64 {
        let offset =
            |value: i32| (value.clamp(-Self::FURTHEST, Self::FURTHEST) + Self::FURTHEST + 1) as u64;
        let places = offset(self.x) << Self::OFFSET | offset(self.z);
        let kind = u64::from(self.kind) << (2 * Self::OFFSET);
        1 << 63 | u64::from(self.evasion) << (Self::KIND + 2 * Self::OFFSET) | kind | places
    }

    #[inline]
    fn unpacked(packed: u64) -> Self {
        let bits = |first: u32, count: u32| (packed >> first & ((1 << count) - 1)) as u32;
        let offset = |first: u32| bits(first, Self::OFFSET) as i32 - Self::FURTHEST - 1;
        Self {
            evasion: bits(Self::KIND + 2 * Self::OFFSET, 26),
            kind: bits(2 * Self::OFFSET, Self::KIND),
            x: offset(Self::OFFSET),
            z: offset(0),
        }
    }
}

/// Computed parts of the grids of all nodes.
#[derive(Clone, Debug, Default)]
pub(in crate::maps) struct GridCells {
    cell: f32,
    /// Cells of each evasion.
    evasions: Vec<OnceLock<VacatedKinds>>,
    /// [`PathOffset::packed`] of each path; 0 before its first use. Blocks are allocated on first use.
    offsets: Vec<OnceLock<OffsetBlock>>,
    paths: usize,
}

/// [`PathOffset::packed`] of neighbouring paths.
#[derive(Debug)]
struct OffsetBlock(Box<[AtomicU64]>);

impl OffsetBlock {
    /// Number of paths of a block.
    const SIZE: usize = 4096;
}

impl Default for OffsetBlock {
    fn default() -> Self {
        Self((0..Self::SIZE).map(|_| AtomicU64::new(0)).collect())
    }
}

impl Clone for OffsetBlock {
    fn clone(&self) -> Self {
        let offset = |of: &AtomicU64| AtomicU64::new(of.load(Ordering::Relaxed));
        Self(self.0.iter().map(offset).collect())
    }
}

impl GridCells {
    /// Maximum number of evasions.
    pub(in crate::maps) const MOST_EVASIONS: usize = 1 << 26;

    /// Side of a cell, in metres.
    pub(in crate::maps) const CELL: f32 = 0.10;

    /// The cells of a body whose parts are at most `reach` metres from its root. `cell` is the side of a cell, in metres, from 0.05 to 1.
    pub(in crate::maps) fn new(cell: f32, reach: f32, evasions: usize, paths: usize) -> Self {
        let blocks = paths.div_ceil(OffsetBlock::SIZE);
        Self {
            cell: Self::fitting_cell(cell.clamp(0.05, 1.0), reach, evasions),
            evasions: (0..evasions).map(|_| OnceLock::new()).collect(),
            offsets: (0..blocks).map(|_| OnceLock::new()).collect(),
            paths,
        }
    }

    /// Maximum number of columns of all evasions: 128 MB.
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
        let heading = ((turns - floor(turns) as f32) * HEADINGS as f32) as u32;
        let place = |metres: f32| {
            let cells = metres / self.cell;
            let whole = floor(cells);
            let part = ((cells - whole as f32) * PARTS as f32) as u32;
            (whole, part.min(PARTS - 1))
        };
        let ((x, x_part), (z, z_part)) = (place(path.placement.x), place(path.placement.z));
        let kind = (heading.min(HEADINGS - 1) * PARTS + x_part) * PARTS + z_part;
        PathOffset {
            evasion: path.goal,
            kind,
            x,
            z,
        }
    }
}

/// The grids of all nodes.
#[derive(Clone, Copy, Debug)]
pub struct Grid<'a> {
    pub(in crate::maps) cells: &'a GridCells,
    pub(in crate::maps) paths: &'a PathTable,
    pub(in crate::maps) graph: &'a MotionGraph,
    pub(in crate::maps) body: &'a Body,
    pub(in crate::maps) evasions: &'a [Evasion],
    pub(in crate::maps) tracks: &'a EvasionTracks,
}

impl<'a> Grid<'a> {
    /// Computes the cells of all evasions and the offsets of all paths.
    pub(in crate::maps) fn prepare(self) {
        in_parallel(0, self.cells.evasions.len(), |evasion| {
            self.evasion(evasion);
        });
        in_parallel(0, self.cells.paths, |path| {
            self.offset(PathId(path as u32));
        });
    }

    #[inline]
    fn evasion(self, evasion: usize) -> &'a VacatedKinds {
        self.cells.evasions[evasion].get_or_init(|| {
            let track = self
                .tracks
                .get(self.graph, self.body, self.evasions, evasion);
            let seconds = self.graph.seconds(self.evasions[evasion].edge);
            let end = (seconds * BodyTrack::RATE).round() as usize;
            let [first, last] = [0, end].map(|sample| -> Vec<Sphere> {
                let own = self.body.spheres.iter().enumerate();
                own.map(|(index, own)| Sphere::new(track.centre(sample, index), own.radius))
                    .collect()
            });
            VacatedKinds::new(&first, &last, self.cells.cell)
        })
    }

    #[inline]
    fn offset(self, path: PathId) -> PathOffset {
        let index = path.0 as usize;
        let block = &self.cells.offsets[index / OffsetBlock::SIZE];
        let slot = &block.get_or_init(OffsetBlock::default).0[index % OffsetBlock::SIZE];
        match slot.load(Ordering::Relaxed) {
            0 => {
                let packed = self.cells.offset(self.paths.path(path)).packed();
                // All threads store the same value.
                slot.store(packed, Ordering::Relaxed);
                PathOffset::unpacked(packed)
            }
            packed => PathOffset::unpacked(packed),
        }
    }

    /// Position of a path's cells, and the cells of its evasion.
    #[inline]
    fn vacated(self, path: PathId) -> (PathOffset, &'a VacatedCells, &'a [u64]) {
        let offset = self.offset(path);
        let of_evasion = self.evasion(offset.evasion as usize);
        let cells = &of_evasion.kinds[offset.kind as usize];
        (offset, cells, &of_evasion.heights)
    }

    /// Side of a cell, in metres.
    #[must_use]
    pub fn cell(self) -> f32 {
        self.cells.cell
    }

    /// Cells of `column` that a path vacates. The column is in the node's frame.
    #[must_use]
    #[inline]
    pub fn vacates(self, path: PathId, column: CellColumn) -> u64 {
        let (offset, vacated, heights) = self.vacated(path);
        vacated
            .position(column.x - offset.x, column.z - offset.z)
            .map_or(0, |at| heights[at] & column.heights)
    }

    /// Whether a path vacates a cell of `columns`, which must be sorted ([`TouchedCells::merge`](super::TouchedCells::merge)).
    #[must_use]
    pub fn vacates_any(self, path: PathId, columns: &[CellColumn]) -> bool {
        let (offset, vacated, heights) = self.vacated(path);
        let first = offset.x + vacated.x;
        let start = columns.partition_point(|column| column.x < first);
        columns[start..]
            .iter()
            .take_while(|column| column.x < first + vacated.width as i32)
            .any(|column| {
                vacated
                    .position(column.x - offset.x, column.z - offset.z)
                    .is_some_and(|at| heights[at] & column.heights != 0)
            })
    }

    /// All cells that a path vacates, in the frame of its node.
    pub fn cells(self, path: PathId) -> impl Iterator<Item = CellColumn> + use<'a> {
        let (offset, vacated, heights) = self.vacated(path);
        (0..vacated.width).flat_map(move |x| {
            (0..vacated.depth).map(move |z| CellColumn {
                x: offset.x + vacated.x + x as i32,
                z: offset.z + vacated.z + z as i32,
                heights: heights[(vacated.first + x * vacated.depth + z) as usize],
            })
        })
    }
}
