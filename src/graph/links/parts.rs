//! The closest link of a range in each part of a clip.

use super::candidate::{Candidate, WindowPair};
use super::margin::EventMargin;
use super::space::LinkSpace;
use crate::graph::distance::{DistanceMap, Windows};
use crate::graph::search::WindowCell;

/// A search for the links of one range.
#[derive(Clone, Copy)]
pub(super) struct RangeSearch<'a> {
    pub(super) space: &'a LinkSpace<'a>,
    pub(super) margin: &'a EventMargin,
    /// Moments that may be linked, or `None` if all may be.
    pub(super) allowed: Option<&'a [bool]>,
}

impl RangeSearch<'_> {
    /// Closest link to each part of a clip, given the clip's windows of the range's length. Its distance is that of the windows, even if
    /// the blend has another length.
    pub(super) fn between(self, clip: usize, windows: &Windows) -> Vec<Option<Candidate>> {
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
pub(super) struct ClipParts<'a> {
    search: RangeSearch<'a>,
    clip: usize,
    /// Whether the window pairs are from one clip.
    is_own: bool,
    /// Closest link of each part. Its distance is that of the windows, even if the blend has another length.
    pub(super) best: Vec<Option<Candidate>>,
}

impl<'a> ClipParts<'a> {
    pub(super) fn new(search: RangeSearch<'a>, clip: usize) -> Self {
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
    pub(super) fn take(&mut self, cell: WindowCell, square: f32) {
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
