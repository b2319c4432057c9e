//! The closest links of one event, without most of the distances: lower bounds show which windows are farther apart than the links that
//! were found before.

use crate::graph::build::candidates::{
    Candidate, EventMargin, Lengths, LinkSource, LinkSpace, MOST, Side, WindowPair, keep_closest,
};
use crate::graph::search::cloud::PointCloud;
use crate::graph::search::diagonal::{Compared, DiagonalRows, Diagonals};
use crate::graph::search::distance::DistanceMap;
use crate::graph::search::near::{NearRange, NearWindows, WindowCell};
use crate::graph::search::windows::Windows;
use crate::graph::watch::{BakeStage, Stopped};
use crate::math::{Isa, in_parallel, sort_rarely};
use rustc_hash::FxHashMap;
use std::cmp::Ordering;
use std::sync::OnceLock;

/// Windows of one length of all clips. Those of a clip are created when it is first searched.
struct WindowsOfLength<'a> {
    clouds: &'a [PointCloud],
    length: usize,
    /// Windows of all clips, if the graph has them of this length.
    own: Option<&'a [Windows]>,
    made: Vec<OnceLock<Windows>>,
}

impl WindowsOfLength<'_> {
    fn of(&self, clip: usize) -> &Windows {
        match self.own {
            Some(own) => &own[clip],
            None => self.made[clip].get_or_init(|| Windows::new(&self.clouds[clip], self.length)),
        }
    }
}

/// Windows of one length of all clips, and their bounds.
pub(crate) struct ClipWindows<'a> {
    windows: WindowsOfLength<'a>,
    near: NearWindows,
}

/// A search for the links of one range to one clip.
#[derive(Clone, Copy)]
pub(crate) struct ClipSearch<'a> {
    pub(crate) search: RangeSearch<'a>,
    /// The range of `search`, prepared by [`ClipWindows::range`].
    pub(crate) range: &'a NearRange,
    pub(crate) clip: usize,
    /// Cost above which links are of no use.
    pub(crate) limit: f32,
}

/// A prepared range, and its links that were found so far.
struct OpenRange<'a> {
    search: RangeSearch<'a>,
    range: NearRange,
    found: Vec<Candidate>,
}

/// Scratch of a search.
#[derive(Default)]
pub(crate) struct Scratch {
    diagonals: Diagonals,
    near: Vec<WindowCell>,
    rows: Vec<u32>,
    /// Near pairs and their squared distances.
    squares: Vec<(WindowCell, f32)>,
}

impl<'a> ClipWindows<'a> {
    pub(crate) fn new(space: &LinkSpace<'a>, length: usize) -> Self {
        /// Number of clips that the bounds are chosen for.
        const SAMPLES: usize = 64;
        let (source, lengths) = (&space.source, &space.lengths);
        let clips = source.aligner.clouds.len();
        let windows = WindowsOfLength {
            clouds: source.aligner.clouds,
            length,
            own: (length == lengths.window).then_some(source.windows),
            made: (0..clips).map(|_| OnceLock::new()).collect(),
        };
        let step = clips.div_ceil(SAMPLES).max(1);
        let samples: Vec<&Windows> = (0..clips)
            .step_by(step)
            .map(|clip| windows.of(clip))
            .collect();
        let least = lengths.threshold.min(lengths.loosest);
        Self {
            near: NearWindows::new(&samples, clips, least),
            windows,
        }
    }

    /// Prepares the windows of a clip, which is otherwise done when it is first searched.
    pub(crate) fn prepare(&self, clip: usize) {
        self.near.clip(clip, self.windows.of(clip));
    }

    /// The closest links of some ranges, at most `most` of each. All ranges are compared with one clip before the next, so that its windows
    /// stay in the cache.
    pub(crate) fn links(&self, ranges: Vec<RangeSearch<'_>>, most: usize) -> Vec<Vec<Candidate>> {
        let open = ranges.into_iter().map(|search| OpenRange {
            range: self.range(search.margin),
            found: Vec::new(),
            search,
        });
        let mut open: Vec<OpenRange<'_>> = open.collect();
        let mut scratch = Scratch::default();
        for clip in 0..self.windows.made.len() {
            for range in &mut open {
                let (found, side) = (&mut range.found, range.search.margin.side);
                let limit = match found.last() {
                    Some(last) if found.len() == most => last.cost,
                    _ => range.search.space.lengths.loosest,
                };
                let search = ClipSearch {
                    search: range.search,
                    range: &range.range,
                    clip,
                    limit,
                };
                let near = self.near(search, &mut scratch);
                let before = found.len();
                let near = near.into_iter().flatten();
                found.extend(near.filter(|candidate| candidate.cost <= limit));
                if found.len() > before {
                    found.sort_by(|a, b| order(a, b, side));
                    found.truncate(most);
                }
            }
        }
        open.into_iter().map(|range| range.found).collect()
    }

