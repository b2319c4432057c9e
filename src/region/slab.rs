use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

use super::{Disc, SUB_TEXELS};

/// One horizontal height interval, by its number: slab `n` reaches from `n` to `n + 1` slab heights above the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Slab(pub i32);

/// The raster that all maps of one bake share: slabs in height, texels on the ground.
///
/// Texel `(u, v)` covers `u..u+1` texels of x and `v..v+1` texels of z in the frame that the map is drawn in.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapGrid {
    /// Side of a texel, metres. Default 0.02.
    pub texel: f32,
    /// Height of a slab, metres. Default 0.30 (the paper's).
    pub slab_height: f32,
}

impl Default for MapGrid {
    fn default() -> Self {
        Self {
            texel: 0.02,
            slab_height: 0.30,
        }
    }
}

impl MapGrid {
    /// Most texels a side of one map: what fixed-point products of 32 bits allow.
    pub const MAX_SIDE: u32 = 2048;

    /// No slab lies higher above the ground, or further below it.
    pub const HIGHEST_SLAB: i32 = 100_000;

    /// Discs further from the origin are drawn at this distance, sub-texels: it lies far beyond every map, and sums of it fit.
    const FAR: f32 = (1 << 29) as f32;

    /// Whether texels are 0.001 to 1 m and slabs 0.001 to 10 m.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        (0.001..=1.0).contains(&self.texel) && (0.001..=10.0).contains(&self.slab_height)
    }

    /// The slabs that a sphere reaches.
    #[must_use]
    pub fn slabs(&self, centre: Vec3, radius: f32) -> RangeInclusive<i32> {
        let slab_of = |height: f32| (height / self.slab_height).floor() as i32;
        slab_of(centre.y - radius)..=slab_of(centre.y + radius)
    }

    /// The outline of a sphere within a slab, seen from above: the widest of its cross-sections there. `None` where the
    /// sphere does not reach the slab. Coordinates are sub-texels of the map's frame.
    #[must_use]
    pub fn disc(&self, centre: Vec3, radius: f32, slab: Slab) -> Option<Disc> {
        let bottom = slab.0 as f32 * self.slab_height;
        let nearest = centre.y.clamp(bottom, bottom + self.slab_height);
        let squared = radius * radius - (centre.y - nearest).powi(2);
        (squared > 0.0).then(|| {
            let scale = SUB_TEXELS as f32 / self.texel;
            let place = |metres: f32| (metres * scale).round().clamp(-Self::FAR, Self::FAR) as i32;
            Disc::new(place(centre.x), place(centre.z), squared.sqrt() * scale)
        })
    }
}
