//! A candidate that layers the upper body of an evasion over the natural motion.

use crate::graph::Layer;

/// An evasion whose upper body is layered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LayerCandidate {
    pub layer: Layer,
    /// Index in [`BakedGraph::evasions`](crate::maps::BakedGraph::evasions).
    pub evasion: usize,
    /// Distance from the attack as the ranking estimates it, in metres.
    pub metres: f32,
}
