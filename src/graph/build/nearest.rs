//! The closest links between the ranges beside events and all clips: one search, for the links that lead to evasions and for those that keep
//! an event in the graph.
//!
//! ```text
//! for each clip, for each range:
//!     limit = the furthest link that is still kept
//!     pairs = pairs of windows that no lower bound shows to be farther apart than the limit
//!     keep the closest link of each part of the clip, and of those the closest ones
//! ```
//! The bounds are those of the search for transitions ([`projection`](crate::graph::search::projection)).

use crate::graph::build::candidates::{
    Candidate, EventMargin, LinkSpace, MOST, Side, keep_closest,
};
use crate::graph::search::diagonal::Diagonals;
use crate::graph::search::features::{Features, NearSearch, WindowCell};
use crate::graph::search::projection::Projection;
use crate::graph::search::windows::Windows;
use crate::graph::watch::{BakeStage, Stopped};
use crate::math::{Isa, in_parallel};
use rustc_hash::FxHashMap;
use std::borrow::Cow;

pub(crate) struct Candidates<'a> {
    pub(crate) space: LinkSpace<'a>,
    /// Windows of all clips, by their length.
    windows: FxHashMap<usize, ClipWindows<'a>>,
}

impl<'a> Candidates<'a> {
    pub(crate) fn new(space: LinkSpace<'a>) -> Self {
        Self {
            space,
            windows: FxHashMap::default(),
        }
    }

    /// Creates the windows of all clips for the window lengths of some ranges.
    fn make_windows<'m>(&mut self, ranges: impl Iterator<Item = &'m EventMargin>) {
        for EventMargin { window, .. } in ranges {
            if !self.windows.contains_key(window) {
                let windows = ClipWindows::new(&self.space, *window);
                self.windows.insert(*window, windows);
            }
        }
    }

    /// Frees the memory of the windows. They are created again when needed.
    pub(crate) fn forget_windows(&mut self) {
        self.windows.clear();
    }

    /// Finds the closest links of `events` on one side, closest first. `events` are in ascending order. At most one link of each event is
    /// kept in each `spread` frames of a clip, and at most the [`MOST`] closest links of all events. Only moments that `allowed` contains are
    /// linked; `None` allows all moments.
    pub(crate) fn find(
        &mut self,
        events: &[usize],
        side: Side,
        allowed: Option<&[bool]>,
    ) -> Result<Vec<Candidate>, Stopped> {
        let margins: Vec<EventMargin> = events
            .iter()
            .filter_map(|&event| self.space.margin(event, side))
            .collect();
        self.make_windows(margins.iter());
        let this = &*self;
        let input = this.space.input;
        let (watch, threads) = (input.watch, input.settings.threads);
        let ranges = in_parallel(threads, margins.len(), |index| {
            RangeSearch::new(this, &margins[index], allowed)
        });
        let stage = watch.stage(BakeStage::Links, threads);
        let found = stage.in_parallel(input.clouds.len(), |clip| {
            closest_of_parts(&ranges, &this.space, clip)
        });
        watch.check()?;
        let refined = in_parallel(threads, found.len(), |clip| -> Vec<Candidate> {
            let links = found[clip].iter().flatten();
            links.filter_map(|&link| this.space.refined(link)).collect()
        });
        let mut found: Vec<Candidate> = refined.into_iter().flatten().collect();
        // The sort is stable, so that ties keep the order of clips and frames.
        found.sort_by(Candidate::closest_first);
        Ok(found)
    }

    /// Finds the links of each event with the closest windows, closest first, without refining their distances. An event has at most one link
    /// in each `spread` frames of a clip. Only moments that `allowed` contains are linked.
    pub(crate) fn nearest(
        &mut self,
        events: &[usize],
        side: Side,
        allowed: &[bool],
        most: usize,
    ) -> Result<Vec<Vec<Candidate>>, Stopped> {
        /// Number of ranges that are compared with one clip before the next clip.
        const TOGETHER: usize = 32;
        let margins: Vec<Option<EventMargin>> = events
            .iter()
            .map(|&event| self.space.margin(event, side))
            .collect();
        self.make_windows(margins.iter().flatten());
        let this = &*self;
        let input = this.space.input;
        let parts: Vec<&[Option<EventMargin>]> = margins.chunks(TOGETHER).collect();
        let stage = input.watch.stage(BakeStage::Joins, input.settings.threads);
        let found = stage.in_parallel(parts.len(), |part| {
            let range = |margin| RangeSearch::new(this, margin, Some(allowed));
            let ranges = parts[part].iter().map(|it| it.as_ref().map(range));
            closest_of_ranges(ranges.collect(), input.clouds.len(), most)
        });
        input.watch.check()?;
        Ok(found.into_iter().flatten().collect())
    }
}

