use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

use super::{Disc, SUB_TEXELS};
use crate::math::{floor, round};

/// One horizontal height interval, by its number: slab `n` reaches from `n` to `n + 1` slab heights
/// above the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Slab(pub i32);

/// Which cross-section of a sphere stands for it in a slab.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Section {
    /// The widest one within the slab, its outline from above, rounded to the nearest: the paper's.
    /// Body and attack that share a texel need not meet: they may pass at different heights of the
    /// slab.
    Outline,
    /// The one at the slab's middle height, rounded inwards: where body and attack share a texel,
    /// they share a point.
    Plane,
}

/// The raster that all maps of one bake share: slabs in height, texels on the ground, slices of
/// time.
///
/// Texel `(u, v)` covers `u..u+1` texels of x and `v..v+1` texels of z in the frame that the map is
/// drawn in. Slice `s` is the time from `s` to `s + 1` slice lengths, both included, after an
/// evasion's start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapGrid {
    /// Side of a texel, metres. Default 0.02.
    pub texel: f32,
    /// From one texel of an attack's maps to the next, texels of an evasion's: 1, 2 or 4. Default 1. An inner map
    /// loses half a texel all around, which is much of an arm; an attack's loses nothing by wide texels but
    /// places that are looked at, and drawing those costs the most: with texels of 7.5 mm and a pitch of 2 the
    /// maps let pass a third fewer hits, for a tenth more time on the CPU and seven times the memory.
    pub attack_pitch: u32,
    /// Height of a slab, metres. Default 0.05.
    pub slab_height: f32,
    /// What of a sphere is drawn in a slab. Default [`Section::Plane`].
    pub section: Section,
    /// How many slices of time, 1 to 64. Default 32. With 1 the maps are untimed, as the paper's
    /// are: the body all through the evasion itself, and the attack whenever it passes.
    pub slices: u32,
    /// How long a slice is, seconds. Default 1/30. Without meaning where there is one slice only.
    pub slice_seconds: f32,
}

impl Default for MapGrid {
    fn default() -> Self {
        Self {
            texel: 0.02,
            attack_pitch: 1,
            slab_height: 0.05,
            section: Section::Plane,
            slices: 32,
            slice_seconds: 1.0 / 30.0,
        }
    }
}

/// How a sphere is cut and rounded, with margins in sub-texels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Cut {
    /// By the grid's section, rounded to the nearest.
    Nearest,
    /// The section at the slab's middle height, made smaller by the margin and rounded down.
    Inner(f32),
    /// The widest section in the slab, made larger by the margin and rounded up.
    Outer(f32),
}

impl MapGrid {
    /// The paper's maps: slabs of 0.30 m, outlines, no time.
    pub const PAPER: Self = Self {
        texel: 0.02,
        attack_pitch: 1,
        slab_height: 0.30,
        section: Section::Outline,
        slices: 1,
        slice_seconds: 1.0 / 30.0,
    };

    /// Most texels a side of one map: what fixed-point products of 32 bits allow.
    pub const MAX_SIDE: u32 = 2048;

    /// No slab lies higher above the ground, or further below it.
    pub const HIGHEST_SLAB: i32 = 100_000;

    /// Most slices: the bits of two words.
    pub const MAX_SLICES: u32 = 64;

    /// Discs further from the origin are drawn at this distance, sub-texels: it lies far beyond
    /// every map, and sums of it fit.
    const FAR: f32 = (1 << 29) as f32;

    /// Widest pitch of an attack's texels.
    pub const MAX_PITCH: u32 = 4;

    /// The raster that attacks are drawn on.
    #[must_use]
    pub fn of_attacks(&self) -> Self {
        Self {
            texel: self.texel * self.attack_pitch as f32,
            attack_pitch: 1,
            ..*self
        }
    }

    /// Whether texels are 0.001 to 1 m and those of attacks 1, 2 or 4 of them, slabs 0.001 to 10 m, and slices 1 to 64 of 0.001 to 1 s.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        (0.001..=1.0).contains(&self.texel)
            && self.attack_pitch.is_power_of_two()
            && self.attack_pitch <= Self::MAX_PITCH
            && (0.001..=10.0).contains(&self.slab_height)
            && (1..=Self::MAX_SLICES).contains(&self.slices)
            && (0.001..=1.0).contains(&self.slice_seconds)
    }

    /// Whether maps know of time: of more than one slice.
    #[must_use]
    pub fn is_timed(&self) -> bool {
        self.slices > 1
    }

    /// Words of a texel's mask, which has a bit for each slice: 1 or 2.
    #[must_use]
    pub fn lanes(&self) -> usize {
        self.slices.div_ceil(32) as usize
    }

    /// Seconds from an evasion's start to the end of the last slice.
    #[must_use]
    pub fn seconds(&self) -> f32 {
        self.slices as f32 * self.slice_seconds
    }

    /// Whether sections of body and attack are rounded inwards, so that what they share is met for
    /// certain.
    #[must_use]
    pub fn is_certain(&self) -> bool {
        self.is_timed() && self.section == Section::Plane
    }

    /// The slabs that a sphere reaches.
    #[must_use]
    pub fn slabs(&self, centre: Vec3, radius: f32) -> RangeInclusive<i32> {
        let slab_of = |height: f32| floor(height / self.slab_height);
        slab_of(centre.y - radius)..=slab_of(centre.y + radius)
    }

    /// The section of a sphere in a slab, seen from above and rounded to the nearest. `None` where
    /// the sphere does not reach the section's height. Coordinates are sub-texels of the map's
    /// frame.
    #[must_use]
    pub fn disc(&self, centre: Vec3, radius: f32, slab: Slab) -> Option<Disc> {
        self.cut((centre, radius), slab, Cut::Nearest)
    }

    /// A sphere's disc in a slab, cut and rounded as asked for.
    #[must_use]
    pub(crate) fn cut(&self, (centre, radius): (Vec3, f32), slab: Slab, cut: Cut) -> Option<Disc> {
        let section = match cut {
            Cut::Nearest => self.section,
            Cut::Inner(_) => Section::Plane,
            Cut::Outer(_) => Section::Outline,
        };
        let bottom = slab.0 as f32 * self.slab_height;
        let height = match section {
            Section::Outline => centre.y.clamp(bottom, bottom + self.slab_height),
            Section::Plane => bottom + 0.5 * self.slab_height,
        };
        let squared = radius * radius - (centre.y - height).powi(2);
        if radius <= 0.0 || squared <= 0.0 {
            return None;
        }
        let scale = SUB_TEXELS as f32 / self.texel;
        let place = |metres: f32| round((metres * scale).clamp(-Self::FAR, Self::FAR));
        let exact = squared.sqrt() * scale;
        let radius = match cut {
            Cut::Nearest => exact,
            Cut::Inner(margin) => (exact - margin).floor(),
            Cut::Outer(margin) => (exact + margin).ceil(),
        };
        (radius >= 0.0).then(|| Disc::new(place(centre.x), place(centre.z), radius))
    }
}
