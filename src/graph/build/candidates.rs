use crate::anim::Clip;
use crate::graph::build::align::Aligner;
use crate::graph::build::moments::Moments;
use crate::graph::motion_graph::GraphEvent;
use crate::graph::search::cloud::PointCloud;
use crate::graph::search::transition::Transition;
use crate::graph::search::windows::Windows;
use crate::graph::settings::{GraphSettings, LinkSettings};
use crate::graph::watch::BakeWatch;
use std::cmp::Ordering;

/// Input of the search for links.
#[derive(Clone, Copy)]
pub(crate) struct LinkSource<'a> {
    /// Clips, at the graph's frame rate.
    pub(crate) clips: &'a [Clip],
    /// Points of the clips, and how they are aligned.
    pub(crate) aligner: Aligner<'a>,
    /// Windows of each cloud, as long as the graph's transitions.
    pub(crate) windows: &'a [Windows],
    /// Events in frames of the clips. Those that overlap are merged.
    pub(crate) events: &'a [GraphEvent],
    /// Settings of the graph.
    pub(crate) settings: &'a GraphSettings,
    pub(crate) watch: &'a dyn BakeWatch,
}

// A possible link and the windows that it connects.

/// Maximum number of links of one part of a clip. It bounds the search by the clips' duration, regardless of the number of events. It is
/// larger than the number of evasions of every default goal of [`LinkSettings`](crate::graph::settings::LinkSettings).
pub(crate) const MOST: usize = 16;

/// A possible link.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub(crate) link: Transition,
    /// Index of the event that the link leads to or comes from.
    pub(crate) event: usize,
    /// Cost: the link's distance, increased if its blend is shorter than the graph's window, in
    /// metres.
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

/// A window beside an event, one of a clip, and their distance.
#[derive(Clone, Copy)]
pub(crate) struct WindowPair {
    /// First frame of the window beside the event.
    pub(crate) beside: usize,
    pub(crate) clip: usize,
    /// First frame of the clip's window.
    pub(crate) start: usize,
    /// Distance of the windows, in metres.
    pub(crate) distance: f32,
}

/// Sorts the links of a part, at most one for each event, and keeps the [`MOST`] closest.
pub(crate) fn keep_closest(part: &mut Vec<Candidate>) {
    part.sort_by(Candidate::closest_first);
    part.truncate(MOST);
}

// The ranges of frames beside events where links may end or start.

/// Side of an event.
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
    /// Length of the graph's windows.
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
            shortest: graph.frames(links.shortest).min(window),
            longest: graph.frames(links.longest).max(window),
            lead: (links.lead * graph.frame_rate).round() as usize,
            spread: graph.frames(links.spread),
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

/// Number of frames that a blend can use before and after each moment. A blend reaches at most to
/// the clip's end or to an event, because it must not blend a part of an event.
#[derive(Debug)]
pub(crate) struct FreeFrames {
    before: Vec<u32>,
    after: Vec<u32>,
}

impl FreeFrames {
    pub(crate) fn new(moments: &Moments, clouds: &[PointCloud], events: &[GraphEvent]) -> Self {
        // Whether the step from each moment to the next moment of its clip may be blended.
        let mut free = moments.goes_on();
        for event in events {
            let [first, last] =
                [event.first, event.last].map(|f| moments.at(event.clip.index(), f as usize));
            free[first as usize..last as usize].fill(false);
        }
        let (mut before, mut after) = (vec![0; free.len()], vec![0; free.len()]);
        for clip in 0..clouds.len() {
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
        Self { before, after }
    }

    /// Number of frames that a blend which ends at `moment` can use.
    pub(crate) fn before(&self, moment: u32) -> usize {
        self.before[moment as usize] as usize
    }

    /// Number of frames that a blend which starts at `moment` can use.
    pub(crate) fn after(&self, moment: u32) -> usize {
        self.after[moment as usize] as usize
    }
}

// The moments and frames among which links are searched, and the conditions under which two windows form a link.

/// Data that all searches for links share.
pub(crate) struct LinkSpace<'a> {
    pub(crate) source: LinkSource<'a>,
    pub(crate) lengths: Lengths,
    pub(crate) moments: Moments,
    free_frames: FreeFrames,
}

impl<'a> LinkSpace<'a> {
    pub(crate) fn new(source: LinkSource<'a>, lengths: Lengths) -> Self {
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
    pub(crate) fn free_frames(&self, event: usize, side: Side) -> usize {
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
    pub(crate) fn margin(&self, index: usize, side: Side) -> Option<EventMargin> {
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
    pub(crate) fn candidate(&self, margin: &EventMargin, pair: WindowPair) -> Option<Candidate> {
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
    pub(crate) fn refined(&self, mut candidate: Candidate) -> Option<Candidate> {
        let link = &mut candidate.link;
        if link.frames != candidate.compared {
            link.distance = link.windows(self.source.aligner.clouds).distance();
            candidate.cost = self.lengths.cost(link.distance, link.frames);
        }
        (candidate.cost <= self.lengths.loosest).then_some(candidate)
    }
}
