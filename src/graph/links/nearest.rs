//! The closest links of many events.

use super::candidate::Candidate;
use super::candidates::Candidates;
use super::margin::{EventMargin, Side};
use super::parts::RangeSearch;
use crate::graph::watch::{BakeStage, Stopped};
use crate::math::{in_parallel, sort_rarely};

/// Events, and the side of them on which links are searched.
#[derive(Clone, Copy)]
pub(super) struct Wanted<'a> {
    /// Indices of the events.
    pub(super) events: &'a [usize],
    pub(super) side: Side,
    /// Moments that may be linked.
    pub(super) allowed: &'a [bool],
    /// Number of links of each event.
    pub(super) most: usize,
}

/// Finds the links of each event with the closest windows, closest first, without refining their distances. An event has at most one link
/// in each `spread` frames of a clip.
pub(super) fn nearest(
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
    use crate::graph::distance::Windows;
    use crate::graph::links::fixture::{CLIPS, FRAMES, Scene};

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
