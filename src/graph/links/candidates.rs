//! Finds possible links and rates them.

use super::free_frames::FreeFrames;
use super::lengths::Lengths;
use super::source::LinkSource;
use std::borrow::Cow;
use std::collections::BTreeMap;

use crate::graph::distance::{DistanceMap, Windows};
use crate::graph::moments::Moments;
use crate::graph::{GraphEvent, PointCloud, Transition};
use crate::math::in_parallel;

/// A possible link.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) link: Transition,
    /// Index of the event that the link leads to or comes from.
    pub(super) event: usize,
    /// Cost: the link's distance, increased if its blend is shorter than the graph's window, in
    /// metres.
    pub(super) cost: f32,
}

/// Side of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// Before the event's first frame. Links end there.
    Before,
    /// After its last frame: links start there.
    After,
}

/// The range of frames beside an event where links may end or start.
struct EventMargin {
    event: usize,
    side: Side,
    /// Points of the range, in windows of `window` frames.
    windows: Windows,
    window: usize,
    /// First frame of the range's first window.
    start: usize,
}

/// Finds possible links.
pub(super) struct Candidates<'a> {
    source: LinkSource<'a>,
    pub(super) lengths: Lengths,
    moments: Moments,
    free_frames: FreeFrames,
}

impl<'a> Candidates<'a> {
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

    /// Number of frames that a blend beside an event can use.
    pub(super) fn free_frames(&self, event: usize, side: Side) -> usize {
        let event = &self.source.events[event];
        match side {
            Side::Before => self.free_frames.before(self.moment(event, event.first)),
            Side::After => self.free_frames.after(self.moment(event, event.last)),
        }
    }

    /// Finds the closest links of `events` on one side, closest first. In each clip, at most one
    /// link is kept for each `spread` frames. Only moments that `allowed` contains are linked;
    /// `None` allows all moments.
    pub(super) fn find(
        &self,
        events: &[usize],
        side: Side,
        allowed: Option<&[bool]>,
    ) -> Vec<Candidate> {
        /// Number of ranges that share the windows of a clip.
        const BATCH: usize = 16;
        let margins: Vec<EventMargin> = events
            .iter()
            .filter_map(|&event| self.margin(event, side))
            .collect();
        let clips = self.source.aligner.clouds.len();
        let batches: Vec<&[EventMargin]> = margins.chunks(BATCH).collect();
        let jobs = batches.len() * clips;
        let mut found = in_parallel(self.source.settings.threads, jobs, |job| {
            self.of_clip(batches[job / clips], job % clips, allowed)
        });
        let in_order = (0..margins.len())
            .flat_map(|margin| (0..clips).map(move |clip| (margin, clip)))
            .flat_map(|(margin, clip)| {
                std::mem::take(&mut found[margin / BATCH * clips + clip][margin % BATCH])
            });
        let mut found: Vec<Candidate> = in_order.collect();
        // The sort is stable, so that ties keep the order of events, clips and frames.
        found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        found
    }

    /// Closest links between each range and each part of a clip, by range.
    fn of_clip(
        &self,
        margins: &[EventMargin],
        clip: usize,
        allowed: Option<&[bool]>,
    ) -> Vec<Vec<Candidate>> {
        // The clip's windows of each length that a range has.
        let mut windows: BTreeMap<usize, Cow<'_, Windows>> = BTreeMap::new();
        let own = Cow::Borrowed(&self.source.windows[clip]);
        windows.insert(self.lengths.window, own);
        let of_margin = |margin: &EventMargin| {
            let length = margin.window;
            let windows = windows.entry(length).or_insert_with(|| {
                Cow::Owned(Windows::new(&self.source.aligner.clouds[clip], length))
            });
            self.between(margin, (clip, windows), allowed)
        };
        margins.iter().map(of_margin).collect()
    }

    fn moment(&self, event: &GraphEvent, frame: u32) -> u32 {
        self.moments.at(event.clip.index(), frame as usize)
    }

    /// Range beside an event, or `None` if the shortest blend does not fit there.
    fn margin(&self, index: usize, side: Side) -> Option<EventMargin> {
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
            side,
            windows: Windows::new(&cloud.part(start..start + window + lead), window),
            window,
            start,
        })
    }

    /// Closest link between a range and each part of a clip, given the clip's windows of the range's length.
    fn between(
        &self,
        margin: &EventMargin,
        (clip, windows): (usize, &Windows),
        allowed: Option<&[bool]>,
    ) -> Vec<Candidate> {
        let cloud = &self.source.aligner.clouds[clip];
        let own_clip = self.source.events[margin.event].clip.index();
        let spread = self.lengths.spread;
        let mut best: Vec<Option<Candidate>> = vec![None; cloud.frames().div_ceil(spread)];
        let limit = self.lengths.loosest * self.lengths.loosest;
        DistanceMap::new(&margin.windows, windows).for_each_row(|row, squares| {
            let beside = margin.start + row;
            for (start, &square) in squares.iter().enumerate() {
                let same = clip == own_clip && start.abs_diff(beside) < self.lengths.separation;
                if square > limit || same {
                    continue;
                }
                let Some(far) = margin.side.far_end(start, margin.window) else {
                    continue;
                };
                if allowed.is_some_and(|allowed| !allowed[self.moments.at(clip, far) as usize]) {
                    continue;
                }
                // A link's cost is at least its distance.
                let distance = square.sqrt();
                if best[far / spread].is_some_and(|best| distance >= best.cost) {
                    continue;
                }
                let Some(found) = self.candidate(margin, beside, (clip, start), distance) else {
                    continue;
                };
                let cell = &mut best[far / spread];
                if cell.is_none_or(|best| found.cost < best.cost) {
                    *cell = Some(found);
                }
            }
        });
        best.into_iter()
            .flatten()
            .filter_map(|candidate| self.refined(candidate, margin.window))
            .collect()
    }

    /// Link between the window that starts at frame `beside` of the event's clip and the window
    /// that starts at frame `start` of another clip, or `None` if it does not fit or is too far.
    fn candidate(
        &self,
        margin: &EventMargin,
        beside: usize,
        (clip, start): (usize, usize),
        distance: f32,
    ) -> Option<Candidate> {
        let own_clip = self.source.events[margin.event].clip.index();
        let ((source_clip, source_start), (target_clip, target_start)) = match margin.side {
            Side::Before => ((clip, start), (own_clip, beside)),
            Side::After => ((own_clip, beside), (clip, start)),
        };
        let source_frame = source_start.checked_sub(1)?;
        let target_frame = target_start + margin.window - 1;
        let room = self
            .free_frames
            .after(self.moments.at(source_clip, source_frame))
            .min(
                self.free_frames
                    .before(self.moments.at(target_clip, target_frame)),
            );
        let frames = self.lengths.blend(distance, room)?;
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
        })
    }

    /// Recomputes the distance for the frames that are actually blended. Returns `None` if it is
    /// too large.
    fn refined(&self, mut candidate: Candidate, compared: usize) -> Option<Candidate> {
        let link = &mut candidate.link;
        if link.frames != compared {
            link.distance = link.windows(self.source.aligner.clouds).distance();
            candidate.cost = self.lengths.cost(link.distance, link.frames);
        }
        (candidate.cost <= self.lengths.loosest).then_some(candidate)
    }
}

impl Side {
    /// The frame of a link's end in the clip whose window starts at `start`, or `None` if the clip has no such frame.
    fn far_end(self, start: usize, window: usize) -> Option<usize> {
        match self {
            Self::Before => start.checked_sub(1),
            Self::After => Some(start + window - 1),
        }
    }
}
