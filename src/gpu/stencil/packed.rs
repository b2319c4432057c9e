//! The places of an atlas's maps in a buffer that holds their words one after the other.

use crate::maps::{MapRect, RegionAtlas, RegionId, Slab};

/// Words of the evasions' maps, one map after the other: of each slab body masks, outer masks, and bits of the evasion map.
pub(super) fn words(atlas: &RegionAtlas) -> impl Iterator<Item = &[u32]> {
    let slabs = atlas.regions().iter().flat_map(|region| &region.slabs);
    slabs.flat_map(|slab| [slab.body.masks(), slab.outer.masks(), slab.evasion.words()])
}

/// Position of one map in its frame, and of its data in [`words`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PackedMap {
    /// First column, in texels of the evasion's frame.
    pub(super) u: i32,
    /// First row, in texels of the evasion's frame.
    pub(super) v: i32,
    /// Number of columns.
    pub(super) width: u32,
    /// Number of rows.
    pub(super) height: u32,
    /// Index of the map's first word in [`words`].
    pub(super) word: u32,
    /// Number of words in a row.
    pub(super) words_per_row: u32,
}

/// Positions of the maps of one region in one slab.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PackedMaps {
    /// Body masks, `[row][column][lane]`.
    pub(super) body: PackedMap,
    /// Outer masks, `[row][column][lane]`.
    pub(super) outer: PackedMap,
    /// Evasion map, one bit for each texel. Column 0 is the lowest bit of a row's first word.
    pub(super) evasion: PackedMap,
}

/// Places of the maps of a [`RegionAtlas`] in a buffer that holds their words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct PackedAtlas {
    /// Number of words of all maps.
    pub(super) words: usize,
    /// Positions of the maps, one entry for each region and slab.
    pub(super) maps: Vec<PackedMaps>,
    /// Number of words in a mask: 1 or 2.
    pub(super) lanes: u32,
    /// For each region: its first slab, its first entry in `maps`, and its number of entries.
    regions: Vec<(Slab, u32, u32)>,
}

impl PackedAtlas {
    pub(super) fn new(atlas: &RegionAtlas) -> Self {
        let mut packed = PackedAtlas {
            words: 0,
            maps: Vec::new(),
            lanes: atlas.grid().lanes() as u32,
            regions: Vec::new(),
        };
        for region in atlas.regions() {
            packed.regions.push((
                region.first_slab,
                packed.maps.len() as u32,
                region.slabs.len() as u32,
            ));
            for slab in &region.slabs {
                let maps = PackedMaps {
                    body: packed.append(slab.body.rect(), slab.body.masks(), 0),
                    outer: packed.append(slab.outer.rect(), slab.outer.masks(), 0),
                    evasion: packed.append(
                        slab.evasion.rect(),
                        slab.evasion.words(),
                        slab.evasion.words_per_row() as u32,
                    ),
                };
                packed.maps.push(maps);
            }
        }
        packed
    }

    /// Index in `maps` of a region's slab, or `None` if the region does not have that slab.
    #[must_use]
    pub(super) fn find(&self, region: RegionId, slab: Slab) -> Option<u32> {
        let (first_slab, first, count) = self.regions[region.index()];
        let index = u32::try_from(slab.0.checked_sub(first_slab.0)?).ok()?;
        (index < count).then_some(first + index)
    }

    /// Appends one map. `words_per_row` is 0 for masks, because their rows are not padded.
    fn append(&mut self, rect: MapRect, words: &[u32], words_per_row: u32) -> PackedMap {
        let word = self.words as u32;
        self.words += words.len();
        PackedMap {
            u: rect.u,
            v: rect.v,
            width: rect.width,
            height: rect.height,
            word,
            words_per_row: if words_per_row > 0 {
                words_per_row
            } else {
                rect.width * self.lanes
            },
        }
    }
}