/// The closest links of all ranges to each part of a clip.
fn closest_of_parts(
    ranges: &[RangeSearch<'_>],
    space: &LinkSpace<'_>,
    clip: usize,
) -> Vec<Vec<Candidate>> {
    let (frames, loosest) = (space.input.clouds[clip].frames(), space.lengths.loosest);
    let mut parts: Vec<Vec<Candidate>> = vec![Vec::new(); frames.div_ceil(space.lengths.spread)];
    let mut scratch = Scratch::default();
    for range in ranges {
        // No link beyond the furthest one of all parts is kept.
        let furthest = parts.iter().map(|part| match part.last() {
            Some(last) if part.len() == MOST => last.cost,
            _ => loosest,
        });
        let limit = furthest.fold(0.0, f32::max);
        let found = range.near(clip, limit, &mut scratch);
        for (part, found) in parts.iter_mut().zip(found) {
            if let Some(found) = found {
                part.push(found);
                keep_closest(part);
            }
        }
    }
    parts
}

/// The closest links of each range, at most `most`, and none where there is no range. All ranges are compared with one clip before the next, so
/// that its windows stay in the cache.
fn closest_of_ranges(
    ranges: Vec<Option<RangeSearch<'_>>>,
    clips: usize,
    most: usize,
) -> Vec<Vec<Candidate>> {
    let mut all: Vec<Vec<Candidate>> = vec![Vec::new(); ranges.len()];
    let mut scratch = Scratch::default();
    for clip in 0..clips {
        for (range, found) in ranges.iter().zip(&mut all) {
            let Some(range) = range else { continue };
            let limit = match found.last() {
                Some(last) if found.len() == most => last.cost,
                _ => range.space.lengths.loosest,
            };
            let near = range.near(clip, limit, &mut scratch).into_iter().flatten();
            let before = found.len();
            found.extend(near.filter(|candidate| candidate.cost <= limit));
            if found.len() > before {
                // Ties are decided by clip and frame of the far end.
                let far = |candidate: &Candidate| {
                    let link = &candidate.link;
                    match range.margin.side {
                        Side::Before => (link.source_clip, link.source_frame),
                        Side::After => (link.target_clip, link.target_frame),
                    }
                };
                found.sort_by(|a, b| a.cost.total_cmp(&b.cost).then_with(|| far(a).cmp(&far(b))));
                found.truncate(most);
            }
        }
    }
    all
}

/// Windows of one length of all clips, and their bounds.
struct ClipWindows<'a> {
    /// The windows of each clip: the graph's own, or made for links that are shorter.
    windows: Cow<'a, [Windows]>,
    /// The projection of all windows, and the distance for which their balls are made, in metres.
    projection: Projection,
    least: f32,
    /// The projected windows of each clip.
    features: Vec<Features>,
}

impl<'a> ClipWindows<'a> {
    fn new(space: &LinkSpace<'a>, length: usize) -> Self {
        /// Number of clips that the bounds are chosen for.
        const SAMPLES: usize = 64;
        let (input, lengths) = (space.input, &space.lengths);
        let clips = input.clouds.len();
        let windows: Cow<'a, [Windows]> = match length == lengths.window {
            true => Cow::Borrowed(&input.windows),
            false => Cow::Owned(in_parallel(input.settings.threads, clips, |clip| {
                Windows::new(&input.clouds[clip], length)
            })),
        };
        let step = clips.div_ceil(SAMPLES).max(1);
        let samples: Vec<&Windows> = windows.iter().step_by(step).collect();
        let projection = Projection::new(&samples);
        let least = lengths.threshold.min(lengths.loosest);
        let features = in_parallel(input.settings.threads, clips, |clip| {
            Features::new(&projection, &windows[clip], least)
        });
        Self {
            windows,
            projection,
            least,
            features,
        }
    }
}

struct RangeSearch<'a> {
    space: &'a LinkSpace<'a>,
    margin: &'a EventMargin,
    /// Moments that may be linked, or `None` if all may be.
    allowed: Option<&'a [bool]>,
    windows: &'a ClipWindows<'a>,
    features: Features,
}