    /// Prepares a range.
    pub(crate) fn range(&self, margin: &EventMargin) -> NearRange {
        self.near.range(&margin.windows)
    }

    /// The closest link of a range to each part of a clip. Links that cost more than the limit may be missing; the list is empty if all are.
    pub(crate) fn near(
        &self,
        near: ClipSearch<'_>,
        scratch: &mut Scratch,
    ) -> Vec<Option<Candidate>> {
        let ClipSearch {
            search,
            range,
            clip,
            limit,
        } = near;
        let (own, windows) = (&search.margin.windows, self.windows.of(clip));
        scratch.near.clear();
        range.find(self.near.clip(clip, windows), limit, &mut scratch.near);
        if scratch.near.is_empty() {
            return Vec::new();
        }
        scratch.diagonals.load(own, 0..own.count());
        scratch.measure(Compared {
            a: own,
            b: windows,
            isa: Isa::best(),
        });
        let mut parts = ClipParts::new(search, clip);
        for &(cell, square) in &scratch.squares {
            parts.take(cell, square);
        }
        parts.best
    }

    /// The windows of a clip.
    pub(crate) fn of(&self, clip: usize) -> &Windows {
        self.windows.of(clip)
    }
}

/// Orders links by cost. Ties are decided by clip and frame of their far end.
fn order(a: &Candidate, b: &Candidate, side: Side) -> Ordering {
    let far = |candidate: &Candidate| {
        let link = &candidate.link;
        match side {
            Side::Before => (link.source_clip, link.source_frame),
            Side::After => (link.target_clip, link.target_frame),
        }
    };
    a.cost.total_cmp(&b.cost).then_with(|| far(a).cmp(&far(b)))
}

impl Scratch {
    /// Computes the squared distances of the near pairs, in the order of a distance map.
    fn measure(&mut self, compared: Compared<'_>) {
        let Self {
            diagonals,
            near,
            rows,
            squares,
        } = self;
        squares.clear();
        let shift = |cell: &WindowCell| cell.column as isize - cell.row as isize;
        near.sort_unstable_by_key(|cell| (shift(cell), cell.row));
        for cells in near.chunk_by(|a, b| shift(a) == shift(b)) {
            let shift = shift(&cells[0]);
            rows.clear();
            rows.extend(cells.iter().map(|cell| cell.row));
            diagonals.for_each(compared, DiagonalRows { rows, shift }, |row, square| {
                let cell = WindowCell {
                    row: row as u32,
                    column: (row as isize + shift) as u32,
                };
                squares.push((cell, square));
            });
        }
        squares.sort_unstable_by_key(|(cell, _)| *cell);
    }
}

// The closest link of a range in each part of a clip.

/// A search for the links of one range.
#[derive(Clone, Copy)]
pub(crate) struct RangeSearch<'a> {
    pub(crate) space: &'a LinkSpace<'a>,
    pub(crate) margin: &'a EventMargin,
    /// Moments that may be linked, or `None` if all may be.
    pub(crate) allowed: Option<&'a [bool]>,
}

impl RangeSearch<'_> {
    /// Closest link to each part of a clip, given the clip's windows of the range's length. Its distance is that of the windows, even if
    /// the blend has another length.
    pub(crate) fn between(self, clip: usize, windows: &Windows) -> Vec<Option<Candidate>> {
        let mut parts = ClipParts::new(self, clip);
        DistanceMap::new(&self.margin.windows, windows).for_each_row(|row, squares| {
            for (column, &square) in (0..).zip(squares) {
                let row = row as u32;
                parts.take(WindowCell { row, column }, square);
            }
        });
        parts.best
    }
}

/// The closest links between a range and the parts of a clip, as window pairs come in.
pub(crate) struct ClipParts<'a> {
    search: RangeSearch<'a>,
    clip: usize,
    /// Whether the window pairs are from one clip.
    is_own: bool,
    /// Closest link of each part. Its distance is that of the windows, even if the blend has another length.
    pub(crate) best: Vec<Option<Candidate>>,
}

impl<'a> ClipParts<'a> {
    pub(crate) fn new(search: RangeSearch<'a>, clip: usize) -> Self {
        let RangeSearch { space, margin, .. } = search;
        let frames = space.source.aligner.clouds[clip].frames();
        Self {
            is_own: space.source.events[margin.event].clip.index() == clip,
            best: vec![None; frames.div_ceil(space.lengths.spread)],
            search,
            clip,
        }
    }

