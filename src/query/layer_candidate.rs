//! A candidate that layers the upper body of an evasion over the motion that goes on.

use crate::graph::Layer;

/// An evasion whose upper body is layered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LayerCandidate {
    pub layer: Layer,
    /// Index in [`BakedGraph::evasions`](crate::maps::BakedGraph::evasions).
    pub evasion: usize,
    /// Distance from the attack by the ranking, in metres.
    pub metres: f32,
}
