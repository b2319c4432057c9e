use super::SUB_TEXELS;
use crate::math::Rigid2;

/// Takes the texels of one map to those of another that is moved and turned against it, in fixed
/// point.
///
/// For the centre of texel `(u, v)` of the first map, `a (2u + 1) + b (2v + 1) + tx` and `a (2v +
/// 1) - b (2u + 1) + tz` are its place in the second map's frame in units of 2⁻¹⁵ texel; shifted
/// right by [`MapTurn::SHIFT`] (towards −∞) they name the texel that it falls into. The device does
/// the same in `shaders/candidate.frag.glsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapTurn {
    /// cos · 2¹⁴.
    pub a: i32,
    /// sin · 2¹⁴.
    pub b: i32,
    /// Translation along x, 2⁻¹⁵ texel.
    pub tx: i32,
    /// Translation along z, 2⁻¹⁵ texel.
    pub tz: i32,
}

impl MapTurn {
    /// Bits behind the point.
    pub const SHIFT: u32 = 15;
    /// Further than this many texels from the origin no place is kept: the two maps cannot meet
    /// there. It leaves room for maps of 2,048 texels.
    const FAR: f32 = 32_000.0;

    /// From texels `(u, v)` counted from `origin` (columns, rows, in the first frame's texels) to
    /// the second frame, where `placement` takes points of the first frame to the second. `texel`
    /// in metres.
    #[must_use]
    pub fn new(placement: Rigid2, origin: (i32, i32), texel: f32) -> Self {
        let one = (1i32 << (Self::SHIFT - 1)) as f32;
        // Rounded once, so that the first texel's place is as exact as the last one's.
        let start = placement.point(glam::Vec3::new(
            origin.0 as f32 * texel,
            0.0,
            origin.1 as f32 * texel,
        )) / texel;
        let fixed = |place: f32| (place.clamp(-Self::FAR, Self::FAR) * 2.0 * one).round() as i32;
        Self {
            a: (placement.cos() * one).round() as i32,
            b: (placement.sin() * one).round() as i32,
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

    /// Most that the centre of a texel of a map with these sides is taken beside its place,
    /// sub-texels: the roundings of cosine, sine and translation.
    #[must_use]
    pub fn error(width: u32, height: u32) -> f32 {
        let texels = (width + height + 1) as f32 / (1 << Self::SHIFT) as f32;
        texels * SUB_TEXELS as f32
    }

    /// Whether `placement` leads to a place that is kept as it is.
    #[must_use]
    pub(crate) fn keeps(placement: Rigid2, texel: f32) -> bool {
        placement.ground().abs().max_element() < 0.5 * Self::FAR * texel
    }
}
