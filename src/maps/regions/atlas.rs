//! The maps of all evasions and attacks of a graph.

use std::sync::OnceLock;

use serde::{Deserialize, Serialize};

use super::coarse::CoarseRegion;
use super::events::RegionId;
use super::map_grid::{MapGrid, Slab};
use super::region_maps::{AttackMaps, RegionMaps, SlabMaps};
use crate::math::in_parallel;

/// The maps of all evasions and attacks of a graph, on one grid.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RegionAtlas {
    grid: MapGrid,
    regions: Vec<RegionMaps>,
    attacks: Vec<AttackMaps>,
    /// Coarse maps of each region, computed on first use.
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
    /// [`BakedGraph::attack_moves`](crate::maps::BakedGraph::attack_moves). Each mask has one bit for each slice of
    /// the grid.
    #[must_use]
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
    pub fn grid(&self) -> MapGrid {
        self.grid
    }

    /// Maps of the evasions, by [`RegionId`].
    pub fn regions(&self) -> &[RegionMaps] {
        &self.regions
    }

    /// Maps of one evasion.
    pub fn region(&self, region: RegionId) -> &RegionMaps {
        &self.regions[region.index()]
    }

    /// Maps of the attacks, in the order of [`BakedGraph::attack_moves`](crate::maps::BakedGraph::attack_moves).
    pub fn attacks(&self) -> &[AttackMaps] {
        &self.attacks
    }

    /// Maps of one evasion in one slab, or `None` if the body does not reach that slab.
    pub fn maps(&self, region: RegionId, slab: Slab) -> Option<&SlabMaps> {
        let region = self.region(region);
        let index = usize::try_from(slab.0.checked_sub(region.first_slab.0)?).ok()?;
        region.slabs.get(index)
    }

    /// Memory of all evasions' maps, in bytes.
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
    pub(in crate::maps) fn check(&self) -> Result<(), &'static str> {
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
}
