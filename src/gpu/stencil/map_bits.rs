//! The position of a map among the words of an atlas.

/// Position of a map in its frame, and of its bits in the atlas's words: `[row][column][slice]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MapBits {
    pub(super) u: i32,
    pub(super) v: i32,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) first_bit: u32,
    pub(super) row_bits: u32,
    pub(super) texel_bits_log2: u32,
}