    /// Takes a window of the range and one of the clip, whose squared distance is `square`.
    pub(crate) fn take(&mut self, cell: WindowCell, square: f32) {
        let RangeSearch {
            space,
            margin,
            allowed,
        } = self.search;
        let lengths = &space.lengths;
        let (beside, start) = (margin.start + cell.row as usize, cell.column as usize);
        let is_same = self.is_own && start.abs_diff(beside) < lengths.separation;
        if square > lengths.loosest * lengths.loosest || is_same {
            return;
        }
        let Some(far) = margin.side.far_end(start, margin.window) else {
            return;
        };
        let moment = || space.moments.at(self.clip, far) as usize;
        if allowed.is_some_and(|allowed| !allowed[moment()]) {
            return;
        }
        // A link's cost is at least its distance.
        let distance = square.sqrt();
        let best = &mut self.best[far / lengths.spread];
        if best.is_some_and(|best| distance >= best.cost) {
            return;
        }
        let pair = WindowPair {
            beside,
            clip: self.clip,
            start,
            distance,
        };
        let found = space.candidate(margin, pair);
        if let Some(found) = found
            && best.is_none_or(|best| found.cost < best.cost)
        {
            *best = Some(found);
        }
    }
}

// Finds possible links and rates them.

/// Finds possible links.
pub(crate) struct Candidates<'a> {
    pub(crate) space: LinkSpace<'a>,
    /// Windows of all clips, by their length.
    windows: FxHashMap<usize, ClipWindows<'a>>,
}

impl<'a> Candidates<'a> {
    pub(crate) fn new(source: LinkSource<'a>, lengths: Lengths) -> Self {
        Self {
            space: LinkSpace::new(source, lengths),
            windows: FxHashMap::default(),
        }
    }

    /// Creates the windows of all clips for the window lengths of some ranges.
    pub(crate) fn make_windows<'m>(&mut self, ranges: impl Iterator<Item = &'m EventMargin>) {
        for EventMargin { window, .. } in ranges {
            if !self.windows.contains_key(window) {
                let windows = ClipWindows::new(&self.space, *window);
                self.windows.insert(*window, windows);
            }
        }
    }

    /// The windows of all clips for a length that [`Candidates::make_windows`] created.
    pub(crate) fn windows(&self, length: usize) -> &ClipWindows<'a> {
        &self.windows[&length]
    }

    /// Frees the memory of the windows. They are created again when needed.
    pub(crate) fn forget_windows(&mut self) {
        self.windows.clear();
    }
}

// Finds the closest links of events.

impl Candidates<'_> {
    /// Finds the closest links of `events` on one side, closest first. `events` are in ascending order. At most one link of each event is
    /// kept in each `spread` frames of a clip, and at most the [`MOST`] closest links of all events. Only moments that `allowed` contains are
    /// linked; `None` allows all moments.
    pub(crate) fn find(
        &mut self,
        events: &[usize],
        side: Side,
        allowed: Option<&[bool]>,
    ) -> Result<Vec<Candidate>, Stopped> {
        let margins = self.margins(events, side);
        let near = NearMargins::new(self, &margins, allowed);
        let LinkSource {
            watch, settings, ..
        } = self.space.source;
        let stage = watch.stage(BakeStage::Links, settings.threads);
        let clips = self.space.source.aligner.clouds.len();
        let found = stage.in_parallel(clips, |clip| near.closest(clip));
        watch.check()?;
        Ok(self.sorted(&found))
    }

    /// The ranges beside events. Creates the windows for them.
    fn margins(&mut self, events: &[usize], side: Side) -> Vec<EventMargin> {
        let margins = events
            .iter()
            .filter_map(|&event| self.space.margin(event, side));
        let margins: Vec<EventMargin> = margins.collect();
        self.make_windows(margins.iter());
        margins
    }

    /// All links with their refined distances, closest first.
    fn sorted(&self, found: &[Vec<Vec<Candidate>>]) -> Vec<Candidate> {
        let refined = in_parallel(self.space.source.settings.threads, found.len(), |clip| {
            let links = found[clip].iter().flatten();
            links.filter_map(|&link| self.space.refined(link)).collect()
        });
        let mut found: Vec<Candidate> = refined
            .into_iter()
            .flat_map(|links: Vec<_>| links)
            .collect();
        // The sort is stable, so that ties keep the order of clips and frames.
        found.sort_by(Candidate::closest_first);
        found
    }
}

