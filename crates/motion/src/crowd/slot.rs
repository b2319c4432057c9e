//! The position of a character: its group and lane, as one number. Limits of the numbers of characters and motions.

use crate::math::F32x16;

/// Number of bits of a character's number.
pub(super) const ID_BITS: u32 = 28;

/// Maximum number of characters of a crowd.
pub(super) const MOST: usize = (1 << ID_BITS) - 1;

/// Maximum number of clips times levels.
pub(super) const MOST_MOTIONS: usize = 1 << 19;

/// All characters are sorted once one in this many was moved to another group.
pub(super) const MOST_LATE: usize = 16;

/// The slot of a character that is in no group.
pub(super) const NOWHERE: u32 = u32::MAX;

/// Flag in the slots of parked characters.
pub(super) const PARKED: u32 = 1 << 31;

/// A lane of a group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Slot {
    pub(super) group: usize,
    pub(super) lane: usize,
}

impl Slot {
    /// The slot with a number, ignoring the flag [`PARKED`].
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
