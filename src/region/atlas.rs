use serde::{Deserialize, Serialize};

use super::{BitMap, MapGrid, Slab, raster::EvasionMaps};

/// Index of an evasion's maps in a [`RegionAtlas`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct RegionId(pub u32);

impl RegionId {
    /// As a position in per-region arrays.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// The maps of one evasion, slab by slab, in the frame where it starts (root on the ground, facing +Z).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RegionMaps {
    /// Of `slabs[0]`; the others follow upwards.
    pub first_slab: Slab,
    /// One for each slab that the starting posture reaches. Body and evasion map of a slab lie in the same rectangle.
    pub slabs: Vec<EvasionMaps>,
}

impl RegionMaps {
    /// Whether every map's words fit its rectangle and the two maps of a slab lie in one: true of all drawn here, asked of what is
    /// read from a file.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let fits = |maps: &EvasionMaps| {
            let sound = maps.body.is_sound() && maps.evasion.is_sound();
            sound && maps.body.rect() == maps.evasion.rect() && maps.body.rect().fits()
        };
        slabs_fit(self.first_slab, self.slabs.len()) && self.slabs.iter().all(fits)
    }
}

/// The maps of one attack, slab by slab, in the character's frame where it starts (root on the ground, facing +Z): texels
/// that it passes at some time.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AttackMaps {
    /// Of `slabs[0]`; the others follow upwards.
    pub first_slab: Slab,
    /// One for each slab that the attack reaches.
    pub slabs: Vec<BitMap>,
}

impl AttackMaps {
    /// Whether every map's words fit its rectangle: true of all drawn here, asked of what is read from a file.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        slabs_fit(self.first_slab, self.slabs.len())
            && self
                .slabs
                .iter()
                .all(|map| map.is_sound() && map.rect().fits())
    }
}

/// Whether so many slabs from the first one up are all within the slabs that are counted.
fn slabs_fit(first: Slab, count: usize) -> bool {
    let most = i64::from(MapGrid::HIGHEST_SLAB);
    let first = i64::from(first.0);
    (-most..=most).contains(&first) && first + count as i64 <= most
}

/// The maps of all evasions and attacks of a graph, on one grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegionAtlas {
    /// Texel and slab sizes of all maps.
    pub grid: MapGrid,
    /// By [`RegionId`].
    pub regions: Vec<RegionMaps>,
    /// In the order of [`BakedGraph::strikes`](super::BakedGraph::strikes).
    pub attacks: Vec<AttackMaps>,
}

impl RegionAtlas {
    /// The maps of one evasion in one slab; `None` where its starting posture does not reach that slab.
    #[must_use]
    pub fn maps(&self, region: RegionId, slab: Slab) -> Option<&EvasionMaps> {
        let region = &self.regions[region.index()];
        let index = usize::try_from(slab.0.checked_sub(region.first_slab.0)?).ok()?;
        region.slabs.get(index)
    }

    /// The evasions' maps as one array of words, ready for a storage buffer.
    #[must_use]
    pub fn pack(&self) -> PackedAtlas {
        let mut packed = PackedAtlas {
            words: Vec::new(),
            maps: Vec::new(),
            regions: Vec::new(),
        };
        for region in &self.regions {
            packed.regions.push((
                region.first_slab,
                packed.maps.len() as u32,
                region.slabs.len() as u32,
            ));
            for slab in &region.slabs {
                let rect = slab.body.rect();
                let body_word = packed.append(&slab.body);
                let evasion_word = packed.append(&slab.evasion);
                let words_per_row = slab.body.words_per_row() as u32;
                packed.maps.push(PackedMaps {
                    u: rect.u,
                    v: rect.v,
                    width: rect.width,
                    height: rect.height,
                    words_per_row,
                    body_word,
                    evasion_word,
                    padding: 0,
                });
            }
        }
        packed
    }
}

/// Where the body map and the evasion map of one region and slab lie in [`PackedAtlas::words`].
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "vulkan", derive(bytemuck::Pod, bytemuck::Zeroable))]
pub struct PackedMaps {
    /// First column of both, texels of the evasion's frame.
    pub u: i32,
    /// First row of both.
    pub v: i32,
    /// Columns of both.
    pub width: u32,
    /// Rows of both.
    pub height: u32,
    /// Words in a row of either.
    pub words_per_row: u32,
    /// First word of the body map.
    pub body_word: u32,
    /// First word of the evasion map.
    pub evasion_word: u32,
    /// Always 0.
    pub padding: u32,
}

/// A [`RegionAtlas`] laid out for a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PackedAtlas {
    /// The bits of all maps.
    pub words: Vec<u32>,
    /// One for each region and slab.
    pub maps: Vec<PackedMaps>,
    /// For each region: its first slab, its first entry in `maps`, and how many entries it has.
    regions: Vec<(Slab, u32, u32)>,
}

impl PackedAtlas {
    /// Position in `maps` of one region's slab, if it has that slab.
    #[must_use]
    pub fn find(&self, region: RegionId, slab: Slab) -> Option<u32> {
        let (first_slab, first, count) = self.regions[region.index()];
        let index = u32::try_from(slab.0.checked_sub(first_slab.0)?).ok()?;
        (index < count).then_some(first + index)
    }

    fn append(&mut self, map: &BitMap) -> u32 {
        let start = self.words.len() as u32;
        self.words.extend_from_slice(map.words());
        start
    }
}