// The closest links between some ranges and each part of a clip. Once all parts have the maximum number of close links, lower bounds exclude
// windows that are farther apart than these. Until then all distances are computed, which is faster while most windows are near enough.

/// Ranges beside events, prepared for the search. `candidates` has the windows of their lengths.
pub(crate) struct NearMargins<'a> {
    candidates: &'a Candidates<'a>,
    margins: &'a [EventMargin],
    ranges: Vec<NearRange>,
    /// Moments that may be linked, or `None` if all may be.
    allowed: Option<&'a [bool]>,
}

impl<'a> NearMargins<'a> {
    pub(crate) fn new(
        candidates: &'a Candidates<'a>,
        margins: &'a [EventMargin],
        allowed: Option<&'a [bool]>,
    ) -> Self {
        let threads = candidates.space.source.settings.threads;
        let ranges = in_parallel(threads, margins.len(), |index| {
            let margin = &margins[index];
            candidates.windows(margin.window).range(margin)
        });
        Self {
            candidates,
            margins,
            ranges,
            allowed,
        }
    }

    /// The closest links of all ranges to each part of a clip.
    pub(crate) fn closest(&self, clip: usize) -> Vec<Vec<Candidate>> {
        /// Share of the loosest distance. Below it, bounds exclude most window pairs.
        const BOUNDED: f32 = 0.6;
        let LinkSpace {
            source, lengths, ..
        } = &self.candidates.space;
        let (frames, loosest) = (source.aligner.clouds[clip].frames(), lengths.loosest);
        let mut parts = vec![Vec::new(); frames.div_ceil(lengths.spread)];
        let mut scratch = Scratch::default();
        for (margin, range) in self.margins.iter().zip(&self.ranges) {
            // No link beyond the furthest one of all parts is kept.
            let furthest = parts.iter().map(|part: &Vec<Candidate>| match part.last() {
                Some(last) if part.len() == MOST => last.cost,
                _ => loosest,
            });
            let limit = furthest.fold(0.0, f32::max);
            let search = RangeSearch {
                space: &self.candidates.space,
                margin,
                allowed: self.allowed,
            };
            let windows = self.candidates.windows(margin.window);
            let found = match limit < BOUNDED * loosest {
                true => {
                    let near = ClipSearch {
                        search,
                        range,
                        clip,
                        limit,
                    };
                    windows.near(near, &mut scratch)
                }
                false => search.between(clip, windows.of(clip)),
            };
            for (part, found) in parts.iter_mut().zip(found) {
                if let Some(found) = found {
                    part.push(found);
                    keep_closest(part);
                }
            }
        }
        parts
    }
}

// The closest links of many events.

/// Events, and the side of them on which links are searched.
#[derive(Clone, Copy)]
pub(crate) struct Wanted<'a> {
    /// Indices of the events.
    pub(crate) events: &'a [usize],
    pub(crate) side: Side,
    /// Moments that may be linked.
    pub(crate) allowed: &'a [bool],
    /// Number of links of each event.
    pub(crate) most: usize,
}

