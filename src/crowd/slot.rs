//! Where a character is: its group and lane, as one number; and how many characters there may be.

use crate::math::F32x16;

/// Bits of a character's number.
pub(super) const ID_BITS: u32 = 28;

/// A crowd may not have more characters.
pub(super) const MOST: usize = (1 << ID_BITS) - 1;

/// The crowd is sorted once one character in so many was moved to another group.
pub(super) const MOST_LATE: usize = 16;

/// The slot of a character that is in no group.
pub(super) const NOWHERE: u32 = u32::MAX;

/// Set in the slots of parked characters.
pub(super) const PARKED: u32 = 1 << 31;

/// A slot as group and lane.
pub(super) fn split(slot: u32) -> (usize, usize) {
    let slot = slot as usize;
    (slot / F32x16::LANES, slot % F32x16::LANES)
}
