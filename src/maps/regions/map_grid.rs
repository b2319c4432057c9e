//! The grid of all maps: how a sphere becomes a disc of texels in a slab of heights.
//!
//! Source: Masaoka & Oshita, section 4.3. Differs: slabs are thin, and a sphere may be represented by its section at the slab's middle
//! height instead of its outline, so that a shared texel proves a shared point.

use std::ops::RangeInclusive;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::math::{Sphere, floor, round};

/// Number of sub-texels in a texel: the fixed-point unit of discs. With 16, all products stay below
/// 2³¹ for maps of up to 2,048 texels on a side.
pub const SUB_TEXELS: i32 = 16;

/// Half of a texel's diagonal, rounded up, in sub-texels.
pub(crate) const HALF_DIAGONAL: f32 = 0.7072 * SUB_TEXELS as f32;
/// Maximum error of a disc's centre from rounding to sub-texels and from single precision, in
/// sub-texels.
pub(crate) const ROUNDING: f32 = 0.7072 + 0.1;
/// Maximum difference of the time of one moment in two motions, from single precision and from merging keys, in
/// seconds.
pub(crate) const TIME_ERROR: f32 = 3e-5;

/// A filled circle on a map, in sub-texels.
///
/// The disc covers a texel if `dx² + dz² <= radius²` holds in integers, where `dx` and `dz` lead
/// from the disc's centre to the texel's centre. `shaders/disc.vert.glsl` and `disc.frag.glsl` do
/// the same arithmetic.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Disc {
    /// X coordinate of the centre, in sub-texels.
    pub x: i32,
    /// Z coordinate of the centre, in sub-texels.
    pub z: i32,
    /// Radius, in sub-texels.
    pub radius: i32,
}

impl Disc {
    /// Maximum radius, in sub-texels. It reaches across the largest map, and its square still fits
    /// 32 bits.
    pub const MAX_RADIUS: i32 = 32_000;

    /// Creates a disc. `radius` is in sub-texels; it is rounded to the nearest integer and limited
    /// to [`Disc::MAX_RADIUS`].
    #[must_use]
    pub fn new(x: i32, z: i32, radius: f32) -> Self {
        Self {
            x,
            z,
            radius: (radius.round() as i32).min(Self::MAX_RADIUS),
        }
    }

    /// Whether the disc covers the texel `(u, v)`.
    pub fn covers(self, u: i32, v: i32) -> bool {
        let (dx, dz) = (texel_centre(u) - self.x, texel_centre(v) - self.z);
        dx * dx + dz * dz <= self.radius * self.radius
    }

    /// Returns the same disc in a frame whose origin is moved by `(u, v)` texels.
    #[must_use]
    pub fn relative_to(self, u: i32, v: i32) -> Self {
        Self {
            x: self.x - u * SUB_TEXELS,
            z: self.z - v * SUB_TEXELS,
            ..self
        }
    }
}

/// Coordinate of a texel's centre, in sub-texels.
pub(crate) fn texel_centre(texel: i32) -> i32 {
    texel * SUB_TEXELS + SUB_TEXELS / 2
}

/// Number of a horizontal slab. Slab `n` reaches from `n` to `n + 1` slab heights above the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Slab(pub i32);

/// Cross-section that represents a sphere in a slab.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Section {
    /// The widest section within the slab (the outline seen from above), rounded to the nearest
    /// sub-texel, as in the paper. If body and attack share a texel, they may still pass each other
    /// at different heights of the slab.
    Outline,
    /// The section at the slab's middle height, rounded inwards. If body and attack share a texel,
    /// they share a point.
    Plane,
}

