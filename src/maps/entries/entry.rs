//! Blends and rates of entries, their targets, and an entry as it is stored.

use crate::graph::EdgeId;
use crate::math::byte_list::Bytes;
use serde::{Deserialize, Serialize};

/// Durations of an entry's blend, in seconds. The shortest plausible one is used.
pub(crate) const BLENDS: [f32; 3] = [0.15, 0.2, 0.25];
/// Durations of an exit's blend, in seconds. They are longer than those of entries, because an exit is not urgent and a fast body has to slow
/// down.
pub(crate) const EXIT_BLENDS: [f32; 4] = [0.2, 0.3, 0.45, 0.65];

/// Playback rates of an entry. Rates up to the fastest plausible one are used.
pub(crate) const RATES: [f32; 3] = [1.0, 1.25, 1.5];

/// A frame of an evasion, or of its lead-in, that can be entered.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct EntryTarget {
    /// Position in [`BakedGraph::evasions`](crate::maps::BakedGraph::evasions).
    pub evasion: u16,
    /// Frame of the evasion's clip.
    pub frame: u32,
    /// Edge that plays the frame.
    pub edge: EdgeId,
    /// Position of the frame on that edge, in frames.
    pub edge_frame: u32,
}

/// One entry of a moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct KnownEntry {
    /// Index in [`EntryTable::targets`].
    pub target: u16,
    how: u8,
}

impl Bytes<3> for KnownEntry {
    fn to_bytes(self) -> [u8; 3] {
        let [low, high] = self.target.to_le_bytes();
        [low, high, self.how]
    }

    fn from_bytes([low, high, how]: [u8; 3]) -> Self {
        let target = u16::from_le_bytes([low, high]);
        Self { target, how }
    }
}

/// Blend, rate and pin with which a target is entered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct EntryWay {
    /// Index of the shortest plausible blend, in [`BLENDS`] or [`EXIT_BLENDS`].
    pub(crate) blend: usize,
    /// Index of the fastest plausible playback rate in [`RATES`].
    pub(crate) rate: usize,
    /// Leg whose foot is kept in place, or `None` if the root is kept.
    pub(crate) pin: Option<usize>,
}

impl KnownEntry {
    pub(crate) fn new(target: u16, way: EntryWay) -> Self {
        let pin = way.pin.map_or(0, |leg| leg + 1);
        let how = way.blend | pin << 2 | way.rate << 6;
        Self {
            target,
            how: how as u8,
        }
    }

    /// Duration of an entry's blend, in seconds.
    #[must_use]
    pub(crate) fn blend(self) -> f32 {
        BLENDS[usize::from(self.how & 3).min(BLENDS.len() - 1)]
    }

    /// Duration of an exit's blend, in seconds.
    #[must_use]
    pub(crate) fn exit_blend(self) -> f32 {
        EXIT_BLENDS[usize::from(self.how & 3)]
    }

    /// Leg whose foot is kept in place, or `None` if the root is kept.
    #[must_use]
    pub(crate) fn pin(self) -> Option<usize> {
        usize::from(self.how >> 2 & 15).checked_sub(1)
    }

    /// Fastest plausible playback rate.
    #[must_use]
    pub(crate) fn fastest(self) -> f32 {
        RATES[usize::from(self.how >> 6).min(RATES.len() - 1)]
    }
}
