//! Untimed maps as bits: body and evasion map of a slab side by side in one rectangle.

use crate::region::{BitMap, RegionAtlas, RegionId, Slab, SlabMaps};

/// Where the body map and the evasion map of one region and slab lie in [`PackedBits::words`].
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct MapBits {
    pub(crate) u: i32,
    pub(crate) v: i32,
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) words_per_row: u32,
    pub(crate) body_word: u32,
    pub(crate) evasion_word: u32,
    pub(crate) padding: u32,
}

/// An untimed atlas, laid out for the shaders.
#[derive(Debug, Default)]
pub(super) struct PackedBits {
    pub(super) words: Vec<u32>,
    /// One for each region and slab.
    pub(super) maps: Vec<MapBits>,
    /// For each region: its first slab, its first entry in `maps`, and how many entries it has.
    regions: Vec<(Slab, u32, u32)>,
}

impl PackedBits {
    pub(super) fn new(atlas: &RegionAtlas) -> Self {
        let mut packed = Self::default();
        for region in atlas.regions() {
            let (first, count) = (packed.maps.len() as u32, region.slabs.len() as u32);
            packed.regions.push((region.first_slab, first, count));
            region.slabs.iter().for_each(|slab| packed.append(slab));
        }
        packed
    }

    /// Position in `maps` of one region's slab, if it has that slab.
    pub(super) fn find(&self, region: RegionId, slab: Slab) -> Option<u32> {
        let (first_slab, first, count) = self.regions[region.index()];
        let index = u32::try_from(slab.0.checked_sub(first_slab.0)?).ok()?;
        (index < count).then_some(first + index)
    }

    fn append(&mut self, slab: &SlabMaps) {
        let rect = slab.body.rect().union(slab.evasion.rect());
        let mut body = BitMap::new(rect);
        for row in 0..rect.height as i32 {
            for column in 0..rect.width as i32 {
                let own = slab.body.rect();
                if slab.body.get(column + rect.u - own.u, row + rect.v - own.v) != 0 {
                    body.set(column, row);
                }
            }
        }
        let evasion = slab.evasion.cropped(rect);
        let body_word = self.words.len() as u32;
        self.words.extend_from_slice(body.words());
        let evasion_word = self.words.len() as u32;
        self.words.extend_from_slice(evasion.words());
        self.maps.push(MapBits {
            u: rect.u,
            v: rect.v,
            width: rect.width,
            height: rect.height,
            words_per_row: body.words_per_row() as u32,
            body_word,
            evasion_word,
            padding: 0,
        });
    }
}
