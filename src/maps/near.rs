//! Which slices a whole block of texels can meet: small maps that say "nothing here" of nearly all
//! of an attack's blocks, so that texels are looked up of the others alone.

use super::{MapGrid, MapRect, MaskMap, RegionMaps, SlabMaps};

/// What a region's maps hold, in short.
#[derive(Clone, Debug, Default)]
pub(crate) struct NearRegion {
    /// By slab.
    pub(crate) slabs: Vec<NearMap>,
    /// Around all maps of all slabs.
    pub(crate) rect: MapRect,
    /// By slice: around the body and outer maps of all slabs.
    pub(crate) slices: Vec<MapRect>,
    /// Around the evasion maps of all slabs.
    pub(crate) evasion: MapRect,
    /// Around the evasion and the body maps of all slabs.
    pub(crate) inner: MapRect,
}

impl NearRegion {
    pub(super) fn new(region: &RegionMaps, grid: MapGrid) -> Self {
        let slices = grid.slices;
        let mut near = Self {
            slices: vec![MapRect::default(); slices as usize],
            ..Self::default()
        };
        for maps in &region.slabs {
            near.slabs.push(NearMap::new(maps, grid));
            near.rect = near.rect.union(maps.rect());
            near.evasion = near.evasion.union(maps.evasion.rect());
            near.inner = near.inner.union(maps.evasion.rect());
            near.inner = near.inner.union(maps.body.rect());
            near.add(&maps.body);
            near.add(&maps.outer);
        }
        near
    }

    /// Widens the slices' rectangles around a map.
    fn add(&mut self, map: &MaskMap) {
        let rects = map.slice_rects(self.slices.len() as u32);
        for (around, rect) in self.slices.iter_mut().zip(rects) {
            *around = around.union(rect);
        }
    }
}

/// Cells of 4 × 4 of the attack's texels over the maps of a slab. A cell has the bits of all texels
/// that a point in it is no further from than three of the attack's in each axis.
#[derive(Clone, Debug, Default)]
pub(crate) struct NearMap {
    /// Side of a cell, texels: 1 << shift.
    pub(crate) shift: u32,
    /// First texel of the first cell, in the maps' frame.
    pub(crate) u: i32,
    pub(crate) v: i32,
    pub(crate) columns: u32,
    pub(crate) rows: u32,
    /// `[lane][row][column]`: slices of outer maps, and of body maps.
    outer: Vec<u32>,
    body: Vec<u32>,
    /// `[row][column]`: not 0 where a texel of the evasion map may be met.
    evasion: Vec<u32>,
}

impl NearMap {
    /// Half of a turned block and a little more, texels of the attack.
    const REACH: i32 = 3;

    pub(super) fn new(maps: &SlabMaps, grid: MapGrid) -> Self {
        let (rect, lanes) = (maps.rect(), grid.lanes());
        let shift = 2 + grid.attack_pitch.trailing_zeros();
        if rect.is_empty() {
            return Self::default();
        }
        let cell = 1 << shift;
        // Room on all sides for points that reach into the maps from outside.
        let cells = |texels: u32| (texels + 2 * cell).div_ceil(cell);
        let (columns, rows) = (cells(rect.width), cells(rect.height));
        let count = (columns * rows) as usize;
        let mut near = Self {
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
                        let texel = (column as i32, row as i32);
                        near.spread((map.rect(), texel), mask, is_body);
                    }
                }
            }
        }
        let rect = maps.evasion.rect();
        maps.evasion.for_each(|column, row| {
            for cell in near.around(rect, (column, row)).into_iter().flatten() {
                near.evasion[cell] = 1;
            }
        });
        near
    }

    /// The lane's slices of the outer map, `[row][column]`.
    #[inline(always)]
    pub(crate) fn outer(&self, lane: usize) -> &[u32] {
        let cells = self.evasion.len();
        &self.outer[lane * cells..(lane + 1) * cells]
    }

    /// The lane's slices of the body map, `[row][column]`.
    #[inline(always)]
    pub(crate) fn body(&self, lane: usize) -> &[u32] {
        let cells = self.evasion.len();
        &self.body[lane * cells..(lane + 1) * cells]
    }

    /// Not 0 where the evasion map may be met, `[row][column]`.
    pub(crate) fn evasion(&self) -> &[u32] {
        &self.evasion
    }

    fn spread(&mut self, (rect, texel): (MapRect, (i32, i32)), mask: &[u32], is_body: bool) {
        let cells = self.evasion.len();
        for cell in self.around(rect, texel).into_iter().flatten() {
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

    /// The cells that a texel of a map is within reach of: three in each axis at most.
    fn around(&self, rect: MapRect, (column, row): (i32, i32)) -> [Option<usize>; 9] {
        let (column, row) = (column + rect.u - self.u, row + rect.v - self.v);
        // With cells of 4, a point of cell i lies from 4 i to 4 i + 4, the texels around it from 4 i - 3 to 4 i + 6.
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
