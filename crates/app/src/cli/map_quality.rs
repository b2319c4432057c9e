//! The quality of the maps: their results compared with the exact test.
//!
//! Source: Masaoka & Oshita, section 6: their culling leaves 70 of about 100 candidates. Differs: the exact test classifies every
//! candidate as hit or clean, so wrong removals are counted too.

use rustc_hash::{FxHashMap, FxHashSet};
use serde::Serialize;

use sabaki::internal::PathId;
use sabaki::query::cull::Overlap;
use sabaki::query::{Answer, Session, Source};

/// The counts of one round of a query. A query has two rounds if no candidate of the grid is clean.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Round {
    counted: Vec<CountedOne>,
}

/// The counts of one candidate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct CountedOne {
    path: PathId,
    overlap: Overlap,
    /// Whether an outer count of 0 proves no miss.
    is_open: bool,
}

impl Round {
    /// The counts of a session's round.
    #[must_use]
    pub(crate) fn new(session: &Session<'_>) -> Self {
        let candidates = session.cull_input().candidates;
        let counted = session.counted_paths().zip(candidates);
        let counted = counted.zip(session.counts());
        Self {
            counted: counted
                .map(|((path, candidate), &overlap)| CountedOne {
                    path,
                    overlap,
                    is_open: candidate.open,
                })
                .collect(),
        }
    }
}

/// The exact results of one query: which candidates are hit.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct GroundTruth {
    /// Whether each path is hit.
    hits: FxHashMap<PathId, bool>,
}

impl GroundTruth {
    /// From answers to one query by [`Evaluation::Exhaustive`](sabaki::query::Evaluation::Exhaustive), each with its rounds: one answer from
    /// all paths, and one from the grid.
    #[must_use]
    pub(crate) fn new<'r>(answers: impl IntoIterator<Item = (&'r Answer, &'r [Round])>) -> Self {
        let mut hits = FxHashMap::default();
        for (answer, rounds) in answers {
            if answer.source == Source::NothingClean {
                // The first round ended because all its candidates are hit.
                let filed = rounds.first().into_iter().flat_map(|round| &round.counted);
                hits.extend(filed.map(|one| (one.path, true)));
            }
            let tested = answer.paths().filter_map(|(path, report)| {
                let clearance = report.clearance?;
                // What had to be bent was hit.
                Some((path, report.warp.is_some() || !clearance.is_clean()))
            });
            hits.extend(tested);
        }
        Self { hits }
    }

    /// Compares the rounds of another answer to the same query, and adds the results to `tally`. A candidate of both rounds is added
    /// once.
    pub(crate) fn compare(&self, rounds: &[Round], tally: &mut MapTally) {
        let mut seen = FxHashSet::default();
        let counted = rounds.iter().flat_map(|round| &round.counted);
        for one in counted.filter(|one| seen.insert(one.path)) {
            if let Some(&is_hit) = self.hits.get(&one.path) {
                tally.add(one, is_hit);
            }
        }
    }
}

/// Numbers of candidates by the results of maps and exact test.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct MapTally {
    /// Candidates that are hit.
    pub(crate) hits: usize,
    /// Hit candidates that the maps keep.
    pub(crate) hits_kept: usize,
    /// Candidates that are clean.
    pub(crate) clean: usize,
    /// Clean candidates that the maps remove.
    pub(crate) clean_removed: usize,
    /// Candidates that the maps neither remove nor prove clean.
    pub(crate) undecided: usize,
    /// Hit candidates that the maps prove clean: a fault, unless the maps are not certain.
    pub(crate) hits_proven_clean: usize,
}

impl MapTally {
    /// Adds a candidate.
    fn add(&mut self, one: &CountedOne, is_hit: bool) {
        let is_removed = one.overlap.body > 0;
        let is_proven = one.overlap.outer == 0 && !one.is_open;
        if is_hit {
            self.hits += 1;
            self.hits_kept += usize::from(!is_removed);
            self.hits_proven_clean += usize::from(is_proven);
        } else {
            self.clean += 1;
            self.clean_removed += usize::from(is_removed);
        }
        self.undecided += usize::from(!is_removed && !is_proven);
    }

    /// Number of candidates that were added.
    #[must_use]
    pub(crate) fn candidates(&self) -> usize {
        self.hits + self.clean
    }

    /// Number of candidates that the maps keep.
    #[must_use]
    pub(crate) fn kept(&self) -> usize {
        self.hits_kept + self.clean - self.clean_removed
    }

    /// Share of the hit candidates that the maps keep; 0 if there are none.
    #[must_use]
    pub(crate) fn weak(&self) -> f64 {
        share(self.hits_kept, self.hits)
    }

    /// Share of the clean candidates that the maps remove; 0 if there are none.
    #[must_use]
    pub(crate) fn wrong(&self) -> f64 {
        share(self.clean_removed, self.clean)
    }

    /// Share of all candidates that only the exact test decides; 0 if there are none.
    #[must_use]
    pub(crate) fn undecided_share(&self) -> f64 {
        share(self.undecided, self.candidates())
    }
}

fn share(part: usize, whole: usize) -> f64 {
    if whole == 0 {
        return 0.0;
    }
    part as f64 / whole as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_candidate_is_counted_by_both_results() {
        let counted = |body, outer, is_open| CountedOne {
            path: PathId(0),
            overlap: Overlap {
                body,
                outer,
                evasion: 0,
            },
            is_open,
        };
        let mut tally = MapTally::default();
        tally.add(&counted(3, 5, false), true);
        tally.add(&counted(0, 5, false), true);
        tally.add(&counted(0, 0, false), false);
        tally.add(&counted(0, 0, true), false);
        tally.add(&counted(1, 1, false), false);
        assert_eq!((tally.candidates(), tally.kept()), (5, 3));
        assert_eq!((tally.weak(), tally.wrong()), (0.5, 1.0 / 3.0));
        assert_eq!(tally.undecided, 2);
        assert_eq!(tally.hits_proven_clean, 0);
        assert_eq!(MapTally::default().weak(), 0.0);
    }
}
