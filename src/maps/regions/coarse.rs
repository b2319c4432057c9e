//! Coarse maps that tell which slices a block of texels can meet. They reject nearly all of an
//! attack's blocks, so that only the remaining blocks need texel look-ups.

use super::bit_map::{BitMap, MapRect};
use super::map_grid::MapGrid;
use super::mask_map::MaskMap;
use super::region_maps::{RegionMaps, SlabMaps};

/// The coarse maps and bounding rectangles of one region.
#[derive(Clone, Debug, Default)]
pub(crate) struct CoarseRegion {
    pub(crate) slabs: Vec<CoarseMap>,
    /// Bounding rectangle of all maps of all slabs.
    pub(crate) rect: MapRect,
    /// For each slice, the bounding rectangle of the body and outer maps of all slabs.
    pub(crate) slices: Vec<MapRect>,
    /// Bounding rectangle of the evasion maps of all slabs.
    pub(crate) evasion: MapRect,
    /// Bounding rectangle of the evasion and body maps of all slabs.
    pub(crate) inner: MapRect,
}

impl CoarseRegion {
    pub(super) fn new(region: &RegionMaps, grid: MapGrid) -> Self {
        let slices = grid.slices;
        let mut coarse = Self {
            slices: vec![MapRect::default(); slices as usize],
            ..Self::default()
        };
        for maps in &region.slabs {
            coarse.slabs.push(CoarseMap::new(maps, grid));
            coarse.rect = coarse.rect.union(maps.rect());
            coarse.evasion = coarse.evasion.union(maps.evasion.rect());
            coarse.inner = coarse.inner.union(maps.evasion.rect());
            coarse.inner = coarse.inner.union(maps.body.rect());
            coarse.add(&maps.body);
            coarse.add(&maps.outer);
        }
        coarse
    }

    /// Grows the slices' rectangles to include a map.
    fn add(&mut self, map: &MaskMap) {
        let rects = map.slice_rects(self.slices.len() as u32);
        for (around, rect) in self.slices.iter_mut().zip(rects) {
            *around = around.union(rect);
        }
    }
}

/// A grid over the maps of a slab, with cells of 4 × 4 texels. A cell holds the bits of all
/// texels that are within three texels of any of its points along each axis.
#[derive(Clone, Debug, Default)]
pub(crate) struct CoarseMap {
    /// First texel of the first cell, in the maps' frame.
    pub(crate) u: i32,
    pub(crate) v: i32,
    pub(crate) columns: u32,
    pub(crate) rows: u32,
    /// Slices of the outer map, `[lane][row][column]`.
    outer: Vec<u32>,
    body: Vec<u32>,
    /// Evasion maps, `[row][column]`. A cell is not 0 if a texel of the evasion map is within
    /// reach.
    evasion: Vec<u32>,
}

impl CoarseMap {
    /// Side of a cell is `1 << SHIFT` texels.
    pub(crate) const SHIFT: u32 = 2;
    /// Reach of a cell: half of a rotated block, rounded up, in texels.
    const REACH: i32 = 3;

    pub(super) fn new(maps: &SlabMaps, grid: MapGrid) -> Self {
        let rect = maps.rect();
        if rect.is_empty() {
            return Self::default();
        }
        let cell = 1 << Self::SHIFT;
        // A border of cells covers points outside the maps that reach into them.
        let cells = |texels: u32| (texels + 2 * cell).div_ceil(cell);
        let (columns, rows) = (cells(rect.width), cells(rect.height));
        let mut coarse = Self {
            u: rect.u - cell as i32,
            v: rect.v - cell as i32,
            columns,
            rows,
            ..Self::default()
        };
        coarse.body = coarse.masks(&maps.body, grid.lanes());
        coarse.outer = coarse.masks(&maps.outer, grid.lanes());
        coarse.evasion = coarse.bits(&maps.evasion);
        coarse
    }

    /// Coarse map of a map over time with masks of `lanes` words, `[lane][row][column]`.
    fn masks(&self, map: &MaskMap, lanes: usize) -> Vec<u32> {
        let (rect, cells) = (map.rect(), (self.columns * self.rows) as usize);
        let mut out = vec![0; lanes * cells];
        for (texel, mask) in (0..).zip(map.masks().chunks_exact(lanes)) {
            if mask.iter().all(|&word| word == 0) {
                continue;
            }
            let width = rect.width as i32;
            for cell in self.cells(rect, texel % width, texel / width) {
                for (lane, word) in mask.iter().enumerate() {
                    out[lane * cells + cell] |= word;
                }
            }
        }
        out
    }

    /// Coarse map of a map with one bit for each texel, `[row][column]`.
    fn bits(&self, map: &BitMap) -> Vec<u32> {
        let mut out = vec![0; (self.columns * self.rows) as usize];
        map.for_each(|column, row| {
            for cell in self.cells(map.rect(), column, row) {
                out[cell] = 1;
            }
        });
        out
    }

    /// Cells that reach a texel of a map in `rect`, at most nine.
    fn cells(&self, rect: MapRect, column: i32, row: i32) -> impl Iterator<Item = usize> + use<> {
        let (reach, shift) = (Self::REACH, Self::SHIFT);
        // Along one axis. Cell i covers 4 i to 4 i + 4 and reaches the texels 4 i - 3 to 4 i + 6.
        let along = |texel: i32, count: u32| {
            let within = |cell: i32| cell.clamp(0, count as i32) as usize;
            within((texel - reach) >> shift)..within(((texel + reach) >> shift) + 1)
        };
        let columns = along(column + rect.u - self.u, self.columns);
        let (rows, width) = (
            along(row + rect.v - self.v, self.rows),
            self.columns as usize,
        );
        rows.flat_map(move |row| columns.clone().map(move |column| row * width + column))
    }

    /// Slices of the outer map in one lane, `[row][column]`.
    #[inline(always)]
    pub(crate) fn outer(&self, lane: usize) -> &[u32] {
        let cells = self.evasion.len();
        &self.outer[lane * cells..(lane + 1) * cells]
    }

    /// Slices of the body map in one lane, `[row][column]`.
    #[inline(always)]
    pub(crate) fn body(&self, lane: usize) -> &[u32] {
        let cells = self.evasion.len();
        &self.body[lane * cells..(lane + 1) * cells]
    }

    /// Evasion map, `[row][column]`. A cell is not 0 if a texel of the evasion map is within reach.
    pub(crate) fn evasion(&self) -> &[u32] {
        &self.evasion
    }
}
