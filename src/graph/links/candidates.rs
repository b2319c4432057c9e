//! Which links could be made, and how good each would be.

use super::{Lengths, LinkSource, rooms::Rooms};
use std::borrow::Cow;

use crate::graph::distance::{DistanceMap, WindowPair, Windows};
use crate::graph::moments::Moments;
use crate::graph::{GraphEvent, PointCloud, Transition};
use crate::math::in_parallel;

/// A link that could be made.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) link: Transition,
    /// Position of the event that it leads to or comes from.
    pub(super) event: usize,
    /// Its distance, more where its blend is shorter than the graph's window; metres.
    pub(super) strain: f32,
}

/// On which side of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// Before its first frame: links lead there.
    Before,
    /// After its last frame: links start there.
    After,
}

/// The short stretch beside an event where links end or start.
struct Stretch {
    event: usize,
    side: Side,
    /// The stretch's own points, windows of `window` frames.
    windows: Windows,
    window: usize,
    /// Frame of the clip where the stretch's first window starts.
    start: usize,
}

/// Finds candidates.
pub(super) struct Candidates<'a> {
    source: LinkSource<'a>,
    pub(super) lengths: Lengths,
    moments: Moments,
    rooms: Rooms,
}

impl<'a> Candidates<'a> {
    pub(super) fn new(source: LinkSource<'a>, lengths: Lengths) -> Self {
        let moments = Moments::new(source.clouds.iter().map(PointCloud::frames));
        let rooms = Rooms::new(&moments, source.clouds, source.events);
        Self {
            source,
            lengths,
            moments,
            rooms,
        }
    }

    /// Frames that a blend beside an event can use.
    pub(super) fn room(&self, event: usize, side: Side) -> usize {
        let event = &self.source.events[event];
        match side {
            Side::Before => self.rooms.before(self.moment(event, event.first)),
            Side::After => self.rooms.after(self.moment(event, event.last)),
        }
    }

    /// For each of `events` the closest links on one side, one for each stretch of `spread` frames
    /// of each clip at most, the closest first. Only moments that `allowed` holds are linked;
    /// `None` for all.
    pub(super) fn find(
        &self,
        events: &[usize],
        side: Side,
        allowed: Option<&[bool]>,
    ) -> Vec<Candidate> {
        let stretches: Vec<Stretch> = events
            .iter()
            .filter_map(|&event| self.stretch(event, side))
            .collect();
        let clips = self.source.clouds.len();
        let found = in_parallel(
            self.source.settings.threads,
            stretches.len() * clips,
            |job| self.between(&stretches[job / clips], job % clips, allowed),
        );
        let mut found: Vec<Candidate> = found.into_iter().flatten().collect();
        // Stable, so that of equal ones the first event's, clip's and frame's comes first.
        found.sort_by(|a, b| a.strain.total_cmp(&b.strain));
        found
    }

    fn moment(&self, event: &GraphEvent, frame: u32) -> u32 {
        self.moments.at(event.clip.index(), frame as usize)
    }

    /// `None` where the shortest blend does not fit beside the event.
    fn stretch(&self, index: usize, side: Side) -> Option<Stretch> {
        let event = &self.source.events[index];
        let room = self.room(index, side);
        let window = self.lengths.window.min(room);
        if window < self.lengths.shortest || event.first == event.last {
            return None;
        }
        let lead = self.lengths.lead.min(room - window);
        let start = match side {
            // The last window ends with the event's first frame.
            Side::Before => event.first as usize + 1 - window - lead,
            // The first window starts after its last frame.
            Side::After => event.last as usize + 1,
        };
        let cloud = &self.source.clouds[event.clip.index()];
        Some(Stretch {
            event: index,
            side,
            windows: Windows::new(&cloud.part(start..start + window + lead), window),
            window,
            start,
        })
    }

    /// The closest link between a stretch and each part of a clip.
    fn between(&self, stretch: &Stretch, clip: usize, allowed: Option<&[bool]>) -> Vec<Candidate> {
        let cloud = &self.source.clouds[clip];
        let own_clip = self.source.events[stretch.event].clip.index();
        let spread = self.lengths.spread;
        let mut best: Vec<Option<Candidate>> = vec![None; cloud.frames().div_ceil(spread)];
        let limit = self.lengths.loosest * self.lengths.loosest;
        let windows = if stretch.window == self.lengths.window {
            Cow::Borrowed(&self.source.windows[clip])
        } else {
            Cow::Owned(Windows::new(cloud, stretch.window))
        };
        DistanceMap::new(&stretch.windows, &windows).for_each_row(|row, squares| {
            let beside = stretch.start + row;
            for (start, &square) in squares.iter().enumerate() {
                let same = clip == own_clip && start.abs_diff(beside) < self.lengths.separation;
                if square > limit || same {
                    continue;
                }
                let Some(found) = self.candidate(stretch, beside, (clip, start), square.sqrt())
                else {
                    continue;
                };
                let far = stretch.far_end(&found.link);
                if allowed.is_some_and(|allowed| !allowed[self.moments.at(clip, far) as usize]) {
                    continue;
                }
                let cell = &mut best[far / spread];
                if cell.is_none_or(|best| found.strain < best.strain) {
                    *cell = Some(found);
                }
            }
        });
        best.into_iter()
            .flatten()
            .filter_map(|candidate| self.settled(candidate, stretch.window))
            .collect()
    }

    /// The link between the window beside an event that starts at frame `beside` and the one that
    /// starts at frame `start` of a clip, if there is room for it and it is close enough.
    fn candidate(
        &self,
        stretch: &Stretch,
        beside: usize,
        (clip, start): (usize, usize),
        distance: f32,
    ) -> Option<Candidate> {
        let own_clip = self.source.events[stretch.event].clip.index();
        let ((source_clip, source_start), (target_clip, target_start)) = match stretch.side {
            Side::Before => ((clip, start), (own_clip, beside)),
            Side::After => ((own_clip, beside), (clip, start)),
        };
        let source_frame = source_start.checked_sub(1)?;
        let target_frame = target_start + stretch.window - 1;
        let room = self
            .rooms
            .after(self.moments.at(source_clip, source_frame))
            .min(
                self.rooms
                    .before(self.moments.at(target_clip, target_frame)),
            );
        let frames = self.lengths.blend(distance, room)?;
        let strain = self.lengths.strain(distance, frames);
        let link = Transition {
            source_clip,
            source_frame,
            target_clip,
            target_frame,
            frames,
            distance,
        };
        (strain <= self.lengths.loosest).then_some(Candidate {
            link,
            event: stretch.event,
            strain,
        })
    }

    /// With the distance of the windows that are really blended; `None` where that is too large.
    fn settled(&self, mut candidate: Candidate, compared: usize) -> Option<Candidate> {
        let link = &mut candidate.link;
        if link.frames != compared {
            link.distance = WindowPair {
                a: &self.source.clouds[link.source_clip],
                start_a: link.source_frame + 1,
                b: &self.source.clouds[link.target_clip],
                start_b: link.target_frame + 1 - link.frames,
                frames: link.frames,
            }
            .distance();
            candidate.strain = self.lengths.strain(link.distance, link.frames);
        }
        (candidate.strain <= self.lengths.loosest).then_some(candidate)
    }
}

impl Stretch {
    /// The frame of a link's other end, away from the event.
    fn far_end(&self, link: &Transition) -> usize {
        match self.side {
            Side::Before => link.source_frame,
            Side::After => link.target_frame,
        }
    }
}
