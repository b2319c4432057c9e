//! Vertices and indices of boxes: four corners and two triangles each.

/// Number of corners of a box.
pub(super) const CORNERS: usize = 4;
/// Units of a corner's place in a texel.
pub(super) const UNITS: u32 = 4;
/// Largest side of a target, in texels: places in it are numbers of 16 bits.
pub(super) const MOST_SIDE: u32 = u16::MAX as u32 / UNITS;
/// Number of indices of a box: two triangles.
pub(super) const INDICES: u32 = 6;
/// Maximum number of boxes in one draw.
pub(super) const BOXES: u32 = 1 << 12;

/// Maximum number of corners in one draw.
pub(super) fn indices() -> Vec<u16> {
    let corners = |one: u32| [0, 1, 2, 2, 1, 3].map(|at| (one as usize * CORNERS + at) as u16);
    (0..BOXES).flat_map(corners).collect()
}
