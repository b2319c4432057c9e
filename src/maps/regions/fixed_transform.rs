//! Moves texels from one map to another in fixed point, so that all culling paths agree to the bit.

use glam::Vec3;

use super::bit_map::MapRect;
use super::map_grid::{MapGrid, SUB_TEXELS};
use crate::math::Rigid2;

/// A fixed-point transform from the texels of an attack's map to those of an evasion's map that is
/// translated and rotated against it.
///
/// For the centre of texel `(u, v)` of the attack's map, `a (2u + 1) + b (2v + 1) + tx` and `a (2v
/// + 1) - b (2u + 1) + tz` are its coordinates in the evasion's frame, in units of 2⁻¹⁵ texel. An
/// arithmetic shift right by [`FixedTransform2::SHIFT`] gives the texel that contains it.
/// `shaders/candidate.frag.glsl` does the same arithmetic.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FixedTransform2 {
    /// Cosine of the rotation, in units of 2⁻¹⁴.
    pub a: i32,
    /// Sine of the rotation, in units of 2⁻¹⁴.
    pub b: i32,
    /// Translation along x, in units of 2⁻¹⁵ texel of the evasion's map.
    pub tx: i32,
    /// Translation along z, in units of 2⁻¹⁵ texel of the evasion's map.
    pub tz: i32,
}

impl FixedTransform2 {
    /// Number of fractional bits.
    pub const SHIFT: u32 = 15;
    /// Maximum coordinate, in texels. Coordinates are clamped to it, because maps cannot meet so
    /// far from the origin. It leaves space for maps of 2,048 texels.
    const FAR: f32 = 32_000.0;

    /// Creates the transform for `placement`, which transforms points of the attack's frame to the
    /// evasion's frame. `attack` is the rectangle of the attack's map, in texels of the attack's
    /// frame.
    #[must_use]
    pub fn new(placement: Rigid2, attack: MapRect, grid: MapGrid) -> Self {
        let one = (1i32 << (Self::SHIFT - 1)) as f32;
        // Rounded once, so that the error does not grow with the distance from the first texel.
        let start = placement.point(Vec3::new(
            attack.u as f32 * grid.texel,
            0.0,
            attack.v as f32 * grid.texel,
        )) / grid.texel;
        let fixed = |place: f32| (place.clamp(-Self::FAR, Self::FAR) * 2.0 * one).round() as i32;
        Self {
            a: (placement.cos() * one).round() as i32,
            b: (placement.sin() * one).round() as i32,
            tx: fixed(start.x),
            tz: fixed(start.z),
        }
    }

    /// Texel of the evasion's frame that contains the centre of texel `(u, v)` of the attack's map.
    #[inline(always)]
    pub fn texel(self, u: i32, v: i32) -> (i32, i32) {
        self.half_texels(2 * u + 1, 2 * v + 1)
    }

    /// Texel of the evasion's frame that contains a point of the attack's map, which is given in
    /// half texels.
    #[inline(always)]
    pub(crate) fn half_texels(self, cu: i32, cv: i32) -> (i32, i32) {
        let (x, z) = self.start(cu, cv);
        (x >> Self::SHIFT, z >> Self::SHIFT)
    }

    /// Fixed-point coordinates of a point of the attack's map, which is given in half texels.
    #[inline(always)]
    pub(crate) fn start(self, cu: i32, cv: i32) -> (i32, i32) {
        (
            self.a * cu + self.b * cv + self.tx,
            self.a * cv - self.b * cu + self.tz,
        )
    }

    /// Maximum error of a transformed texel centre for an attack map of this size, in sub-texels of
    /// that map. It comes from rounding the cosine, the sine and the translation.
    pub fn error(width: u32, height: u32) -> f32 {
        let texels = (width + height + 1) as f32 / (1 << Self::SHIFT) as f32;
        texels * SUB_TEXELS as f32
    }

    /// Whether `placement` lies within the range that is not clamped.
    pub(crate) fn keeps(placement: Rigid2, texel: f32) -> bool {
        placement.ground().abs().max_element() < 0.5 * Self::FAR * texel
    }
}

impl MapGrid {
    /// Smallest rectangle of attack texels around an evasion's rectangle that is transformed by
    /// `placement`. An empty rectangle stays empty.
    pub(crate) fn transformed_rect(self, rect: MapRect, placement: Rigid2) -> MapRect {
        if rect.is_empty() {
            return rect;
        }
        let [end_u, end_v] = rect.end();
        let corners = [
            (rect.u, rect.v),
            (rect.u, end_v),
            (end_u, rect.v),
            (end_u, end_v),
        ];
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for (u, v) in corners {
            let corner =
                placement.point(Vec3::new(u as f32, 0.0, v as f32) * self.texel) / self.texel;
            low = low.min(corner);
            high = high.max(corner);
        }
        // Farther than every map, and small enough for 32-bit sub-texels.
        const FAR: f32 = (1 << 24) as f32;
        let near = |texels: f32| texels.clamp(-FAR, FAR) as i32;
        // One texel on every side for rounding errors.
        MapRect::between(
            [near(low.x.floor()) - 1, near(low.z.floor()) - 1],
            [near(high.x.ceil()) + 1, near(high.z.ceil()) + 1],
        )
    }
}
