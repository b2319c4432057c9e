//! Finds candidates that enter an obstacle by the baked tracks of their evasions, which is fast. They are not drawn, counted or posed.

use super::ask::Query;
use super::candidate::{CandidateKind, KnownHit};
use super::clearance::PlacedEvasion;
use super::cull::Overlap;
use super::entry_candidate::EntryCandidate;
use super::evaluated::Evaluated;
use super::evaluation::Evaluation;
use super::obstacle::{ObstacleHit, TrackPart};
use super::request::ActiveRequest;
use super::state::QueryState;
use crate::maps::BakedGraph;

/// Stores the evasions that enter an obstacle as known hits.
pub(super) fn reject_blocked(query: Query<'_>, state: &mut QueryState) {
    let QueryState {
        request,
        candidates,
        ..
    } = state;
    if !is_sought(request) {
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
        let evasion = request.evasion(query.baked, path, start);
        let seconds = query
            .baked
            .graph()
            .seconds(query.baked.path_evasion(path).edge);
        let Some(hit) = evasion_blocked(request, evasion, seconds) else {
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
pub(super) fn keep_free(baked: &BakedGraph, state: &mut QueryState, natural_until: f32) {
    let QueryState {
        request, entries, ..
    } = state;
    if !is_sought(request) {
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

/// Whether blocked candidates are removed. An exhaustive evaluation measures all candidates.
pub(super) fn is_sought(request: &ActiveRequest) -> bool {
    request.evaluation == Evaluation::Lazy && !request.obstacles.all().is_empty()
}

/// The obstacle that an evasion of some seconds enters.
fn evasion_blocked(
    request: &ActiveRequest,
    evasion: PlacedEvasion<'_>,
    seconds: f32,
) -> Option<ObstacleHit> {
    let start = evasion.start;
    request.obstacles.on_track(&TrackPart {
        track: evasion.track,
        placement: evasion.placement,
        origin: start,
        rate: 1.0,
        seconds: (start, start + seconds),
    })
}

/// The obstacle that an entered evasion enters.
fn entry_blocked(
    baked: &BakedGraph,
    request: &ActiveRequest,
    candidate: &EntryCandidate,
) -> Option<ObstacleHit> {
    let entered = baked.entry_track(candidate.evasion)?;
    let (delay, rate) = (candidate.delay, candidate.entry.rate);
    request.obstacles.on_track(&TrackPart {
        track: &entered.track,
        placement: candidate.placement,
        origin: delay - candidate.ahead / rate,
        rate,
        seconds: (delay + candidate.entry.blend, delay + candidate.left / rate),
    })
}
