//! The layout of an atlas in a buffer: the words of its maps, one after the other.

use super::map_bits::MapBits;
use crate::maps::{MapRect, RegionAtlas, RegionId, Slab};

/// Words of all maps of the atlas. Each slab has its body masks, then its outer masks, then the bits of its evasion map.
pub(super) fn words(atlas: &RegionAtlas) -> impl Iterator<Item = &[u32]> {
    let slabs = atlas.regions().iter().flat_map(|region| &region.slabs);
    slabs.flat_map(|slab| [slab.body.masks(), slab.outer.masks(), slab.evasion.words()])
}

/// Positions of the maps of each slab in [`words`]: body, outer, evasion.
pub(super) fn places(atlas: &RegionAtlas) -> Vec<[MapBits; 3]> {
    let lanes = atlas.grid().lanes() as u32;
    let mut first = 0;
    let mut place = |rect: MapRect, words: &[u32], row_words: u32, texel_bits_log2: u32| {
        let first_bit = (32 * first) as u32;
        first += words.len();
        MapBits {
            u: rect.u,
            v: rect.v,
            width: rect.width,
            height: rect.height,
            first_bit,
            row_bits: 32 * row_words,
            texel_bits_log2,
        }
    };
    let slabs = atlas.regions().iter().flat_map(|region| &region.slabs);
    let of_slabs = slabs.map(|slab| {
        let [body, outer] = [&slab.body, &slab.outer]
            .map(|map| place(map.rect(), map.masks(), map.rect().width * lanes, 4 + lanes));
        let evasion = &slab.evasion;
        let row_words = evasion.words_per_row() as u32;
        let evasion = place(evasion.rect(), evasion.words(), row_words, 0);
        [body, outer, evasion]
    });
    of_slabs.collect()
}

/// Numbers the slabs of all regions consecutively.
#[derive(Debug)]
pub(super) struct SlabNumbers {
    /// For each region: its first slab, the number of that slab, and its number of slabs.
    regions: Vec<(Slab, u32, u32)>,
}

impl SlabNumbers {
    pub(super) fn new(atlas: &RegionAtlas) -> Self {
        let mut next = 0;
        let regions = atlas.regions().iter().map(|region| {
            let (first, count) = (next, region.slabs.len() as u32);
            next += count;
            (region.first_slab, first, count)
        });
        Self {
            regions: regions.collect(),
        }
    }

    /// Number of regions.
    pub(super) fn regions(&self) -> usize {
        self.regions.len()
    }

    /// Number of a region's slab, or `None` if the region does not have that slab.
    pub(super) fn find(&self, region: RegionId, slab: Slab) -> Option<u32> {
        let (first_slab, first, count) = self.regions[region.index()];
        let index = u32::try_from(slab.0.checked_sub(first_slab.0)?).ok()?;
        (index < count).then_some(first + index)
    }
}
