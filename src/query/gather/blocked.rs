//! Finds candidates that enter an obstacle by the baked tracks of their evasions, which is fast. They are not drawn, counted or posed.

use super::candidates::{CandidateKind, CandidateList, EntryCandidate, KnownHit};
use crate::maps::BakedGraph;
use crate::query::clearance::{ObstacleHit, PlayedTrack};
use crate::query::cull::Overlap;
use crate::query::request::ActiveRequest;
use crate::query::score::Evaluated;

/// Stores the evasions that enter an obstacle as known hits.
pub(in crate::query) fn reject_blocked(
    baked: &BakedGraph,
    request: &ActiveRequest,
    candidates: &mut CandidateList,
) {
    if !request.removes_blocked() {
        return;
    }
    let blends_until = request.blend.blends_until();
    let known = &mut candidates.known;
    let before = known.len();
    for candidate in &candidates.list {
        let CandidateKind::Evasion { path, start } = candidate.kind else {
            continue;
        };
        let at = known[..before].binary_search_by_key(&path, |hit| hit.path);
        let is_tested = at.is_ok_and(|at| known[at].evaluated.is_some());
        // Tracks do not include the offset of a blend.
        if is_tested || start < blends_until {
            continue;
        }
        let end = start + baked.graph().seconds(baked.path_evasion(path).edge);
        let evasion = PlayedTrack {
            seconds: (start, end),
            ..request.evasion(baked, path, start)
        };
        let Some(hit) = request.obstacles.on_track(&evasion) else {
            continue;
        };
        let evaluated = Some(Evaluated {
            clearance: hit.as_clearance(),
            score: None,
            is_final: false,
            warp: None,
        });
        match at {
            Ok(at) => known[at].evaluated = evaluated,
            Err(_) => known.push(KnownHit {
                path,
                overlap: Overlap::default(),
                evaluated,
            }),
        }
    }
    candidates.sort_known();
}

/// Removes the entered evasions that enter an obstacle. If all do, the least harmful one is kept. `natural_until` is the time until which the
/// natural motion enters no obstacle, in seconds.
pub(super) fn keep_free(
    baked: &BakedGraph,
    request: &ActiveRequest,
    natural_until: f32,
    entries: &mut Vec<EntryCandidate>,
) {
    if !request.removes_blocked() {
        return;
    }
    let mut least: Option<(f32, EntryCandidate)> = None;
    entries.retain(|entry| {
        if entry.delay > natural_until {
            return false;
        }
        let Some(hit) = entry_blocked(baked, request, entry) else {
            return true;
        };
        if least.is_none_or(|(harm, _)| hit.harm < harm) {
            least = Some((hit.harm, *entry));
        }
        false
    });
    if entries.is_empty() {
        entries.extend(least.map(|(_, entry)| entry));
    }
}

/// The obstacle that an entered evasion enters until its end.
fn entry_blocked(
    baked: &BakedGraph,
    request: &ActiveRequest,
    candidate: &EntryCandidate,
) -> Option<ObstacleHit> {
    let track = candidate.played_track(baked)?;
    let end = candidate.delay + candidate.left / candidate.entry.rate;
    request.obstacles.on_track(&PlayedTrack {
        seconds: (track.seconds.0, end),
        ..track
    })
}
