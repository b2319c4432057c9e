//! Boxes as the device draws them: four corners and two triangles each.

/// Corners of a box.
pub(super) const CORNERS: usize = 4;
/// Indices of a box: two triangles.
pub(super) const INDICES: u32 = 6;
/// Boxes of one draw at most.
pub(super) const BOXES: u32 = 1 << 12;

/// The corners of as many boxes as a draw has.
pub(super) fn indices() -> Vec<u16> {
    let corners = |one: u32| [0, 1, 2, 2, 1, 3].map(|at| (one as usize * CORNERS + at) as u16);
    (0..BOXES).flat_map(corners).collect()
}
