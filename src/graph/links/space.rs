//! The moments and frames among which links are searched, and the conditions under which two windows form a link.

use super::candidate::{Candidate, WindowPair};
use super::free_frames::FreeFrames;
use super::lengths::Lengths;
use super::margin::{EventMargin, Side};
use super::source::LinkSource;
use crate::graph::distance::Windows;
use crate::graph::moments::Moments;
use crate::graph::{GraphEvent, PointCloud, Transition};

/// Data that all searches for links share.
pub(super) struct LinkSpace<'a> {
    pub(super) source: LinkSource<'a>,
    pub(super) lengths: Lengths,
    pub(super) moments: Moments,
    free_frames: FreeFrames,
}

impl<'a> LinkSpace<'a> {
    pub(super) fn new(source: LinkSource<'a>, lengths: Lengths) -> Self {
        let moments = Moments::new(source.aligner.clouds.iter().map(PointCloud::frames));
        let free_frames = FreeFrames::new(&moments, source.aligner.clouds, source.events);
        Self {
            source,
            lengths,
            moments,
            free_frames,
        }
    }
}

impl LinkSpace<'_> {
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
        let available = self.free_frames(index, side);
        let window = self.lengths.window.min(available);
        if window < self.lengths.shortest || event.first == event.last {
            return None;
        }
        let lead = self.lengths.lead.min(available - window);
        let start = match side {
            // The last window ends with the event's first frame.
            Side::Before => event.first as usize + 1 - window - lead,
            // The first window starts after the event's last frame.
            Side::After => event.last as usize + 1,
        };
        let cloud = &self.source.aligner.clouds[event.clip.index()];
        Some(EventMargin {
            event: index,
            side,
            windows: Windows::new(&cloud.part(start..start + window + lead), window),
            window,
            start,
        })
    }

    /// Link between two windows, or `None` if it does not fit or is too far.
    pub(super) fn candidate(&self, margin: &EventMargin, pair: WindowPair) -> Option<Candidate> {
        let WindowPair {
            beside,
            clip,
            start,
            distance,
        } = pair;
        let own_clip = self.source.events[margin.event].clip.index();
        let ((source_clip, source_start), (target_clip, target_start)) = match margin.side {
            Side::Before => ((clip, start), (own_clip, beside)),
            Side::After => ((own_clip, beside), (clip, start)),
        };
        let source_frame = source_start.checked_sub(1)?;
        let target_frame = target_start + margin.window - 1;
        let available = self
            .free_frames
            .after(self.moments.at(source_clip, source_frame))
            .min(
                self.free_frames
                    .before(self.moments.at(target_clip, target_frame)),
            );
        let frames = self.lengths.blend(distance, available)?;
        let cost = self.lengths.cost(distance, frames);
        let link = Transition {
            source_clip,
            source_frame,
            target_clip,
            target_frame,
            frames,
            distance,
        };
        (cost <= self.lengths.loosest).then_some(Candidate {
            link,
            event: margin.event,
            cost,
            compared: margin.window,
        })
    }

    /// Recomputes the distance for the frames that are actually blended. Returns `None` if it is
    /// too large.
    pub(super) fn refined(&self, mut candidate: Candidate) -> Option<Candidate> {
        let link = &mut candidate.link;
        if link.frames != candidate.compared {
            link.distance = link.windows(self.source.aligner.clouds).distance();
            candidate.cost = self.lengths.cost(link.distance, link.frames);
        }
        (candidate.cost <= self.lengths.loosest).then_some(candidate)
    }
}
