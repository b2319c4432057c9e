//! The closest links of one event, without most of the distances: lower bounds show which windows are farther apart than the links that
//! were found before.

use std::cmp::Ordering;
use std::sync::OnceLock;

use super::candidate::Candidate;
use super::margin::{EventMargin, Side};
use super::parts::{ClipParts, RangeSearch};
use super::space::LinkSpace;
use crate::graph::PointCloud;
use crate::graph::distance::{Compared, DiagonalRows, Diagonals, Windows};
use crate::graph::search::{NearRange, NearWindows, WindowCell};
use crate::math::Isa;

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
pub(super) struct ClipWindows<'a> {
    windows: WindowsOfLength<'a>,
    near: NearWindows,
}

/// A search for the links of one range to one clip.
#[derive(Clone, Copy)]
pub(super) struct ClipSearch<'a> {
    pub(super) search: RangeSearch<'a>,
    /// The range of `search`, prepared by [`ClipWindows::range`].
    pub(super) range: &'a NearRange,
    pub(super) clip: usize,
    /// Cost above which links are of no use.
    pub(super) limit: f32,
}

/// A prepared range, and its links that were found so far.
struct OpenRange<'a> {
    search: RangeSearch<'a>,
    range: NearRange,
    found: Vec<Candidate>,
}

/// Scratch of a search.
#[derive(Default)]
pub(super) struct Scratch {
    diagonals: Diagonals,
    near: Vec<WindowCell>,
    rows: Vec<u32>,
    /// Near pairs and their squared distances.
    squares: Vec<(WindowCell, f32)>,
}

impl<'a> ClipWindows<'a> {
    pub(super) fn new(space: &LinkSpace<'a>, length: usize) -> Self {
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
    pub(super) fn prepare(&self, clip: usize) {
        self.near.clip(clip, self.windows.of(clip));
    }

    /// The closest links of some ranges, at most `most` of each. All ranges are compared with one clip before the next, so that its windows
    /// stay in the cache.
    pub(super) fn links(&self, ranges: Vec<RangeSearch<'_>>, most: usize) -> Vec<Vec<Candidate>> {
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
    pub(super) fn range(&self, margin: &EventMargin) -> NearRange {
        self.near.range(&margin.windows)
    }

    /// The closest link of a range to each part of a clip. Links that cost more than the limit may be missing; the list is empty if all are.
    pub(super) fn near(
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
    pub(super) fn of(&self, clip: usize) -> &Windows {
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
