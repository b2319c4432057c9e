//! The closest links between some ranges and each part of a clip. Once all parts have the maximum number of close links, lower bounds exclude
//! windows that are farther apart than these. Until then all distances are computed, which is faster while most windows are near enough.

use super::candidate::{Candidate, MOST, keep_closest};
use super::candidates::Candidates;
use super::clip_windows::{ClipSearch, Scratch};
use super::margin::EventMargin;
use super::parts::RangeSearch;
use super::space::LinkSpace;
use crate::graph::search::NearRange;
use crate::math::in_parallel;

/// Ranges beside events, prepared for the search. `candidates` has the windows of their lengths.
pub(super) struct NearMargins<'a> {
    candidates: &'a Candidates<'a>,
    margins: &'a [EventMargin],
    ranges: Vec<NearRange>,
    /// Moments that may be linked, or `None` if all may be.
    allowed: Option<&'a [bool]>,
}

impl<'a> NearMargins<'a> {
    pub(super) fn new(
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
    pub(super) fn closest(&self, clip: usize) -> Vec<Vec<Candidate>> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::distance::Windows;
    use crate::graph::links::fixture::Scene;
    use crate::graph::links::margin::Side;

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
