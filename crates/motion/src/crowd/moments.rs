//! Where groups are in their clips, as it is kept until they are posed.

use super::key_bank::KeyPlace;
use super::moment::{Reach, Weights};
use super::sampling::WindowPlace;
use crate::math::{F32x16, Lanes};

/// Where a group is in its clips, and what of it is shown. In lines, so that the same memory serves every instruction set.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moments {
    /// Index of the group.
    pub(super) group: usize,
    /// The interval of each character's own clip.
    pub(super) interval: F32x16,
    /// Bits of [`Weights::pair`].
    pub(super) weights: F32x16,
    /// Where each part is that is near: key of the first column.
    pub(super) starts: [usize; F32x16::LANES],
    /// From column to column.
    pub(super) stride: usize,
    /// Bits of [`Near::places`].
    pub(super) places: F32x16,
    /// Of the part whose lanes are furthest from each other.
    pub(super) reach: Reach,
    /// Nobody is on the way to another level.
    pub(super) is_posed: bool,
    /// Some character is inside the frustum.
    pub(super) is_visible: bool,
    /// All play one clip, but are not near each other in time.
    pub(super) is_apart: bool,
}

impl Moments {
    pub(super) const BLANK: Self = Self {
        group: 0,
        interval: F32x16::ZERO,
        weights: F32x16::ZERO,
        starts: [0; F32x16::LANES],
        stride: 0,
        places: F32x16::ZERO,
        reach: Reach::Apart,
        is_posed: false,
        is_visible: false,
        is_apart: false,
    };

    #[inline(always)]
    pub(super) fn weights<L: Lanes>(&self, part: usize) -> Weights<L> {
        Weights {
            pair: L::load_words(&self.weights, part),
        }
    }

    /// Where a part is, of a group that is near, and where the next such group is.
    #[inline(always)]
    pub(super) fn windows<L: Lanes>(&self, next: &Self, part: usize) -> WindowPlace<L> {
        let place = |moments: &Self| KeyPlace {
            first: moments.starts[part],
            stride: moments.stride,
        };
        WindowPlace {
            at: place(self),
            next: place(next),
            places: L::load_words(&self.places, part),
        }
    }
}
