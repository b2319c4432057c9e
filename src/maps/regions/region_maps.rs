//! The maps of one evasion and of one attack, slab by slab.

use serde::{Deserialize, Serialize};

use super::bit_map::{BitMap, MapRect};
use super::map_grid::{MapGrid, Slab};
use super::mask_map::MaskMap;

/// The maps of an evasion in one slab, each in its own tight rectangle.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SlabMaps {
    /// For each slice, the texels that the body covers during the whole slice.
    pub body: MaskMap,
    /// For each slice, the texels that the body may touch during the slice, at any height within
    /// the slab.
    pub outer: MaskMap,
    /// The texels that the body covers at the evasion's start but not during the whole evasion.
    pub evasion: BitMap,
}

impl SlabMaps {
    /// Creates three maps without texels. `lanes` is the number of 32-bit words in a mask.
    #[must_use]
    pub fn empty(lanes: usize) -> Self {
        let masks = MaskMap::new(MapRect::default(), lanes);
        Self {
            body: masks.clone(),
            outer: masks,
            evasion: BitMap::default(),
        }
    }

    /// Smallest rectangle that contains all three maps.
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
    /// Slab of `slabs[0]`. The other slabs follow upwards without gaps.
    pub first_slab: Slab,
    /// Maps of each slab that the body reaches, from the lowest slab to the highest.
    pub slabs: Vec<SlabMaps>,
    /// Time after the evasion's start that the outer maps cover, in seconds.
    pub seconds: f32,
}

impl RegionMaps {
    /// Longest time that maps may cover, in seconds. Files that claim more are refused.
    const LONGEST: f32 = 3600.0;

    /// Whether each map's data fits its rectangle and the number of slices. Maps that are drawn
    /// here always pass; maps that come from a file are checked.
    pub fn is_sound(&self, slices: u32) -> bool {
        slabs_fit(self.first_slab, self.slabs.len())
            && (0.0..=Self::LONGEST).contains(&self.seconds)
            && self.slabs.iter().all(|slab| slab.is_sound(slices))
    }
}

/// The maps of one attack, slab by slab, in the character's frame at the attack's start (root on
/// the ground, facing +Z). A texel is set if the attack's outline passes it at any time.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AttackMaps {
    /// Slab of `slabs[0]`. The other slabs follow upwards without gaps.
    pub first_slab: Slab,
    /// Map of each slab that the attack reaches, from the lowest slab to the highest.
    pub slabs: Vec<BitMap>,
}

impl AttackMaps {
    /// Whether each map's data fits its rectangle. Maps that are drawn here always pass; maps that
    /// come from a file are checked.
    pub fn is_sound(&self) -> bool {
        slabs_fit(self.first_slab, self.slabs.len())
            && self
                .slabs
                .iter()
                .all(|map| map.is_sound() && map.rect().fits())
    }
}

/// Whether `count` slabs from `first` upwards lie within the range of slab numbers.
fn slabs_fit(first: Slab, count: usize) -> bool {
    let most = i64::from(MapGrid::HIGHEST_SLAB);
    let first = i64::from(first.0);
    (-most..=most).contains(&first) && first + count as i64 <= most
}
