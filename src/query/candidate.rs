use super::cull::Overlap;
use super::evaluated::Evaluated;
use super::moves::MoveId;
use super::retime::Rate;
use crate::maps::PathId;

/// A path that the character could take from the next node on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub kind: CandidateKind,
    pub rate: Rate,
}

/// Kind of a candidate.
#[derive(Clone, Copy, Debug)]
pub(super) enum CandidateKind {
    /// An evasion at the end of a path.
    Evasion {
        path: PathId,
        /// Time from the query to the start of the evasion, in seconds.
        start: f32,
    },
    /// A path without an evasion that lasts as long as the attack.
    Move(MoveId),
    /// An evasion that is entered without an edge. Index in the query's entries.
    Entry(u32),
    /// An evasion of the upper body, while pelvis and legs continue. Index in the query's layers.
    Layer(u32),
}

impl Candidate {
    /// The path to the evasion; `None` for a move, an entry or a layer.
    pub(super) fn path(&self) -> Option<PathId> {
        match self.kind {
            CandidateKind::Evasion { path, .. } => Some(path),
            CandidateKind::Move(_) | CandidateKind::Entry(_) | CandidateKind::Layer(_) => None,
        }
    }
}

/// A candidate of the grid that is hit.
#[derive(Clone, Copy, Debug)]
pub(super) struct KnownHit {
    pub path: PathId,
    pub overlap: Overlap,
    /// Result of the exact test; `None` if the maps show the hit.
    pub evaluated: Option<Evaluated>,
}

/// All candidates of a query, in three parts: those that a culling path counts, then those that an earlier round has shown to be hit,
/// then moves.
#[derive(Clone, Debug, Default)]
pub(super) struct CandidateList {
    pub list: Vec<Candidate>,
    /// Number of candidates that a culling path counts.
    pub counted: usize,
    /// Counts of these candidates, in order.
    pub overlaps: Vec<Overlap>,
    /// Results of the candidates that an earlier round has shown to be hit, in order.
    pub known: Vec<KnownHit>,
    scratch: Vec<(Candidate, KnownHit)>,
}

impl CandidateList {
    /// The counts of a candidate, from this round or the previous one.
    pub(super) fn overlap(&self, index: usize) -> Option<Overlap> {
        match index.checked_sub(self.counted) {
            None => self.overlaps.get(index).copied(),
            Some(index) => self.known.get(index).map(|hit| hit.overlap),
        }
    }

    /// Stores the results of this round, in which every candidate is hit.
    pub(super) fn store_hits(&mut self, evaluated: &[Option<Evaluated>]) {
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

    /// Sorts the stored results by path.
    pub(super) fn sort_known(&mut self) {
        self.known.sort_unstable_by_key(|hit| hit.path);
    }

    /// Moves candidates with stored results to the end, and removes results of paths that are not candidates.
    pub(super) fn put_known_last(&mut self) {
        let Self {
            list,
            known,
            scratch,
            ..
        } = self;
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
