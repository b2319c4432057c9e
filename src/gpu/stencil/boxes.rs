//! Vertices and indices of boxes: four corners and two triangles each.

/// Number of corners of a box.
pub(super) const CORNERS: usize = 4;
/// Number of units of a corner's position in one texel.
pub(super) const UNITS: u32 = 4;
/// Maximum side of a target, in texels. Positions in it are 16-bit numbers.
pub(super) const MOST_SIDE: u32 = u16::MAX as u32 / UNITS;
/// Number of indices of a box: two triangles.
pub(super) const INDICES: u32 = 6;
/// Maximum number of boxes in one draw.
pub(super) const BOXES: u32 = 1 << 12;

/// Indices of all boxes of a draw: two triangles for each box.
pub(super) fn indices() -> Vec<u16> {
    let corners = |one: u32| [0, 1, 2, 2, 1, 3].map(|at| (one as usize * CORNERS + at) as u16);
    (0..BOXES).flat_map(corners).collect()
}
