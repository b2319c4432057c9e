//! The closest link of a range in each part of a clip.

use super::candidates::{Candidate, Candidates};
use super::margin::EventMargin;

/// The closest links between a range and the parts of a clip, as window pairs come in.
pub(super) struct ClipParts<'a> {
    candidates: &'a Candidates<'a>,
    margin: &'a EventMargin,
    clip: usize,
    /// Whether the window pairs are from one clip.
    is_own: bool,
    allowed: Option<&'a [bool]>,
    /// Closest link of each part. Its distance is that of the windows, even if the blend has another length.
    pub(super) best: Vec<Option<Candidate>>,
}

impl<'a> ClipParts<'a> {
    pub(super) fn new(
        candidates: &'a Candidates<'a>,
        (margin, clip): (&'a EventMargin, usize),
        allowed: Option<&'a [bool]>,
    ) -> Self {
        let frames = candidates.source.aligner.clouds[clip].frames();
        Self {
            is_own: candidates.source.events[margin.event].clip.index() == clip,
            best: vec![None; frames.div_ceil(candidates.lengths.spread)],
            candidates,
            margin,
            clip,
            allowed,
        }
    }

    /// Takes the window `row` of the range and the one that starts at frame `start` of the clip, whose squared distance is `square`.
    pub(super) fn take(&mut self, (row, start): (usize, usize), square: f32) {
        let lengths = &self.candidates.lengths;
        let beside = self.margin.start + row;
        let is_same = self.is_own && start.abs_diff(beside) < lengths.separation;
        if square > lengths.loosest * lengths.loosest || is_same {
            return;
        }
        let Some(far) = self.margin.side.far_end(start, self.margin.window) else {
            return;
        };
        let moment = || self.candidates.moments.at(self.clip, far) as usize;
        if self.allowed.is_some_and(|allowed| !allowed[moment()]) {
            return;
        }
        // A link's cost is at least its distance.
        let distance = square.sqrt();
        let best = &mut self.best[far / lengths.spread];
        if best.is_some_and(|best| distance >= best.cost) {
            return;
        }
        let found = self
            .candidates
            .candidate(self.margin, beside, (self.clip, start), distance);
        if let Some(found) = found
            && best.is_none_or(|best| found.cost < best.cost)
        {
            *best = Some(found);
        }
    }
}
