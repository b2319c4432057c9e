//! The maps of all evasions as the shader reads them: tiles of 8 × 8 texels, and pages for those that hold something.
//!
//! All slabs of a region share one rectangle of tiles, so that a candidate finds a texel by one look at a tile instead of
//! the rectangles of three maps. A tile says where its page starts, and what lies in it or near it: enough to leave away most
//! of the attack's blocks without a look at their texels.

use crate::{
    avoid::cull::BLOCK,
    gpu::{GpuError, error::within},
    region::{MapRect, MaskMap, RegionAtlas, RegionMaps, Slab},
};

/// Side of a tile, texels, and its logarithm.
const SIDE: i32 = 1 << SIDE_LOG2;
const SIDE_LOG2: i32 = 3;
const TEXELS: usize = (SIDE * SIDE) as usize;
/// The texels of a block whose middle lies in a tile are not further from it than this, as long as a turn's sine and cosine
/// make 2 at most: the outermost centres of its texels are 1.5 texels from its middle along both axes.
const NEAR: i32 = 3;
const _: () = assert!(BLOCK == 4);
/// Most slabs from the lowest region's first to the highest one's last: what a block's word has bits for.
const MOST_SLABS: u32 = 1 << 14;

/// The tiles of a region.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PagedRegion {
    /// First texel of the tiles, in the evasion's frame.
    pub(super) origin: [i32; 2],
    /// Tiles across and down, in each slab.
    pub(super) side: [i32; 2],
    /// Position of its first tile.
    pub(super) tiles: u32,
    /// Counted from the lowest slab of all regions.
    pub(super) first_slab: u32,
    pub(super) slabs: u32,
}

/// The atlas, laid out for the shader.
#[derive(Debug)]
pub(super) struct Pages {
    /// Tiles (word of the page, masks), then pages (body masks, outer masks, evasion bits).
    pub(super) words: Vec<u32>,
    pub(super) regions: Vec<PagedRegion>,
    /// Words of a mask.
    pub(super) lanes: usize,
    lowest: i32,
    slabs: u32,
}

impl Pages {
    /// `most` bytes for the tiles.
    pub(super) fn new(atlas: &RegionAtlas, most: u64) -> Result<Self, GpuError> {
        let regions = || {
            let maps = atlas.regions().iter();
            maps.filter(|region| !region.slabs.is_empty())
        };
        let ends = regions().map(|region| region.first_slab.0 + region.slabs.len() as i32);
        let lowest = regions().map(|region| region.first_slab.0).min();
        let lowest = lowest.unwrap_or_default();
        let slabs = ends.max().map_or(0, |end| (end - lowest) as u32);
        let limit = "slabs from the lowest map to the highest";
        within(limit, slabs.into(), MOST_SLABS.into())?;
        let mut pages = Self {
            words: Vec::new(),
            regions: Vec::with_capacity(atlas.regions().len()),
            lanes: atlas.grid().lanes(),
            lowest,
            slabs,
        };
        pages.lay_out(atlas, most)?;
        for (region, maps) in atlas.regions().iter().enumerate() {
            pages.fill(pages.regions[region], maps);
        }
        Ok(pages)
    }

    /// Number of a slab, if any region has it.
    pub(super) fn slab(&self, slab: Slab) -> Option<u32> {
        let number = u32::try_from(slab.0.checked_sub(self.lowest)?).ok()?;
        (number < self.slabs).then_some(number)
    }

    /// Gives every region its tiles.
    fn lay_out(&mut self, atlas: &RegionAtlas, most: u64) -> Result<(), GpuError> {
        let mut tiles = 0u64;
        for maps in atlas.regions() {
            let rects = maps.slabs.iter().map(|slab| slab.rect());
            let rect = rects.fold(MapRect::default(), MapRect::union);
            if rect.is_empty() {
                self.regions.push(PagedRegion::default());
                continue;
            }
            let side = |texels: u32| (texels as i32 + 2 * NEAR + SIDE - 1) >> SIDE_LOG2;
            let region = PagedRegion {
                origin: [rect.u - NEAR, rect.v - NEAR],
                side: [rect.width, rect.height].map(side),
                tiles: tiles as u32,
                first_slab: (maps.first_slab.0 - self.lowest) as u32,
                slabs: maps.slabs.len() as u32,
            };
            let [across, down] = region.side.map(|side| side as u64);
            tiles += across * down * u64::from(region.slabs);
            let bytes = tiles * 4 * (1 + self.lanes as u64);
            within("maxStorageBufferRange", bytes, most)?;
            self.regions.push(region);
        }
        self.words.resize(tiles as usize * (1 + self.lanes), 0);
        Ok(())
    }

