//! Coarse maps that tell which slices a block of texels can meet. They reject nearly all of an
//! attack's blocks, so that only the remaining blocks need texel look-ups.

use super::{MapGrid, MapRect, MaskMap, RegionMaps, SlabMaps};

/// The coarse maps and bounding rectangles of one region.
#[derive(Clone, Debug, Default)]
pub(crate) struct CoarseRegion {
    /// Coarse map of each slab.
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

/// A grid over the maps of a slab, with cells of 4 × 4 attack texels. A cell holds the bits of all
/// texels that are within three attack texels of any of its points along each axis.
#[derive(Clone, Debug, Default)]
pub(crate) struct CoarseMap {
    /// Side of a cell is `1 << shift` texels.
    pub(crate) shift: u32,
    /// First texel of the first cell, in the maps' frame.
    pub(crate) u: i32,
    pub(crate) v: i32,
    pub(crate) columns: u32,
    pub(crate) rows: u32,
    /// Slices of the outer maps, `[lane][row][column]`.
    outer: Vec<u32>,
    body: Vec<u32>,
    /// Evasion maps, `[row][column]`. A cell is not 0 if a texel of the evasion map is within
    /// reach.
    evasion: Vec<u32>,
}

impl CoarseMap {
    /// Reach of a cell: half of a rotated block, rounded up, in attack texels.
    const REACH: i32 = 3;

    pub(super) fn new(maps: &SlabMaps, grid: MapGrid) -> Self {
        let (rect, lanes) = (maps.rect(), grid.lanes());
        let shift = 2 + grid.attack_pitch.trailing_zeros();
        if rect.is_empty() {
            return Self::default();
        }
        let cell = 1 << shift;
        // A border of cells covers points outside the maps that reach into them.
        let cells = |texels: u32| (texels + 2 * cell).div_ceil(cell);
        let (columns, rows) = (cells(rect.width), cells(rect.height));
        let count = (columns * rows) as usize;
        let mut coarse = Self {
            shift,
            u: rect.u - cell as i32,
            v: rect.v - cell as i32,
            columns,
            rows,
            outer: vec![0; lanes * count],
            body: vec![0; lanes * count],
            evasion: vec![0; count],
        };
        for (map, is_body) in [(&maps.body, true), (&maps.outer, false)] {
            let width = map.rect().width as usize * map.lanes();
            for (row, texels) in map.masks().chunks(width.max(1)).enumerate() {
                for (column, mask) in texels.chunks(map.lanes()).enumerate() {
                    if mask.iter().any(|&word| word != 0) {
                        let cells = coarse.around(map.rect(), [column as i32, row as i32]);
                        coarse.spread(cells, mask, is_body);
                    }
                }
            }
        }
        let rect = maps.evasion.rect();
        maps.evasion.for_each(|column, row| {
            for cell in coarse.around(rect, [column, row]).into_iter().flatten() {
                coarse.evasion[cell] = 1;
            }
        });
        coarse
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

    /// Adds a texel's mask to the cells within its reach.
    fn spread(&mut self, within: [Option<usize>; 9], mask: &[u32], is_body: bool) {
        let cells = self.evasion.len();
        for cell in within.into_iter().flatten() {
            let target = if is_body {
                &mut self.body
            } else {
                &mut self.outer
            };
            for (lane, word) in mask.iter().enumerate() {
                target[lane * cells + cell] |= word;
            }
        }
    }

    /// Cells that are within reach of a texel: at most three along each axis.
    fn around(&self, rect: MapRect, [column, row]: [i32; 2]) -> [Option<usize>; 9] {
        let (column, row) = (column + rect.u - self.u, row + rect.v - self.v);
        // With cells of 4 texels, cell i covers 4 i to 4 i + 4 and reaches the texels 4 i - 3 to 4
        // i + 6.
        let reach = Self::REACH << (self.shift - 2);
        let first = |texel: i32| (texel - reach) >> self.shift;
        let last = |texel: i32| (texel + reach) >> self.shift;
        let mut cells = [None; 9];
        for dv in 0..3 {
            for du in 0..3 {
                let (u, v) = (first(column) + du, first(row) + dv);
                let within = u <= last(column)
                    && v <= last(row)
                    && (0..self.columns as i32).contains(&u)
                    && (0..self.rows as i32).contains(&v);
                if within {
                    cells[(dv * 3 + du) as usize] = Some((v * self.columns as i32 + u) as usize);
                }
            }
        }
        cells
    }
}
