//! Moments of groups in their clips, as they are kept until the groups are posed.

use super::key_bank::KeyPlace;
use super::moment::{Reach, Weights};
use super::sampling::WindowPlace;
use crate::math::{F32x16, Lanes};

/// Moments of a group's characters in their clips. Lanes are stored as [`F32x16`]s, so that the same memory serves every
/// instruction set.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moments {
    /// Index of the group.
    pub(super) group: usize,
    /// The interval of each character's own clip.
    pub(super) interval: F32x16,
    /// Bits of [`Weights::pair`].
    pub(super) weights: F32x16,
    /// For each part whose lanes are near each other in time, position of its window in the first column, in keys.
    pub(super) starts: [usize; F32x16::LANES],
    /// Number of keys from the start of one column to the start of the next.
    pub(super) stride: usize,
    /// Bits of [`Near::places`].
    pub(super) places: F32x16,
    /// Reach of the part whose lanes are furthest from each other.
    pub(super) reach: Reach,
    /// Whether all characters look as on the posed level, so that no joint is blended towards a coarser one.
    pub(super) is_posed: bool,
    /// Whether a character is inside the frustum.
    pub(super) is_visible: bool,
    /// Whether all characters play one clip, but are not near each other in time.
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

    /// Windows of a part of this group, whose lanes are near each other in time, and of the group that is posed next.
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
