//! A possible link and the windows that it connects.

use std::cmp::Ordering;

use crate::graph::Transition;

/// Maximum number of links of one part of a clip. It bounds the search by the clips' duration, regardless of the number of events. It is
/// larger than the number of evasions of every default goal of [`LinkSettings`](super::LinkSettings).
pub(super) const MOST: usize = 16;

/// A possible link.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) link: Transition,
    /// Index of the event that the link leads to or comes from.
    pub(super) event: usize,
    /// Cost: the link's distance, increased if its blend is shorter than the graph's window, in
    /// metres.
    pub(super) cost: f32,
    /// Number of frames of the windows whose distance was measured.
    pub(super) compared: usize,
}

impl Candidate {
    /// The order by cost, then by event.
    pub(super) fn closest_first(&self, other: &Self) -> Ordering {
        self.cost
            .total_cmp(&other.cost)
            .then(self.event.cmp(&other.event))
    }
}

/// A window beside an event, one of a clip, and their distance.
#[derive(Clone, Copy)]
pub(super) struct WindowPair {
    /// First frame of the window beside the event.
    pub(super) beside: usize,
    pub(super) clip: usize,
    /// First frame of the clip's window.
    pub(super) start: usize,
    /// Distance of the windows, in metres.
    pub(super) distance: f32,
}

/// Sorts the links of a part, at most one for each event, and keeps the [`MOST`] closest.
pub(super) fn keep_closest(part: &mut Vec<Candidate>) {
    part.sort_by(Candidate::closest_first);
    part.truncate(MOST);
}
