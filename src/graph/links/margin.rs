//! The ranges of frames beside events where links may end or start.

use serde::{Deserialize, Serialize};

use super::candidates::Candidates;
use crate::graph::GraphEvent;
use crate::graph::distance::Windows;

/// Side of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// Before the event's first frame. Links end there.
    Before,
    /// After its last frame: links start there.
    After,
}

/// An event: its clip and frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(super) struct EventFrames {
    pub(super) clip: u32,
    pub(super) first: u32,
    pub(super) last: u32,
}

/// The range of frames beside an event where links may end or start.
pub(super) struct EventMargin {
    pub(super) event: usize,
    pub(super) frames: EventFrames,
    pub(super) side: Side,
    /// Points of the range, in windows of `window` frames.
    pub(super) windows: Windows,
    pub(super) window: usize,
    /// First frame of the range's first window.
    pub(super) start: usize,
}

impl Candidates<'_> {
    /// Number of frames that a blend beside an event can use.
    pub(super) fn free_frames(&self, event: usize, side: Side) -> usize {
        let event = &self.source.events[event];
        match side {
            Side::Before => self.free_frames.before(self.moment(event, event.first)),
            Side::After => self.free_frames.after(self.moment(event, event.last)),
        }
    }

    fn moment(&self, event: &GraphEvent, frame: u32) -> u32 {
        self.moments.at(event.clip.index(), frame as usize)
    }

    /// Range beside an event, or `None` if the shortest blend does not fit there.
    pub(super) fn margin(&self, index: usize, side: Side) -> Option<EventMargin> {
        let event = &self.source.events[index];
        let room = self.free_frames(index, side);
        let window = self.lengths.window.min(room);
        if window < self.lengths.shortest || event.first == event.last {
            return None;
        }
        let lead = self.lengths.lead.min(room - window);
        let start = match side {
            // The last window ends with the event's first frame.
            Side::Before => event.first as usize + 1 - window - lead,
            // The first window starts after the event's last frame.
            Side::After => event.last as usize + 1,
        };
        let cloud = &self.source.aligner.clouds[event.clip.index()];
        Some(EventMargin {
            event: index,
            frames: EventFrames {
                clip: event.clip.0,
                first: event.first,
                last: event.last,
            },
            side,
            windows: Windows::new(&cloud.part(start..start + window + lead), window),
            window,
            start,
        })
    }
}

impl Side {
    /// The frame of a link's end in the clip whose window starts at `start`, or `None` if the clip has no such frame.
    pub(super) fn far_end(self, start: usize, window: usize) -> Option<usize> {
        match self {
            Self::Before => start.checked_sub(1),
            Self::After => Some(start + window - 1),
        }
    }
}
