use rustc_hash::FxHashSet;

use super::attack::QueryAttack;
use super::candidate::Candidate;
use super::cull::{Counted, CullInput, Overlap, cpu};
use super::judge::{CourtScratch, Judged};
use super::moves::{MoveSearch, SearchReport};
use super::placement::{CullMaps, PlacedRegion};
use super::retime::RateError;
use crate::maps::{CellColumn, PathId, TouchedCells};

/// What a query works with; kept from one query to the next, so that after some of them nothing is
/// allocated any more. Of no use to read; each thread has its own.
#[derive(Clone, Debug, Default)]
pub struct QueryContext {
    /// Of the query that it was last used for.
    pub(super) serial: u64,
    /// Those that are to be counted come first, then those of `known`.
    pub(super) candidates: Vec<Candidate>,
    /// How many of them are counted.
    pub(super) counted: usize,
    /// Of the round before, those that are candidates again.
    pub(super) known: Vec<KnownHit>,
    /// Scratch.
    pub(super) passed: Vec<(Candidate, KnownHit)>,
    /// Paths to an evasion that no rate brings in time, where they are listed.
    pub(super) late: Vec<(PathId, RateError)>,
    pub(super) late_count: usize,
    pub(super) search: SearchReport,
    pub(super) touched: TouchedCells,
    /// Columns by how near they are.
    pub(super) nearest: Vec<(f32, CellColumn)>,
    pub(super) seen: FxHashSet<[i32; 4]>,
    pub(super) attack: QueryAttack,
    pub(super) placed: Vec<PlacedRegion>,
    pub(super) clocks: Vec<f32>,
    pub(super) maps: CullMaps,
    pub(super) moves: MoveSearch,
    pub(super) court: CourtScratch,
    pub(super) counting: Counting,
}

/// A candidate that was found to be hit before the search was widened.
#[derive(Clone, Copy, Debug)]
pub(super) struct KnownHit {
    pub path: PathId,
    pub overlap: Overlap,
    /// `None` where its maps alone say so.
    pub judged: Option<Judged>,
}

/// Counting on the CPU.
#[derive(Clone, Debug)]
pub(super) struct Counting {
    pub overlaps: Vec<Overlap>,
    culler: cpu::Culler,
}

impl Default for Counting {
    fn default() -> Self {
        Self {
            overlaps: Vec::new(),
            culler: cpu::Culler::default().counting(Counted::FOR_A_CHOICE),
        }
    }
}

impl Counting {
    pub(super) fn count(&mut self, input: &CullInput<'_>) {
        self.culler.count(input, &mut self.overlaps);
    }
}

impl QueryContext {
    /// Keeps what was found of this round's candidates, all of which are hit.
    pub(super) fn know(&mut self, court: &CourtScratch, overlaps: &[Overlap]) {
        self.known.clear();
        let found = self.candidates.iter().zip(overlaps).zip(&court.judged);
        self.known
            .extend(found.filter_map(|((candidate, overlap), judged)| {
                let path = candidate.path()?;
                // What is neither was not looked at.
                (overlap.body > 0 || judged.is_some()).then_some(KnownHit {
                    path,
                    overlap: *overlap,
                    judged: *judged,
                })
            }));
        self.known.sort_unstable_by_key(|hit| hit.path);
    }

    /// Puts candidates that are known to be hit behind the others, and keeps of what is known just these, in their order.
    pub(super) fn known_last(&mut self) {
        let Self {
            candidates,
            known,
            passed,
            ..
        } = self;
        passed.clear();
        candidates.retain(|candidate| {
            let path = candidate.path();
            let found = path.map(|path| known.binary_search_by_key(&path, |hit| hit.path));
            match found {
                Some(Ok(at)) => passed.push((*candidate, known[at])),
                _ => return true,
            }
            false
        });
        self.counted = candidates.len();
        known.clear();
        for &(candidate, hit) in passed.iter() {
            candidates.push(candidate);
            known.push(hit);
        }
    }
}
