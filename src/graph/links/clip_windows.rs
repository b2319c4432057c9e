//! The closest links of one event, without most of the distances: lower bounds show which windows are farther apart than the links that
//! were found before.

use std::cmp::Ordering;
use std::sync::OnceLock;

use super::candidates::{Candidate, Candidates};
use super::margin::Side;
use super::parts::{ClipParts, RangeSearch};
use crate::graph::PointCloud;
use crate::graph::distance::{Compared, DiagonalRows, Diagonals, Windows};
use crate::graph::search::{NearWindows, WindowCell};
use crate::math::Isa;

/// Windows of one length of all clips, each made when it is first searched.
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

/// Links of one event that are known, and the clips that are searched.
pub(super) struct KnownStart<'a> {
    pub(super) links: Vec<Candidate>,
    pub(super) clips: &'a [usize],
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

impl<'a> ClipWindows<'a> {
    pub(super) fn new(candidates: &Candidates<'a>, length: usize) -> Self {
        /// Number of clips that the bounds are chosen for.
        const SAMPLES: usize = 64;
        let (source, lengths) = (&candidates.source, &candidates.lengths);
        let clips = source.aligner.clouds.len();
        let windows = WindowsOfLength {
            clouds: source.aligner.clouds,
            length,
            own: (length == lengths.window).then_some(source.windows),
            made: (0..clips).map(|_| OnceLock::new()).collect(),
        };
        let step = clips.div_ceil(SAMPLES).max(1);
        let samples: Vec<&Windows> = { (0..clips).step_by(step) }
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

    /// The closest links of one range, at most so many: those that are known, and those to some clips.
    pub(super) fn links(
        &self,
        search: RangeSearch<'_>,
        most: usize,
        start: &KnownStart<'_>,
    ) -> Vec<Candidate> {
        let (margin, mut found) = (search.margin, start.links.clone());
        let limit_of = |found: &[Candidate]| match found.last() {
            Some(last) if found.len() == most => last.cost,
            _ => search.candidates.lengths.loosest,
        };
        let mut limit = limit_of(&found);
        if start.clips.is_empty() {
            return found;
        }
        let range = self.near.range(&margin.windows);
        let mut scratch = Scratch::default();
        scratch
            .diagonals
            .load(&margin.windows, 0..margin.windows.count());
        for &clip in start.clips {
            let windows = self.windows.of(clip);
            scratch.near.clear();
            range.find(self.near.clip(clip, windows), limit, &mut scratch.near);
            if scratch.near.is_empty() {
                continue;
            }
            scratch.measure(Compared {
                a: &margin.windows,
                b: windows,
                isa: Isa::best(),
            });
            let mut parts = ClipParts::new(search, clip);
            for &(cell, square) in &scratch.squares {
                parts.take(cell, square);
            }
            let near = parts.best.into_iter().flatten();
            found.extend(near.filter(|candidate| candidate.cost <= limit));
            found.sort_by(|a, b| order(a, b, margin.side));
            found.truncate(most);
            limit = limit_of(&found);
        }
        found
    }
}

/// The order of links: by cost, and those of one cost by the clip and the frame of their far end.
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
