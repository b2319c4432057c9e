use crate::graph::Entry;
use crate::math::Rigid2;

/// An evasion that is entered after a delay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct EntryCandidate {
    /// Time of the entry, in seconds since the query.
    pub delay: f32,
    pub entry: Entry,
    /// Index in [`BakedGraph::evasions`](crate::maps::BakedGraph::evasions).
    pub evasion: usize,
    /// Time from the start of the evasion's track to the entered frame at rate 1, in seconds.
    pub ahead: f32,
    /// Transform from the track's frame to the world.
    pub placement: Rigid2,
    /// Time from the entered frame to the evasion's end at rate 1, in seconds.
    pub left: f32,
}
