use glam::Vec3;

use super::{MapGrid, MapRect, SUB_TEXELS};
use crate::math::Rigid2;

/// Takes the texels of an attack's map to those of an evasion's that is moved and turned against it, in
/// fixed point. The first one's may be wider ([`MapGrid::attack_pitch`]).
///
/// For the centre of texel `(u, v)` of the first map, `a (2u + 1) + b (2v + 1) + tx` and `a (2v +
/// 1) - b (2u + 1) + tz` are its place in the second map's frame in units of 2⁻¹⁵ texel; shifted
/// right by [`MapTurn::SHIFT`] (towards −∞) they name the texel that it falls into. The device does
/// the same in `shaders/candidate.frag.glsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapTurn {
    /// cos · 2¹⁴, times the pitch.
    pub a: i32,
    /// sin · 2¹⁴, times the pitch.
    pub b: i32,
    /// Translation along x, 2⁻¹⁵ texel of the second map.
    pub tx: i32,
    /// Translation along z, 2⁻¹⁵ texel of the second map.
    pub tz: i32,
}

impl MapTurn {
    /// Bits behind the point.
    pub const SHIFT: u32 = 15;
    /// Further than this many texels from the origin no place is kept: the two maps cannot meet
    /// there. It leaves room for maps of 2,048 texels.
    const FAR: f32 = 32_000.0;

    /// From texels `(u, v)` counted from `origin` (columns, rows, in the first frame's texels) to
    /// the second frame, where `placement` takes points of the first frame to the second.
    #[must_use]
    pub fn new(placement: Rigid2, origin: (i32, i32), grid: MapGrid) -> Self {
        let (texel, pitch) = (grid.of_attacks().texel, grid.attack_pitch as i32);
        let one = (1i32 << (Self::SHIFT - 1)) as f32;
        // Rounded once, so that the first texel's place is as exact as the last one's.
        let start = placement.point(Vec3::new(
            origin.0 as f32 * texel,
            0.0,
            origin.1 as f32 * texel,
        )) / grid.texel;
        let fixed = |place: f32| (place.clamp(-Self::FAR, Self::FAR) * 2.0 * one).round() as i32;
        Self {
            a: pitch * (placement.cos() * one).round() as i32,
            b: pitch * (placement.sin() * one).round() as i32,
            tx: fixed(start.x),
            tz: fixed(start.z),
        }
    }

    /// The texel of the second frame that the centre of texel `(u, v)` of the first map falls into.
    #[must_use]
    #[inline(always)]
    pub fn texel(self, u: i32, v: i32) -> (i32, i32) {
        self.half_texels(2 * u + 1, 2 * v + 1)
    }

    /// The texel of the second frame that a place of the first map falls into, in halves of texels.
    #[must_use]
    #[inline(always)]
    pub(crate) fn half_texels(self, cu: i32, cv: i32) -> (i32, i32) {
        let (x, z) = self.start(cu, cv);
        (x >> Self::SHIFT, z >> Self::SHIFT)
    }

    /// The same place in fixed point.
    #[must_use]
    #[inline(always)]
    pub(crate) fn start(self, cu: i32, cv: i32) -> (i32, i32) {
        (
            self.a * cu + self.b * cv + self.tx,
            self.a * cv - self.b * cu + self.tz,
        )
    }

    /// Most that the centre of a texel of an attack's map with these sides is taken beside its place,
    /// sub-texels of that map: the roundings of cosine, sine and translation.
    #[must_use]
    pub fn error(width: u32, height: u32) -> f32 {
        let texels = (width + height + 1) as f32 / (1 << Self::SHIFT) as f32;
        texels * SUB_TEXELS as f32
    }

    /// The same turn for an attack's texels that are as wide as the evasion's, where the first of every `pitch` in
    /// either axis stands for a wide one: to the bit, it leads to the same places.
    #[cfg(feature = "vulkan")]
    #[must_use]
    pub(crate) fn of_narrow(self, pitch: u32) -> Self {
        let pitch = pitch as i32;
        let (a, b) = (self.a / pitch, self.b / pitch);
        Self {
            a,
            b,
            tx: self.tx + (pitch - 1) * (a + b),
            tz: self.tz + (pitch - 1) * (a - b),
        }
    }

    /// Whether `placement` leads to a place that is kept as it is.
    #[must_use]
    pub(crate) fn keeps(placement: Rigid2, texel: f32) -> bool {
        placement.ground().abs().max_element() < 0.5 * Self::FAR * texel
    }
}

impl MapGrid {
    /// The rectangle of the attack's texels around one of an evasion's that is moved and turned; empty around an empty one.
    pub(crate) fn around_turned(self, rect: MapRect, placement: Rigid2) -> MapRect {
        if rect.is_empty() {
            return rect;
        }
        let (u, v) = (
            [rect.u, rect.u + rect.width as i32],
            [rect.v, rect.v + rect.height as i32],
        );
        let corners = u.iter().flat_map(|&u| {
            v.iter()
                .map(move |&v| Vec3::new(u as f32, 0.0, v as f32) * self.texel)
        });
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let texel = self.of_attacks().texel;
        for corner in corners.map(|corner| placement.point(corner) / texel) {
            low = low.min(corner);
            high = high.max(corner);
        }
        // Further away than any map is looked at, and near enough for whole numbers of sub-texels.
        const FAR: f32 = (1 << 24) as f32;
        let near = |texels: f32| texels.clamp(-FAR, FAR) as i32;
        // A texel on every side for rounding.
        let (first_u, first_v) = (near(low.x.floor()) - 1, near(low.z.floor()) - 1);
        let (end_u, end_v) = (near(high.x.ceil()) + 1, near(high.z.ceil()) + 1);
        MapRect {
            u: first_u,
            v: first_v,
            width: (end_u - first_u) as u32,
            height: (end_v - first_v) as u32,
        }
    }
}
