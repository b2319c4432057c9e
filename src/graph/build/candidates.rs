//! Possible links: the ranges beside events where links may end or start, and the conditions under which two windows form a link.

use crate::graph::build::events;
use crate::graph::build::input::GraphBuilder;
use crate::graph::build::moments::Moments;
use crate::graph::motion_graph::GraphEvent;
use crate::graph::search::features::WindowCell;
use crate::graph::search::transition::Transition;
use crate::graph::search::windows::{PointCloud, Windows};
use crate::graph::settings::{GraphSettings, LinkSettings};
use std::cmp::Ordering;

/// Maximum time between a link's end and its event's first frame, or between its event's last frame and the link's start, in seconds.
const LEAD: f64 = 0.25;
/// Minimum length of a blend, used if an event is close to its clip's start or end, in seconds.
const SHORTEST: f64 = 1.0 / 6.0;
/// Maximum length of a blend, used for the links with the largest distance, in seconds.
const LONGEST: f64 = 0.5;
/// Minimum spacing in a clip between links to the same evasion, in seconds.
const SPREAD: f64 = 0.1;

/// Maximum number of links of one part of a clip. It bounds the search by the clips' duration, regardless of the number of events. It is
/// larger than the number of evasions of every default goal of [`LinkSettings`](crate::graph::settings::LinkSettings).
pub(crate) const MOST: usize = 16;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub(crate) link: Transition,
    /// Index of the event that the link leads to or comes from.
    pub(crate) event: usize,
    /// [`Lengths::cost`], in metres.
    pub(crate) cost: f32,
    /// Number of frames of the windows whose distance was measured.
    pub(crate) compared: usize,
}

impl Candidate {
    /// The order by cost, then by event.
    pub(crate) fn closest_first(&self, other: &Self) -> Ordering {
        self.cost
            .total_cmp(&other.cost)
            .then(self.event.cmp(&other.event))
    }
}

/// Sorts the links of a part, at most one for each event, and keeps the [`MOST`] closest.
pub(crate) fn keep_closest(part: &mut Vec<Candidate>) {
    part.sort_by(Candidate::closest_first);
    part.truncate(MOST);
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    /// Before the event's first frame. Links end there.
    Before,
    /// After the event's last frame. Links start there.
    After,
}

/// The range of frames beside an event where links may end or start.
pub(crate) struct EventMargin {
    pub(crate) event: usize,
    pub(crate) side: Side,
    /// Points of the range, in windows of `window` frames.
    pub(crate) windows: Windows,
    pub(crate) window: usize,
    /// First frame of the range's first window.
    pub(crate) start: usize,
}

impl Side {
    /// Frame at the far end of a link, in the clip whose window of `window` frames starts at `start`. `None` if the clip has no such frame.
    pub(crate) fn far_end(self, start: usize, window: usize) -> Option<usize> {
        match self {
            Self::Before => start.checked_sub(1),
            Self::After => Some(start + window - 1),
        }
    }
}

/// Lengths and distances of links. Lengths are in frames.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lengths {
    pub(crate) window: usize,
    pub(crate) shortest: usize,
    longest: usize,
    pub(crate) lead: usize,
    pub(crate) spread: usize,
    /// Minimum distance in time of two windows of one clip. Closer windows show the same motion.
    pub(crate) separation: usize,
    /// Maximum distance at which a blend has the window's length, in metres.
    pub(crate) threshold: f32,
    pub(crate) loosest: f32,
}

impl Lengths {
    pub(crate) fn new(graph: &GraphSettings, links: &LinkSettings) -> Self {
        let window = graph.frames(graph.window);
        Self {
            window,
            shortest: graph.frames(SHORTEST).min(window),
            longest: graph.frames(LONGEST).max(window),
            lead: (LEAD * graph.frame_rate).round() as usize,
            spread: graph.frames(SPREAD),
            separation: graph.frames(graph.separation),
            threshold: graph.threshold,
            loosest: links.loosest,
        }
    }

    /// Length of a blend between windows at `distance` metres, if `available` frames are available.
    /// Returns `None` if the shortest blend does not fit.
    pub(crate) fn blend(&self, distance: f32, available: usize) -> Option<usize> {
        let share = ((distance - self.threshold) / (self.loosest - self.threshold)).clamp(0.0, 1.0);
        // The share is not finite if the maximum distance of links is not above the graph's
        // threshold.
        let share = if share.is_finite() { share } else { 0.0 };
        let more = share * (self.longest - self.window) as f32;
        let blend = (self.window + more.round() as usize).min(available);
        (blend >= self.shortest).then_some(blend)
    }

