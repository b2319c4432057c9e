//! The closest links of many events, without most of the distances: limits are tried one after the other, and lower bounds show which
//! windows are farther apart than a limit.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::candidates::{Candidate, Candidates};
use super::margin::{EventMargin, Side};
use super::parts::ClipParts;
use crate::graph::distance::{Compared, Diagonals, Windows};
use crate::graph::search::{NearWindows, WindowCell};
use crate::math::{Isa, in_parallel};

/// Windows of all clips of one length, and their bounds.
struct ClipWindows<'a> {
    windows: Cow<'a, [Windows]>,
    near: NearWindows,
}

/// Memory of a search.
#[derive(Default)]
struct Scratch {
    diagonals: Diagonals,
    near: Vec<WindowCell>,
    rows: Vec<u32>,
    /// Near pairs and their squared distances.
    squares: Vec<(WindowCell, f32)>,
}

/// Windows of all clips, by their length.
#[derive(Default)]
pub(super) struct NearestLinks<'a>(BTreeMap<usize, ClipWindows<'a>>);

/// Events on one side of which links are searched.
#[derive(Clone, Copy)]
pub(super) struct Wanted<'a> {
    /// Indices of the events.
    pub(super) events: &'a [usize],
    pub(super) side: Side,
    /// Moments that may be linked.
    pub(super) allowed: &'a [bool],
}

impl<'a> NearestLinks<'a> {
    /// Limits that are tried, in metres: each is twice the one before, up to the loosest.
    pub(super) fn limits(candidates: &Candidates<'_>) -> impl Iterator<Item = f32> + use<> {
        let lengths = &candidates.lengths;
        let (least, most) = (lengths.threshold.min(lengths.loosest), lengths.loosest);
        let doubled = std::iter::successors(Some(least), |limit| Some(2.0 * limit));
        doubled
            .take_while(move |limit| *limit < 0.75 * most)
            .chain([most])
    }

    /// Finds the links that cost at most `limit` before they are refined, closest first: in each clip, at most one of each event for
    /// each `spread` frames.
    pub(super) fn within(
        &mut self,
        candidates: &Candidates<'a>,
        wanted: Wanted<'_>,
        limit: f32,
    ) -> Vec<Candidate> {
        let margins = wanted.events.iter();
        let margins: Vec<EventMargin> = margins
            .filter_map(|&event| candidates.margin(event, wanted.side))
            .collect();
        for margin in &margins {
            let of_length = || ClipWindows::new(candidates, margin.window);
            self.0.entry(margin.window).or_insert_with(of_length);
        }
        let threads = candidates.source.settings.threads;
        let found = in_parallel(threads, margins.len(), |index| {
            let margin = &margins[index];
            self.0[&margin.window].links(candidates, (margin, wanted.allowed), limit)
        });
        let mut found: Vec<Candidate> = found.into_iter().flatten().collect();
        found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        found
    }
}

impl<'a> ClipWindows<'a> {
    /// The links of one range.
    fn links(
        &self,
        candidates: &Candidates<'_>,
        (margin, allowed): (&EventMargin, &[bool]),
        limit: f32,
    ) -> Vec<Candidate> {
        let range = self.near.range(&margin.windows);
        let rows = margin.windows.count();
        let mut scratch = Scratch::default();
        scratch.diagonals.load(&margin.windows, 0..rows);
        let mut found = Vec::new();
        for (clip, windows) in self.windows.iter().enumerate() {
            scratch.near.clear();
            let near = &mut scratch.near;
            self.near.find((&range, rows), (clip, limit), near);
            if scratch.near.is_empty() {
                continue;
            }
            let compared = Compared {
                a: &margin.windows,
                b: windows,
                isa: Isa::best(),
            };
            scratch.measure(compared);
            let mut parts = ClipParts::new(candidates, (margin, clip), Some(allowed));
            for &(cell, square) in &scratch.squares {
                parts.take((cell.row as usize, cell.column as usize), square);
            }
            let near = parts.best.into_iter().flatten();
            found.extend(
                near.filter(|candidate| candidate.cost <= limit)
                    .filter_map(|candidate| candidates.refined(candidate, margin.window)),
            );
        }
        found
    }

    fn new(candidates: &Candidates<'a>, length: usize) -> Self {
        let source = &candidates.source;
        let threads = source.settings.threads;
        let windows = match length == candidates.lengths.window {
            true => Cow::Borrowed(source.windows),
            false => Cow::Owned(in_parallel(threads, source.aligner.clouds.len(), |clip| {
                Windows::new(&source.aligner.clouds[clip], length)
            })),
        };
        let lengths = &candidates.lengths;
        let least = lengths.threshold.min(lengths.loosest);
        Self {
            near: NearWindows::new(&windows, least, threads),
            windows,
        }
    }
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
            diagonals.for_each(compared, (rows, shift), |row, square| {
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