#[derive(Default)]
struct Scratch {
    diagonals: Diagonals,
    near: Vec<WindowCell>,
    /// Near pairs and their squared distances.
    squares: Vec<(WindowCell, f32)>,
}

impl<'a> RangeSearch<'a> {
    fn new(
        candidates: &'a Candidates<'a>,
        margin: &'a EventMargin,
        allowed: Option<&'a [bool]>,
    ) -> Self {
        let windows = &candidates.windows[&margin.window];
        Self {
            space: &candidates.space,
            margin,
            allowed,
            windows,
            features: Features::new(&windows.projection, &margin.windows, windows.least),
        }
    }

    /// The closest link to each part of a clip. Links that cost more than the limit may be missing; the list is empty if all are. Its distance
    /// is that of the windows, even if the blend has another length.
    fn near(&self, clip: usize, limit: f32, scratch: &mut Scratch) -> Vec<Option<Candidate>> {
        let (own, windows) = (&self.margin.windows, &self.windows.windows[clip]);
        let search = NearSearch {
            features: [&self.features, &self.windows.features[clip]],
            limit: limit * limit,
            // A small addition covers rounding.
            beyond: (limit - self.windows.least).max(0.0) + 1e-5 * limit,
            gap: None,
            columns: windows.count(),
        };
        scratch.near.clear();
        Isa::best().run(
            #[inline(always)]
            || search.find(0..own.count(), &mut scratch.near),
        );
        if scratch.near.is_empty() {
            return Vec::new();
        }
        let (near, squares) = (&mut scratch.near, &mut scratch.squares);
        squares.clear();
        let diagonals = &mut scratch.diagonals;
        diagonals.for_each([own, windows], Isa::best(), 0..own.count(), near, |pair| {
            squares.push(pair);
        });
        // The order of a distance map.
        squares.sort_unstable_by_key(|(cell, _)| *cell);
        let mut best = self.no_links(clip);
        for &(cell, square) in &*squares {
            self.take(clip, cell, square, &mut best);
        }
        best
    }

    fn no_links(&self, clip: usize) -> Vec<Option<Candidate>> {
        let frames = self.space.input.clouds[clip].frames();
        vec![None; frames.div_ceil(self.space.lengths.spread)]
    }