    /// Cost of a link: its distance, scaled up if the blend is shorter than the window, because it
    /// then covers the distance in less time.
    pub(crate) fn cost(&self, distance: f32, blend: usize) -> f32 {
        distance * (self.window as f32 / blend as f32).max(1.0)
    }
}

/// Data that all searches for links share.
pub(crate) struct LinkSpace<'a> {
    pub(crate) input: &'a GraphBuilder<'a>,
    /// Events in frames of the clips. Those that overlap are merged.
    pub(crate) events: Vec<GraphEvent>,
    pub(crate) lengths: Lengths,
    pub(crate) moments: Moments,
    /// Number of frames that a blend which ends at each moment, and one which starts there, can use. A blend reaches at most to the clip's
    /// end or to an event, because it must not blend a part of an event.
    before: Vec<u32>,
    after: Vec<u32>,
}

impl<'a> LinkSpace<'a> {
    pub(crate) fn new(input: &'a GraphBuilder<'a>, links: &LinkSettings) -> Self {
        let moments = Moments::new(input.clouds.iter().map(PointCloud::frames));
        let events = events::merged(&input.events);
        // Whether the step from each moment to the next moment of its clip may be blended.
        let mut free = moments.goes_on();
        for event in &events {
            let [first, last] = moments.ends(event);
            free[first as usize..last as usize].fill(false);
        }
        let (mut before, mut after) = (vec![0; free.len()], vec![0; free.len()]);
        for clip in 0..input.clouds.len() {
            let range = moments.of_clip(clip);
            for moment in range.clone().skip(1) {
                if free[moment - 1] {
                    before[moment] = before[moment - 1] + 1;
                }
            }
            for moment in range.rev().filter(|&moment| free[moment]) {
                after[moment] = after[moment + 1] + 1;
            }
        }
        Self {
            input,
            events,
            lengths: Lengths::new(input.settings, links),
            moments,
            before,
            after,
        }
    }
}

impl LinkSpace<'_> {
    /// Number of frames that a blend beside an event can use.
    pub(crate) fn free_frames(&self, event: usize, side: Side) -> usize {
        let [first, last] = self.moments.ends(&self.events[event]);
        let frames = match side {
            Side::Before => self.before[first as usize],
            Side::After => self.after[last as usize],
        };
        frames as usize
    }

    /// Number of frames that a blend between two frames, each with its clip, can use.
    pub(crate) fn available(&self, source: (usize, usize), target: (usize, usize)) -> usize {
        let at = |(clip, frame)| self.moments.at(clip, frame) as usize;
        self.after[at(source)].min(self.before[at(target)]) as usize
    }

    /// Range beside an event, or `None` if the shortest blend does not fit there.
    pub(crate) fn margin(&self, index: usize, side: Side) -> Option<EventMargin> {
        let event = &self.events[index];
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
        let cloud = &self.input.clouds[event.clip.index()];
        Some(EventMargin {
            event: index,
            side,
            windows: Windows::new(&cloud.part(start..start + window + lead), window),
            window,
            start,
        })
    }

    /// Link between a window of a range and one of a clip, or `None` if it does not fit or is too far.
    pub(crate) fn candidate(
        &self,
        margin: &EventMargin,
        clip: usize,
        cell: WindowCell,
        distance: f32,
    ) -> Option<Candidate> {
        let own = (
            self.events[margin.event].clip.index(),
            margin.start + cell.row as usize,
        );
        let other = (clip, cell.column as usize);
        let ((source_clip, source_start), (target_clip, target_start)) = match margin.side {
            Side::Before => (other, own),
            Side::After => (own, other),
        };
        let source_frame = source_start.checked_sub(1)?;
        let target_frame = target_start + margin.window - 1;
        let available = self.available((source_clip, source_frame), (target_clip, target_frame));
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
    pub(crate) fn refined(&self, mut candidate: Candidate) -> Option<Candidate> {
        let link = &mut candidate.link;
        if link.frames != candidate.compared {
            link.distance = link.windows(&self.input.clouds).distance();
            candidate.cost = self.lengths.cost(link.distance, link.frames);
        }
        (candidate.cost <= self.lengths.loosest).then_some(candidate)
    }
}
