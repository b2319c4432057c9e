//! Finds possible links and rates them.

use super::clip_windows::ClipWindows;
use super::free_frames::FreeFrames;
use super::lengths::Lengths;
use super::margin::{EventMargin, Side};
use super::near_margins::NearMargins;
use super::record::LinkRecord;
use super::source::LinkSource;
use std::collections::BTreeMap;

use crate::graph::moments::Moments;
use crate::graph::watch::{BakeStage, Stopped};
use crate::graph::{PointCloud, Transition};
use crate::math::in_parallel;

/// Maximum number of links of one part of a clip. It bounds the search by the clips' duration, however many events there are, and is more
/// than any goal of [`LinkSettings`](super::LinkSettings) asks for by default.
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
    /// Number of frames of the windows that its distance was measured of.
    pub(super) compared: usize,
}

/// A window beside an event, one of a clip, and their distance.
#[derive(Clone, Copy)]
pub(super) struct WindowPair {
    /// First frame of the window beside the event.
    pub(super) beside: usize,
    pub(super) clip: usize,
    /// First frame of the clip's window.
    pub(super) start: usize,
    /// In metres.
    pub(super) distance: f32,
}

/// Sorts the links of a part, which has one of each event at most, and keeps the closest.
pub(super) fn keep_closest(part: &mut Vec<Candidate>) {
    part.sort_by(|a, b| a.cost.total_cmp(&b.cost).then(a.event.cmp(&b.event)));
    part.truncate(MOST);
}

/// Finds possible links.
pub(super) struct Candidates<'a> {
    pub(super) source: LinkSource<'a>,
    pub(super) lengths: Lengths,
    pub(super) moments: Moments,
    pub(super) free_frames: FreeFrames,
    /// Windows of all clips, by their length.
    windows: BTreeMap<usize, ClipWindows<'a>>,
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
            windows: BTreeMap::new(),
        }
    }

    /// Makes windows of all clips that are as long as those of some ranges.
    pub(super) fn make_windows<'m>(&mut self, ranges: impl Iterator<Item = &'m EventMargin>) {
        for EventMargin { window, .. } in ranges {
            if !self.windows.contains_key(window) {
                let windows = ClipWindows::new(self, *window);
                self.windows.insert(*window, windows);
            }
        }
    }

    /// The windows of all clips, of a length that was made.
    pub(super) fn windows(&self, length: usize) -> &ClipWindows<'a> {
        &self.windows[&length]
    }

    /// Frees the memory of the windows, which are made anew if they are needed again.
    pub(super) fn forget_windows(&mut self) {
        self.windows.clear();
    }

    /// Finds the closest links of `events` on one side, closest first. `events` are in ascending order. Of each event at most one link is
    /// kept for each `spread` frames of a clip, and of all events the [`MOST`] closest ones. Only moments that `allowed` contains are
    /// linked; `None` allows all moments.
    pub(super) fn find(
        &mut self,
        events: &[usize],
        side: Side,
        allowed: Option<&[bool]>,
    ) -> Result<Vec<Candidate>, Stopped> {
        let margins = self.margins(events, side);
        let near = NearMargins::new(self, &margins, allowed);
        let found = self.of_clips(|clip| near.closest(clip));
        self.source.watch.check()?;
        Ok(self.sorted(&found))
    }

    /// Finds the closest links before `events`, like [`Candidates::find`], and records them. Those that an earlier bake found are not
    /// searched again.
    pub(super) fn find_known(
        &mut self,
        events: &[usize],
        record: &mut LinkRecord,
    ) -> Result<Vec<Candidate>, Stopped> {
        let known = self.source.known;
        let margins = self.margins(events, Side::Before);
        let near = NearMargins::new(self, &margins, None);
        let ranges = known.ranges(&margins);
        let found = self.of_clips(|clip| match known.parts(self, &ranges, clip) {
            Some(parts) => near.add_closest(ranges.new.iter().copied(), clip, parts),
            None => near.closest(clip),
        });
        record.set_links(&margins, &found);
        self.source.watch.check()?;
        Ok(self.sorted(&found))
    }

    /// The ranges beside events. The windows are made.
    fn margins(&mut self, events: &[usize], side: Side) -> Vec<EventMargin> {
        let margins = events.iter().filter_map(|&event| self.margin(event, side));
        let margins: Vec<EventMargin> = margins.collect();
        self.make_windows(margins.iter());
        margins
    }

    /// The links of each part of each clip. After a stop they are those of the first clips.
    fn of_clips(
        &self,
        of_clip: impl Fn(usize) -> Vec<Vec<Candidate>> + Sync,
    ) -> Vec<Vec<Vec<Candidate>>> {
        let LinkSource {
            watch, settings, ..
        } = self.source;
        let stage = watch.stage(BakeStage::Links, settings.threads);
        stage.in_parallel(self.source.aligner.clouds.len(), of_clip)
    }

    /// All links with their refined distances, closest first.
    fn sorted(&self, found: &[Vec<Vec<Candidate>>]) -> Vec<Candidate> {
        let refined = in_parallel(self.source.settings.threads, found.len(), |clip| {
            let links = found[clip].iter().flatten();
            links.filter_map(|&link| self.refined(link)).collect()
        });
        let mut found: Vec<Candidate> = { refined.into_iter() }
            .flat_map(|links: Vec<_>| links)
            .collect();
        // The sort is stable, so that ties keep the order of clips and frames.
        found.sort_by(|a, b| a.cost.total_cmp(&b.cost).then(a.event.cmp(&b.event)));
        found
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