/// The grid that all maps of one bake share: texels on the ground, slabs in height and slices in
/// time.
///
/// Texel `(u, v)` covers `u..u+1` texels of x and `v..v+1` texels of z in the frame of the map.
/// Slice `s` is the time from `s` to `s + 1` slice durations after an evasion's start, both ends
/// included.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapGrid {
    /// Side of a texel, in metres. Default 0.02.
    pub texel: f32,
    /// Height of a slab, in metres. Default 0.30, as in the paper. Lower slabs miss fewer hits, but cost more time than they save.
    pub slab_height: f32,
    /// Cross-section that represents a sphere in a slab. Default [`Section::Plane`].
    pub section: Section,
    /// Number of time slices, 1 to 64. Default 8: one stencil bit each. With 1 slice the maps are untimed as in the
    /// paper: they hold the body during the whole evasion, and the attack at all times.
    pub slices: u32,
    /// Duration of a slice, in seconds. Default 2/15. It is unused if there is only one slice.
    pub slice_seconds: f32,
}

impl Default for MapGrid {
    fn default() -> Self {
        Self {
            texel: 0.02,
            slab_height: 0.30,
            section: Section::Plane,
            slices: 8,
            slice_seconds: 2.0 / 15.0,
        }
    }
}

/// How a sphere is cut and rounded. Margins are in sub-texels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Cut {
    /// The grid's section, rounded to the nearest sub-texel.
    Nearest,
    /// The section at the slab's middle height, reduced by the margin and rounded down.
    Inner(f32),
    /// The widest section in the slab, enlarged by the margin and rounded up.
    Outer(f32),
}

impl MapGrid {
    /// Grid of the paper: slabs of 0.30 m, outlines, untimed.
    pub const PAPER: Self = Self {
        texel: 0.02,
        slab_height: 0.30,
        section: Section::Outline,
        slices: 1,
        slice_seconds: 1.0 / 30.0,
    };

    /// Maximum number of texels on a side of a map. Fixed-point products of 32 bits allow no more.
    pub const MAX_SIDE: u32 = 2048;

    /// Maximum number of a slab above or below the ground.
    pub const HIGHEST_SLAB: i32 = 100_000;

    /// Maximum number of slices: the bits of two words.
    pub const MAX_SLICES: u32 = 64;

    /// Maximum coordinate of a disc, in sub-texels. Farther discs are drawn at this distance, which
    /// is far beyond every map; sums of two such coordinates fit 32 bits.
    const FAR: f32 = (1 << 29) as f32;

    /// Whether all values are in range: texels of 0.001 to 1 m, slabs of 0.001 to 10 m, and
    /// 1 to 64 slices of 0.001 to 1 s.
    pub fn is_sound(&self) -> bool {
        (0.001..=1.0).contains(&self.texel)
            && (0.001..=10.0).contains(&self.slab_height)
            && (1..=Self::MAX_SLICES).contains(&self.slices)
            && (0.001..=1.0).contains(&self.slice_seconds)
    }

    /// Whether the maps have more than one time slice.
    pub fn is_timed(&self) -> bool {
        self.slices > 1
    }

    /// Number of words in a texel's mask, which has one bit for each slice: 1 or 2.
    pub fn lanes(&self) -> usize {
        self.slices.div_ceil(32) as usize
    }

    /// Time from an evasion's start to the end of the last slice, in seconds.
    pub fn seconds(&self) -> f32 {
        self.slices as f32 * self.slice_seconds
    }

    /// Whether a texel that body and attack share guarantees a hit. This holds if the sections of
    /// both are rounded inwards.
    pub fn is_certain(&self) -> bool {
        self.is_timed() && self.section == Section::Plane
    }

    /// Slabs that a sphere reaches.
    pub fn slabs(&self, centre: Vec3, radius: f32) -> RangeInclusive<i32> {
        let slab_of = |height: f32| floor(height / self.slab_height);
        slab_of(centre.y - radius)..=slab_of(centre.y + radius)
    }

    /// Section of a sphere in a slab, seen from above, in sub-texels of the map's frame, rounded to
    /// the nearest. Returns `None` if the sphere does not reach the section's height.
    pub fn disc(&self, centre: Vec3, radius: f32, slab: Slab) -> Option<Disc> {
        self.cut(Sphere::new(centre, radius), slab, Cut::Nearest)
    }

    /// Disc of a sphere in a slab, cut and rounded according to `cut`.
    pub(crate) fn cut(&self, sphere: Sphere, slab: Slab, cut: Cut) -> Option<Disc> {
        let Sphere { centre, radius } = sphere;
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