/// Finds the links of each event with the closest windows, closest first, without refining their distances. An event has at most one link
/// in each `spread` frames of a clip.
pub(crate) fn nearest(
    candidates: &mut Candidates<'_>,
    wanted: Wanted<'_>,
) -> Result<Vec<Vec<Candidate>>, Stopped> {
    /// Number of ranges that are compared with one clip before the next clip.
    const TOGETHER: usize = 32;
    let margins: Vec<Option<EventMargin>> = wanted
        .events
        .iter()
        .map(|&event| candidates.space.margin(event, wanted.side))
        .collect();
    candidates.make_windows(margins.iter().flatten());
    let candidates = &*candidates;
    let source = &candidates.space.source;
    let (watch, threads) = (source.watch, source.settings.threads);
    let search = |index: usize| {
        Some(RangeSearch {
            space: &candidates.space,
            margin: margins[index].as_ref()?,
            allowed: Some(wanted.allowed),
        })
    };
    let mut found = vec![Vec::new(); margins.len()];
    let of_length =
        |(margin, index): (&Option<EventMargin>, usize)| Some((margin.as_ref()?.window, index));
    let mut by_length: Vec<(usize, usize)> =
        margins.iter().zip(0..).filter_map(of_length).collect();
    sort_rarely(&mut by_length, Ord::cmp);
    for own in by_length.chunk_by(|a, b| a.0 == b.0) {
        let windows = candidates.windows(own[0].0);
        let own: Vec<usize> = own.iter().map(|&(_, index)| index).collect();
        in_parallel(threads, source.aligner.clouds.len(), |clip| {
            windows.prepare(clip);
        });
        let parts: Vec<&[usize]> = own.chunks(TOGETHER).collect();
        let stage = watch.stage(BakeStage::Joins, threads);
        let of_parts = stage.in_parallel(parts.len(), |part| {
            let ranges = parts[part].iter().copied().filter_map(search);
            windows.links(ranges.collect(), wanted.most)
        });
        watch.check()?;
        for (index, links) in own.into_iter().zip(of_parts.into_iter().flatten()) {
            found[index] = links;
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::build::candidates::Side;
    use crate::graph::build::fixture::Scene;
    use crate::graph::search::windows::Windows;

    #[test]
    fn bounds_leave_out_no_link_of_a_part() {
        let mut scene = Scene::new();
        // Each event several times, so that parts have more than they keep.
        scene.events = (0..8).flat_map(|_| scene.events.clone()).collect();
        let mut candidates = scene.candidates();
        let margins: Vec<EventMargin> = (0..scene.events.len())
            .filter_map(|event| candidates.space.margin(event, Side::Before))
            .collect();
        candidates.make_windows(margins.iter());
        let near = NearMargins::new(&candidates, &margins, None);
        let key = |it: &Candidate| (it.link, it.event, it.cost.to_bits());
        let keys = |parts: Vec<Vec<Candidate>>| -> Vec<Vec<_>> {
            let of_part = |part: &Vec<Candidate>| part.iter().map(key).collect();
            parts.iter().map(of_part).collect()
        };
        let (mut full, mut partly) = (0, 0);
        for (clip, cloud) in scene.clouds.iter().enumerate() {
            let mut expected = vec![Vec::new(); near.closest(clip).len()];
            for margin in &margins {
                let search = RangeSearch {
                    space: &candidates.space,
                    margin,
                    allowed: None,
                };
                let found = search.between(clip, &Windows::new(cloud, margin.window));
                for (part, found) in expected.iter_mut().zip(found) {
                    part.extend(found);
                }
            }
            expected.iter_mut().for_each(keep_closest);
            let expected = keys(expected);
            full += expected.iter().filter(|part| part.len() == MOST).count();
            partly += expected.iter().filter(|part| part.len() < MOST).count();
            assert!(keys(near.closest(clip)) == expected, "clip {clip}");
        }
        assert!(
            full > 10 && partly > 0,
            "{full} full parts, {partly} others"
        );
    }
}

#[cfg(test)]
mod links_nearest_tests {
    use super::*;
    use crate::graph::build::fixture::{CLIPS, FRAMES, Scene};
    use crate::graph::search::windows::Windows;

    #[test]
    fn bounds_leave_out_no_link() {
        let scene = Scene::new();
        let mut candidates = scene.candidates();
        let all: Vec<usize> = (0..scene.events.len()).collect();
        let allowed: Vec<bool> = (0..CLIPS * FRAMES).map(|moment| moment % 7 != 3).collect();
        let mut lengths = std::collections::BTreeSet::new();
        for side in [Side::Before, Side::After] {
            let margins = all
                .iter()
                .map(|&event| candidates.space.margin(event, side));
            let mut naive = |margin: EventMargin| {
                let mut expected: Vec<Candidate> = Vec::new();
                for (clip, cloud) in scene.clouds.iter().enumerate() {
                    let windows = Windows::new(cloud, margin.window);
                    let search = RangeSearch {
                        space: &candidates.space,
                        margin: &margin,
                        allowed: Some(&allowed),
                    };
                    let parts = search.between(clip, &windows);
                    expected.extend(parts.into_iter().flatten());
                }
                expected.sort_by(|a, b| a.cost.total_cmp(&b.cost));
                lengths.insert(margin.window);
                expected
            };
            let expected: Vec<Vec<Candidate>> = margins
                .map(|margin| margin.map_or(Vec::new(), &mut naive))
                .collect();
            assert!(expected.iter().any(|links| links.len() > 20));
            for most in [1, 3, 16, usize::MAX] {
                let wanted = Wanted {
                    events: &all,
                    side,
                    allowed: &allowed,
                    most,
                };
                let found = nearest(&mut candidates, wanted).unwrap();
                let key = |it: &Candidate| (it.link, it.event, it.cost.to_bits());
                for (found, expected) in found.iter().zip(&expected) {
                    let expected = expected.iter().take(most).map(key);
                    assert!(found.iter().map(key).eq(expected), "{most}");
                }
            }
        }
        assert!(lengths.len() > 1, "no range is short: {lengths:?}");
    }
}
