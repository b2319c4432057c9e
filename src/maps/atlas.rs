use std::sync::OnceLock;

use serde::{Deserialize, Serialize};

use super::near::NearRegion;
use super::{BitMap, MapGrid, MapRect, MaskMap, Slab};

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

/// The maps of an evasion in one slab, each in its own tight rectangle.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SlabMaps {
    /// For each slice, texels that the body covers all through it.
    pub body: MaskMap,
    /// For each slice, texels that the body may touch in it at any height of the slab.
    pub outer: MaskMap,
    /// Texels that the body covers at the start and not all through the evasion.
    pub evasion: BitMap,
}

impl SlabMaps {
    /// Three maps without a texel.
    #[must_use]
    pub fn empty(lanes: usize) -> Self {
        let masks = MaskMap::new(MapRect::default(), lanes);
        Self {
            body: masks.clone(),
            outer: masks,
            evasion: BitMap::default(),
        }
    }

    /// The rectangle around all three maps.
    #[must_use]
    pub fn rect(&self) -> MapRect {
        let rects = [self.body.rect(), self.outer.rect(), self.evasion.rect()];
        rects.into_iter().fold(MapRect::default(), MapRect::union)
    }

    fn is_sound(&self, slices: u32) -> bool {
        self.body.is_sound(slices)
            && self.outer.is_sound(slices)
            && self.evasion.is_sound()
            && [self.body.rect(), self.outer.rect(), self.evasion.rect()]
                .into_iter()
                .all(MapRect::fits)
    }
}

/// The maps of one evasion, slab by slab, in the frame where it starts (root on the ground, facing
/// +Z).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegionMaps {
    /// Of `slabs[0]`; the others follow upwards.
    pub first_slab: Slab,
    /// One for each slab that the body reaches.
    pub slabs: Vec<SlabMaps>,
    /// How long after the evasion's start the outer maps know where the body is, seconds.
    pub seconds: f32,
}

impl RegionMaps {
    /// Longest time that maps cover, seconds: of a file that says more something is wrong.
    const LONGEST: f32 = 3600.0;

    /// Whether every map's words fit its rectangle and so many slices: true of all drawn here, asked
    /// of what is read from a file.
    #[must_use]
    pub fn is_sound(&self, slices: u32) -> bool {
        slabs_fit(self.first_slab, self.slabs.len())
            && (0.0..=Self::LONGEST).contains(&self.seconds)
            && self.slabs.iter().all(|slab| slab.is_sound(slices))
    }
}

/// The maps of one attack, slab by slab, in the character's frame where it starts (root on the
/// ground, facing +Z): texels that its outline passes at some time.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AttackMaps {
    /// Of `slabs[0]`; the others follow upwards.
    pub first_slab: Slab,
    /// One for each slab that the attack reaches.
    pub slabs: Vec<BitMap>,
}

impl AttackMaps {
    /// Whether every map's words fit its rectangle: true of all drawn here, asked of what is read
    /// from a file.
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
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RegionAtlas {
    grid: MapGrid,
    regions: Vec<RegionMaps>,
    attacks: Vec<AttackMaps>,
    /// By region, made when they are first asked for.
    #[serde(skip)]
    near: OnceLock<Vec<NearRegion>>,
}

impl PartialEq for RegionAtlas {
    fn eq(&self, other: &Self) -> bool {
        self.grid == other.grid && self.regions == other.regions && self.attacks == other.attacks
    }
}

impl RegionAtlas {
    /// An atlas of these maps; `attacks` in the order of
    /// [`BakedGraph::strikes`](super::BakedGraph::strikes). Masks have as many bits as the grid has
    /// slices.
    #[must_use]
    pub fn new(grid: MapGrid, regions: Vec<RegionMaps>, attacks: Vec<AttackMaps>) -> Self {
        Self {
            grid,
            regions,
            attacks,
            near: OnceLock::new(),
        }
    }

    /// For each region, in short, what its maps hold.
    pub(crate) fn near(&self) -> &[NearRegion] {
        let grid = self.grid;
        self.near.get_or_init(|| {
            let regions = self.regions.iter();
            regions
                .map(|region| NearRegion::new(region, grid))
                .collect()
        })
    }

    /// Sizes of texels, slabs and slices of all maps.
    #[must_use]
    pub fn grid(&self) -> MapGrid {
        self.grid
    }

    /// The evasions' maps, by [`RegionId`].
    #[must_use]
    pub fn regions(&self) -> &[RegionMaps] {
        &self.regions
    }

    /// One evasion's maps.
    #[must_use]
    pub fn region(&self, region: RegionId) -> &RegionMaps {
        &self.regions[region.index()]
    }

    /// The attacks' maps, in the order of [`BakedGraph::strikes`](super::BakedGraph::strikes).
    #[must_use]
    pub fn attacks(&self) -> &[AttackMaps] {
        &self.attacks
    }

    /// The maps of one evasion in one slab; `None` where the body does not reach that slab.
    #[must_use]
    pub fn maps(&self, region: RegionId, slab: Slab) -> Option<&SlabMaps> {
        let region = self.region(region);
        let index = usize::try_from(slab.0.checked_sub(region.first_slab.0)?).ok()?;
        region.slabs.get(index)
    }

    /// Bytes of all evasions' maps.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let words = |maps: &SlabMaps| {
            maps.body.masks().len() + maps.outer.masks().len() + maps.evasion.words().len()
        };
        let slabs = self.regions.iter().flat_map(|region| &region.slabs);
        4 * slabs.map(words).sum::<usize>()
    }

    /// Whether grid and maps are sound: asked of what is read from a file.
    ///
    /// # Errors
    /// What is wrong, in words.
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

    /// The evasions' maps as one array of words, ready for a storage buffer.
    #[must_use]
    pub fn pack(&self) -> PackedAtlas {
        let mut packed = PackedAtlas {
            words: Vec::with_capacity(self.bytes() / 4),
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

/// Where one map lies: in its frame, and in [`PackedAtlas::words`].
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "vulkan", derive(bytemuck::Pod, bytemuck::Zeroable))]
pub struct PackedMap {
    /// First column, texels of the evasion's frame.
    pub u: i32,
    /// First row.
    pub v: i32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Its first word.
    pub word: u32,
    /// Words in a row.
    pub words_per_row: u32,
}

/// Where the maps of one region and slab lie.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "vulkan", derive(bytemuck::Pod, bytemuck::Zeroable))]
pub struct PackedMaps {
    /// Masks `[row][column][lane]`.
    pub body: PackedMap,
    /// Masks `[row][column][lane]`.
    pub outer: PackedMap,
    /// A bit a texel; column 0 is the lowest bit of a row's first word.
    pub evasion: PackedMap,
}

/// A [`RegionAtlas`] laid out for a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PackedAtlas {
    /// The masks and bits of all maps.
    pub words: Vec<u32>,
    /// One for each region and slab.
    pub maps: Vec<PackedMaps>,
    /// Words of a mask: 1 or 2.
    pub lanes: u32,
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

    /// `words_per_row` is 0 for masks, whose rows are not padded.
    fn append(&mut self, rect: MapRect, words: &[u32], words_per_row: u32) -> PackedMap {
        let word = self.words.len() as u32;
        self.words.extend_from_slice(words);
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