    /// Takes a window of the range and one of a clip, whose squared distance is `square`, if they are the closest of a part.
    fn take(&self, clip: usize, cell: WindowCell, square: f32, best: &mut [Option<Candidate>]) {
        let (space, margin) = (self.space, self.margin);
        let lengths = &space.lengths;
        let (beside, start) = (margin.start + cell.row as usize, cell.column as usize);
        let is_own = || space.events[margin.event].clip.index() == clip;
        let is_same = || start.abs_diff(beside) < lengths.separation && is_own();
        if square > lengths.loosest * lengths.loosest || is_same() {
            return;
        }
        let Some(far) = margin.side.far_end(start, margin.window) else {
            return;
        };
        let moment = || space.moments.at(clip, far) as usize;
        if self.allowed.is_some_and(|allowed| !allowed[moment()]) {
            return;
        }
        // A link's cost is at least its distance.
        let distance = square.sqrt();
        let best = &mut best[far / lengths.spread];
        if best.is_some_and(|best| distance >= best.cost) {
            return;
        }
        let found = space.candidate(margin, clip, cell, distance);
        if let Some(found) = found
            && best.is_none_or(|best| found.cost < best.cost)
        {
            *best = Some(found);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anim::Clip;
    use crate::graph::build::input::GraphBuilder;
    use crate::graph::search::distance::DistanceMap;
    use crate::graph::search::transition::Transition;
    use crate::graph::settings::{ClipSource, GraphSettings, LinkSettings};
    use sabaki_fixtures::clips::{evasion, small_skeleton, swinging_clip};

    const FRAMES: usize = 150;

    /// Calls `test` with the candidates of five clips and of `copies` times five events: some with enough free frames beside them for windows
    /// of full length, some with fewer.
    fn with_candidates(copies: u32, test: impl Fn(Candidates<'_>)) {
        let skeleton = small_skeleton();
        let clip = |seed| swinging_clip(&skeleton, FRAMES, seed as f32);
        let clips: Vec<Clip> = (0..5).map(clip).collect();
        let events = [
            (0, 40, 60),
            (1, 30, 50),
            (1, 57, 70),
            (3, 80, 100),
            (3, 106, 120),
        ];
        let seconds = |frame: i32| f64::from(frame) / 30.0;
        let events = events.map(|(clip, first, last)| evasion(clip, seconds(first), seconds(last)));
        let source = ClipSource {
            skeleton: &skeleton,
            clips: &clips,
            events: &events,
        };
        let settings = GraphSettings::default();
        let input = GraphBuilder::new(source, &settings).unwrap();
        let mut space = LinkSpace::new(&input, &LinkSettings::default());
        // Each event several times, so that parts have more than they keep.
        space.events = (0..copies).flat_map(|_| space.events.clone()).collect();
        test(Candidates::new(space));
    }

    /// The closest link to each part of a clip, from the distances of all windows.
    fn of_all_windows(range: &RangeSearch<'_>, clip: usize) -> Vec<Option<Candidate>> {
        let mut best = range.no_links(clip);
        let windows = &range.windows.windows[clip];
        DistanceMap::new(&range.margin.windows, windows).for_each_row(|row, squares| {
            for (column, &square) in (0..).zip(squares) {
                let row = row as u32;
                range.take(clip, WindowCell { row, column }, square, &mut best);
            }
        });
        best
    }

    fn key(it: &Candidate) -> (Transition, usize, u32) {
        (it.link, it.event, it.cost.to_bits())
    }

    #[test]
    fn bounds_leave_out_no_link_of_a_part() {
        with_candidates(8, |mut candidates| {
            let margins: Vec<EventMargin> = (0..candidates.space.events.len())
                .filter_map(|event| candidates.space.margin(event, Side::Before))
                .collect();
            candidates.make_windows(margins.iter());
            let range = |margin| RangeSearch::new(&candidates, margin, None);
            let ranges: Vec<RangeSearch<'_>> = margins.iter().map(range).collect();
            let keys = |parts: Vec<Vec<Candidate>>| -> Vec<Vec<_>> {
                let of_part = |part: &Vec<Candidate>| part.iter().map(key).collect();
                parts.iter().map(of_part).collect()
            };
            let (mut full, mut partly) = (0, 0);
            for clip in 0..candidates.space.input.clips.len() {
                let found = closest_of_parts(&ranges, &candidates.space, clip);
                let mut expected = vec![Vec::new(); found.len()];
                for range in &ranges {
                    for (part, found) in expected.iter_mut().zip(of_all_windows(range, clip)) {
                        part.extend(found);
                    }
                }
                expected.iter_mut().for_each(keep_closest);
                let expected = keys(expected);
                full += expected.iter().filter(|part| part.len() == MOST).count();
                partly += expected.iter().filter(|part| part.len() < MOST).count();
                assert!(keys(found) == expected, "clip {clip}");
            }
            assert!(
                full > 10 && partly > 0,
                "{full} full parts, {partly} others"
            );
        });
    }

    #[test]
    fn bounds_leave_out_no_link() {
        with_candidates(1, |mut candidates| {
            let all: Vec<usize> = (0..candidates.space.events.len()).collect();
            let clips = candidates.space.input.clips.len();
            let allowed: Vec<bool> = (0..clips * FRAMES).map(|moment| moment % 7 != 3).collect();
            let mut lengths = std::collections::BTreeSet::new();
            for side in [Side::Before, Side::After] {
                let margins: Vec<Option<EventMargin>> = all
                    .iter()
                    .map(|&event| candidates.space.margin(event, side))
                    .collect();
                candidates.make_windows(margins.iter().flatten());
                let mut naive = |margin: &EventMargin| {
                    let range = RangeSearch::new(&candidates, margin, Some(&allowed));
                    let of_clips = (0..clips).map(|clip| of_all_windows(&range, clip));
                    let mut expected: Vec<Candidate> = of_clips.flatten().flatten().collect();
                    expected.sort_by(|a, b| a.cost.total_cmp(&b.cost));
                    lengths.insert(margin.window);
                    expected
                };
                let expected: Vec<Vec<Candidate>> = margins
                    .iter()
                    .map(|margin| margin.as_ref().map_or(Vec::new(), &mut naive))
                    .collect();
                assert!(expected.iter().any(|links| links.len() > 20));
                for most in [1, 3, 16, usize::MAX] {
                    let found = candidates.nearest(&all, side, &allowed, most).unwrap();
                    for (found, expected) in found.iter().zip(&expected) {
                        let expected = expected.iter().take(most).map(key);
                        assert!(found.iter().map(key).eq(expected), "{most}");
                    }
                }
            }
            assert!(lengths.len() > 1, "no range is short: {lengths:?}");
        });
    }
}
