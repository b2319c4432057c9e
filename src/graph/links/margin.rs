//! The ranges of frames beside events where links may end or start.

use crate::graph::distance::Windows;

/// Side of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// Before the event's first frame. Links end there.
    Before,
    /// After the event's last frame. Links start there.
    After,
}

/// The range of frames beside an event where links may end or start.
pub(super) struct EventMargin {
    pub(super) event: usize,
    pub(super) side: Side,
    /// Points of the range, in windows of `window` frames.
    pub(super) windows: Windows,
    pub(super) window: usize,
    /// First frame of the range's first window.
    pub(super) start: usize,
}

impl Side {
    /// Frame at the far end of a link, in the clip whose window of `window` frames starts at `start`. `None` if the clip has no such frame.
    pub(super) fn far_end(self, start: usize, window: usize) -> Option<usize> {
        match self {
            Self::Before => start.checked_sub(1),
            Self::After => Some(start + window - 1),
        }
    }
}
