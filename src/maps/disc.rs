/// Sub-texels in a texel: the fixed-point unit of discs. With 16, maps of up to 2,048 texels a side
/// keep every product below 2³¹.
pub const SUB_TEXELS: i32 = 16;

/// A filled circle on a map, in sub-texels.
///
/// It covers a texel when the texel's centre is not further from its own than its radius: `dx² +
/// dz² <= radius²`, in integers. `shaders/disc.vert.glsl` and `disc.frag.glsl` do the same
/// arithmetic.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Disc {
    /// Centre, sub-texels.
    pub x: i32,
    /// Centre, sub-texels.
    pub z: i32,
    /// Radius, sub-texels.
    pub radius: i32,
}

impl Disc {
    /// Largest radius, sub-texels: it reaches across the largest map, and the squares of its sides
    /// still fit.
    pub const MAX_RADIUS: i32 = 32_000;

    /// A disc of a radius in sub-texels, rounded to the nearest whole one, at most
    /// [`Disc::MAX_RADIUS`].
    #[must_use]
    pub fn new(x: i32, z: i32, radius: f32) -> Self {
        Self {
            x,
            z,
            radius: (radius.round() as i32).min(Self::MAX_RADIUS),
        }
    }

    /// Whether it covers the texel `(u, v)`.
    #[must_use]
    pub fn covers(self, u: i32, v: i32) -> bool {
        let (dx, dz) = (texel_centre(u) - self.x, texel_centre(v) - self.z);
        dx * dx + dz * dz <= self.radius * self.radius
    }

    /// The same disc on a map whose origin lies `(u, v)` texels further.
    #[must_use]
    pub fn relative_to(self, u: i32, v: i32) -> Self {
        Self {
            x: self.x - u * SUB_TEXELS,
            z: self.z - v * SUB_TEXELS,
            ..self
        }
    }
}

/// Centre of a texel, sub-texels.
pub(crate) fn texel_centre(texel: i32) -> i32 {
    texel * SUB_TEXELS + SUB_TEXELS / 2
}
