use std::sync::OnceLock;

use serde::{Deserialize, Serialize};

use super::coarse::CoarseRegion;
use super::region_maps::{AttackMaps, RegionMaps, SlabMaps};
use super::{MapGrid, MapRect, Slab};
use crate::math::in_parallel;

/// Index of an evasion's maps in a [`RegionAtlas`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct RegionId(pub u32);

impl RegionId {
    /// The id as an index into per-region arrays.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// The maps of all evasions and attacks of a graph, on one grid.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RegionAtlas {
    grid: MapGrid,
    regions: Vec<RegionMaps>,
    attacks: Vec<AttackMaps>,
    /// Coarse maps, by region. They are computed on first use.
    #[serde(skip)]
    coarse: OnceLock<Vec<CoarseRegion>>,
}

impl PartialEq for RegionAtlas {
    fn eq(&self, other: &Self) -> bool {
        self.grid == other.grid && self.regions == other.regions && self.attacks == other.attacks
    }
}

impl RegionAtlas {
    /// Creates an atlas. `attacks` are in the order of
    /// [`BakedGraph::attack_moves`](super::BakedGraph::attack_moves). Each mask has one bit for each slice of
    /// the grid.
    #[must_use]
    #[doc(hidden)]
    pub fn new(grid: MapGrid, regions: Vec<RegionMaps>, attacks: Vec<AttackMaps>) -> Self {
        Self {
            grid,
            regions,
            attacks,
            coarse: OnceLock::new(),
        }
    }

    /// Coarse maps of each region, for rejecting whole blocks of texels.
    pub(crate) fn coarse(&self) -> &[CoarseRegion] {
        let grid = self.grid;
        self.coarse.get_or_init(|| {
            in_parallel(0, self.regions.len(), |region| {
                CoarseRegion::new(&self.regions[region], grid)
            })
        })
    }

    /// Texel size, slab height and time slices of all maps.
    #[must_use]
    pub fn grid(&self) -> MapGrid {
        self.grid
    }

    /// Maps of the evasions, by [`RegionId`].
    #[must_use]
    #[doc(hidden)]
    pub fn regions(&self) -> &[RegionMaps] {
        &self.regions
    }

    /// Maps of one evasion.
    #[must_use]
    #[doc(hidden)]
    pub fn region(&self, region: RegionId) -> &RegionMaps {
        &self.regions[region.index()]
    }

    /// Maps of the attacks, in the order of [`BakedGraph::attack_moves`](super::BakedGraph::attack_moves).
    #[must_use]
    #[doc(hidden)]
    pub fn attacks(&self) -> &[AttackMaps] {
        &self.attacks
    }

    /// Maps of one evasion in one slab, or `None` if the body does not reach that slab.
    #[must_use]
    #[doc(hidden)]
    pub fn maps(&self, region: RegionId, slab: Slab) -> Option<&SlabMaps> {
        let region = self.region(region);
        let index = usize::try_from(slab.0.checked_sub(region.first_slab.0)?).ok()?;
        region.slabs.get(index)
    }

    /// Memory of all evasions' maps, in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let words = |maps: &SlabMaps| {
            maps.body.masks().len() + maps.outer.masks().len() + maps.evasion.words().len()
        };
        let slabs = self.regions.iter().flat_map(|region| &region.slabs);
        4 * slabs.map(words).sum::<usize>()
    }

    /// Checks the grid and the maps after they were read from a file.
    ///
    /// # Errors
    /// A description of the first invalid item.
    pub(super) fn check(&self) -> Result<(), &'static str> {
        if !self.grid.is_sound() {
            return Err("the maps' texels, slabs or slices have no possible size");
        }
        let slices = self.grid.slices;
        let sound = self.regions.iter().all(|region| region.is_sound(slices))
            && self.attacks.iter().all(AttackMaps::is_sound);
        if !sound {
            return Err("a map's words do not fit its rectangle");
        }
        Ok(())
    }

    /// Words of the evasions' maps, one map after the other: of each slab body masks, outer masks, and bits of the evasion map.
    pub(crate) fn words(&self) -> impl Iterator<Item = &[u32]> {
        let slabs = self.regions.iter().flat_map(|region| &region.slabs);
        slabs.flat_map(|slab| [slab.body.masks(), slab.outer.masks(), slab.evasion.words()])
    }

    /// Places of the evasions' maps among [`RegionAtlas::words`].
    #[must_use]
    pub(crate) fn pack(&self) -> PackedAtlas {
        let mut packed = PackedAtlas {
            words: 0,
            maps: Vec::new(),
            lanes: self.grid.lanes() as u32,
            regions: Vec::new(),
        };
        for region in &self.regions {
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
}

/// Position of one map in its frame, and of its data in [`RegionAtlas::words`].
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "vulkan", derive(bytemuck::Pod, bytemuck::Zeroable))]
pub(crate) struct PackedMap {
    /// First column, in texels of the evasion's frame.
    pub u: i32,
    /// First row, in texels of the evasion's frame.
    pub v: i32,
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Index of the map's first word in [`RegionAtlas::words`].
    pub word: u32,
    /// Number of words in a row.
    pub words_per_row: u32,
}

/// Positions of the maps of one region in one slab.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "vulkan", derive(bytemuck::Pod, bytemuck::Zeroable))]
pub(crate) struct PackedMaps {
    /// Body masks, `[row][column][lane]`.
    pub body: PackedMap,
    /// Outer masks, `[row][column][lane]`.
    pub outer: PackedMap,
    /// Evasion map, one bit for each texel. Column 0 is the lowest bit of a row's first word.
    pub evasion: PackedMap,
}

/// Places of the maps of a [`RegionAtlas`] in a buffer that holds their words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct PackedAtlas {
    /// Number of words of all maps.
    pub words: usize,
    /// Positions of the maps, one entry for each region and slab.
    pub maps: Vec<PackedMaps>,
    /// Number of words in a mask: 1 or 2.
    pub lanes: u32,
    /// For each region: its first slab, its first entry in `maps`, and its number of entries.
    regions: Vec<(Slab, u32, u32)>,
}

impl PackedAtlas {
    /// Index in `maps` of a region's slab, or `None` if the region does not have that slab.
    #[must_use]
    #[cfg(feature = "vulkan")]
    pub(crate) fn find(&self, region: RegionId, slab: Slab) -> Option<u32> {
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
