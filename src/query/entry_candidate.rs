use crate::graph::Entry;
use crate::math::Rigid2;

/// An evasion that is entered after a delay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct EntryCandidate {
    /// Seconds since the query.
    pub delay: f32,
    pub entry: Entry,
    /// Position among the evasions.
    pub evasion: usize,
    /// Seconds at rate 1 from the first moment of the evasion's track to the one that is entered.
    pub ahead: f32,
    /// Takes the track's frame to the world.
    pub placement: Rigid2,
    /// Seconds at rate 1 from the one that is entered to the evasion's end.
    pub left: f32,
}
