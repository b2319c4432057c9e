//! The candidates of a query: paths that the character could take from the next node on.

use serde::{Deserialize, Serialize};

use crate::graph::{Entry, Layer};
use crate::maps::{BakedGraph, PathId};
use crate::math::Rigid2;
use crate::query::clearance::PlayedTrack;
use crate::query::cull::Overlap;
use crate::query::retime::{Rate, RateError};
use crate::query::score::Evaluated;

/// A path that the character could take from the next node on.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct Candidate {
    pub kind: CandidateKind,
    pub rate: Rate,
}

#[derive(Clone, Copy, Debug)]
pub(in crate::query) enum CandidateKind {
    /// An evasion at the end of a path.
    Evasion {
        path: PathId,
        /// Time from the query to the start of the evasion, in seconds.
        start: f32,
    },
    /// A path without an evasion that lasts as long as the attack.
    Move(MoveId),
    /// An evasion that is entered without an edge. Index in [`CandidateList::entries`].
    Entry(u32),
    /// An evasion of the upper body, while pelvis and legs continue. Index in [`CandidateList::layers`].
    Layer(u32),
}

/// A path in a [`MoveSearch`](super::MoveSearch).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct MoveId(pub(super) u32);

/// An evasion that is entered after a delay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::query) struct EntryCandidate {
    /// Time of the entry, in seconds since the query.
    pub delay: f32,
    pub entry: Entry,
    /// Index in [`BakedGraph::evasions`](crate::maps::BakedGraph::evasions).
    pub evasion: usize,
    /// Time from the evasion's start to the entered frame at rate 1, in seconds.
    pub now: f32,
    /// Transform from the track's frame to the world.
    pub placement: Rigid2,
    /// Time from the entered frame to the evasion's end at rate 1, in seconds.
    pub left: f32,
}

impl EntryCandidate {
    /// The evasion on its baked track, from the end of the blend to the end of the track, or of the evasion if its rate is not 1.
    pub(in crate::query) fn played_track<'a>(&self, baked: &'a BakedGraph) -> PlayedTrack<'a> {
        let track = baked.track(self.evasion);
        let rate = self.entry.rate;
        let last = match rate {
            1.0 => track.seconds() - self.now,
            // The rate applies until the evasion's end.
            _ => self.left / rate,
        };
        PlayedTrack {
            track,
            placement: self.placement,
            origin: self.delay - (self.now + track.lead_in()) / rate,
            rate,
            seconds: (self.delay + self.entry.blend, self.delay + last),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::query) struct LayerCandidate {
    pub layer: Layer,
    /// Index in [`BakedGraph::evasions`](crate::maps::BakedGraph::evasions).
    pub evasion: usize,
    /// Distance from the attack as the ranking estimates it, in metres.
    pub metres: f32,
}

/// A candidate of the grid that is hit.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct KnownHit {
    pub path: PathId,
    pub overlap: Overlap,
    /// Result of the exact test; `None` if the maps show the hit.
    pub evaluated: Option<Evaluated>,
}

/// All candidates of a query, in three parts: those that a culling path counts, then those that an earlier round has shown to be hit,
/// then moves.
#[derive(Clone, Debug, Default)]
pub(in crate::query) struct CandidateList {
    pub list: Vec<Candidate>,
    /// Number of candidates that a culling path counts.
    pub counted: usize,
    /// Counts of these candidates, in order.
    pub overlaps: Vec<Overlap>,
    /// V_g of the candidates, in order, as far as they were measured.
    pub goals: Vec<f32>,
    /// Results of the candidates that an earlier round has shown to be hit, in order.
    pub known: Vec<KnownHit>,
    pub entries: Vec<EntryCandidate>,
    pub layers: Vec<LayerCandidate>,
    /// Number of paths to an evasion that no rate brings in time.
    pub late_count: usize,
    /// These paths with the reasons. Empty unless [`QuerySettings::list_late`](crate::query::QuerySettings::list_late) is set.
    pub late: Vec<(PathId, RateError)>,
    pub search: SearchReport,
    scratch: Vec<(Candidate, KnownHit)>,
}

/// Statistics of a search for candidates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SearchReport {
    /// Number of paths that were followed.
    pub followed: usize,
    /// Number of paths that were not followed because a similar path was.
    pub alike: usize,
    /// Number of paths that a limit of the settings cut off.
    pub cut: usize,
}

impl Candidate {
    /// The path to the evasion; `None` for a move, an entry or a layer.
    pub(in crate::query) fn path(&self) -> Option<PathId> {
        match self.kind {
            CandidateKind::Evasion { path, .. } => Some(path),
            CandidateKind::Move(_) | CandidateKind::Entry(_) | CandidateKind::Layer(_) => None,
        }
    }
}

impl CandidateList {
    /// The counts of a candidate, from this round or the previous one.
    pub(in crate::query) fn overlap(&self, index: usize) -> Option<Overlap> {
        match index.checked_sub(self.counted) {
            None => self.overlaps.get(index).copied(),
            Some(index) => self.known.get(index).map(|hit| hit.overlap),
        }
    }

    /// Stores the results of this round, in which every candidate is hit.
    pub(in crate::query) fn store_hits(&mut self, evaluated: &[Option<Evaluated>]) {
        self.known.clear();
        let results = self.list.iter().zip(&self.overlaps).zip(evaluated);
        self.known
            .extend(results.filter_map(|((candidate, overlap), evaluated)| {
                let path = candidate.path()?;
                // A candidate that is neither culled nor tested has no result.
                (overlap.body > 0 || evaluated.is_some()).then_some(KnownHit {
                    path,
                    overlap: *overlap,
                    evaluated: *evaluated,
                })
            }));
        self.sort_known();
    }

    pub(in crate::query) fn sort_known(&mut self) {
        self.known.sort_unstable_by_key(|hit| hit.path);
    }

    /// Moves candidates with stored results to the end, and removes results of paths that are not candidates.
    pub(in crate::query) fn put_known_last(&mut self) {
        let (list, known, scratch) = (&mut self.list, &mut self.known, &mut self.scratch);
        scratch.clear();
        list.retain(|candidate| {
            let path = candidate.path();
            let found = path.map(|path| known.binary_search_by_key(&path, |hit| hit.path));
            match found {
                Some(Ok(at)) => scratch.push((*candidate, known[at])),
                _ => return true,
            }
            false
        });
        self.counted = list.len();
        known.clear();
        for &(candidate, hit) in scratch.iter() {
            list.push(candidate);
            known.push(hit);
        }
    }
}
