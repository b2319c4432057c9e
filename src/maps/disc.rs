/// Number of sub-texels in a texel: the fixed-point unit of discs. With 16, all products stay below
/// 2³¹ for maps of up to 2,048 texels on a side.
pub const SUB_TEXELS: i32 = 16;

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
    #[must_use]
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
