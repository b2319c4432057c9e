//! Where a character is: its group and lane, as one number; and how many characters there may be.

use crate::math::F32x16;

/// Bits of a character's number.
pub(super) const ID_BITS: u32 = 28;

/// A crowd may not have more characters.
pub(super) const MOST: usize = (1 << ID_BITS) - 1;

/// There may not be more clips times levels.
pub(super) const MOST_MOTIONS: usize = 1 << 19;

/// The crowd is sorted once one character in so many was moved to another group.
pub(super) const MOST_LATE: usize = 16;

/// The slot of a character that is in no group.
pub(super) const NOWHERE: u32 = u32::MAX;

/// Set in the slots of parked characters.
pub(super) const PARKED: u32 = 1 << 31;

/// Group and lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Slot {
    pub(super) group: usize,
    pub(super) lane: usize,
}

impl Slot {
    /// The slot of a number; of a parked character, what is left without [`PARKED`].
    pub(super) fn of(number: u32) -> Self {
        let number = (number & !PARKED) as usize;
        Self {
            group: number / F32x16::LANES,
            lane: number % F32x16::LANES,
        }
    }

    pub(super) fn number(self) -> u32 {
        (self.group * F32x16::LANES + self.lane) as u32
    }
}