    fn fill(&mut self, region: PagedRegion, maps: &RegionMaps) {
        for (slab, maps) in maps.slabs.iter().enumerate() {
            self.masks((region, slab), &maps.body, 0);
            self.masks((region, slab), &maps.outer, TEXELS * self.lanes);
            let rect = maps.evasion.rect();
            maps.evasion.for_each(|column, row| {
                let at = region.place(rect, [column, row]);
                let texel = texel_of(at);
                let word = self.page(region, slab, at) + 2 * TEXELS * self.lanes + texel / 32;
                self.words[word] |= 1 << (texel % 32);
                // Whatever slice the attack comes in.
                self.near((region, slab), at, &[u32::MAX; 2]);
            });
        }
    }

    /// One map's masks, to `part` of the pages.
    fn masks(&mut self, (region, slab): (PagedRegion, usize), map: &MaskMap, part: usize) {
        let (rect, lanes) = (map.rect(), self.lanes);
        for (index, mask) in map.masks().chunks_exact(lanes).enumerate() {
            if mask.iter().all(|&word| word == 0) {
                continue;
            }
            let width = rect.width as usize;
            let column_row = [(index % width) as i32, (index / width) as i32];
            let at = region.place(rect, column_row);
            let word = self.page(region, slab, at) + part + texel_of(at) * lanes;
            self.words[word..word + lanes].copy_from_slice(mask);
            self.near((region, slab), at, mask);
        }
    }

    /// Where a texel's page starts; makes it if there is none.
    fn page(&mut self, region: PagedRegion, slab: usize, at: [i32; 2]) -> usize {
        let tile = self.tile(region, slab, at.map(|place| place >> SIDE_LOG2));
        if self.words[tile] == 0 {
            let end = self.words.len();
            self.words[tile] = end as u32;
            let page = 2 * TEXELS * self.lanes + TEXELS / 32;
            self.words.resize(end + page, 0);
        }
        self.words[tile] as usize
    }

    /// Tells a texel's mask to all tiles that it is near to.
    fn near(&mut self, (region, slab): (PagedRegion, usize), at: [i32; 2], mask: &[u32]) {
        let low = at.map(|place| (place - NEAR) >> SIDE_LOG2);
        let high = at.map(|place| (place + NEAR) >> SIDE_LOG2);
        for row in low[1]..=high[1] {
            for column in low[0]..=high[0] {
                let tile = self.tile(region, slab, [column, row]) + 1;
                let words = &mut self.words[tile..tile + self.lanes];
                for (word, bits) in words.iter_mut().zip(mask) {
                    *word |= bits;
                }
            }
        }
    }

    /// Where a tile's words start.
    fn tile(&self, region: PagedRegion, slab: usize, [column, row]: [i32; 2]) -> usize {
        let [across, down] = region.side.map(|side| side as usize);
        let tile = (slab * down + row as usize) * across + column as usize;
        (region.tiles as usize + tile) * (1 + self.lanes)
    }
}

impl PagedRegion {
    /// A map's texel, counted from the tiles' first one.
    fn place(&self, rect: MapRect, [column, row]: [i32; 2]) -> [i32; 2] {
        [
            rect.u + column - self.origin[0],
            rect.v + row - self.origin[1],
        ]
    }
}

/// Number of a texel in its tile.
fn texel_of([x, z]: [i32; 2]) -> usize {
    ((z % SIDE) * SIDE + x % SIDE) as usize
}
