//! How good are the maps? What they say of candidates, held to the exact test.
//!
//! Source: Masaoka & Oshita, section 6: their culling leaves 70 of about 100 candidates. Differs:
//! every candidate is known to be hit or clean, so that it can be told which were rightly removed.

use rustc_hash::{FxHashMap, FxHashSet};
use serde::Serialize;

use super::answer::Answer;
use super::cull::Overlap;
use super::session::Session;
use super::source::Source;
use crate::maps::PathId;

/// What a culling path said of the candidates of one round of a query. A query has two rounds where
/// the grid's candidates were counted and none of them was clean.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Round {
    counted: Vec<CountedOne>,
}

/// One candidate, as its maps tell it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct CountedOne {
    path: PathId,
    overlap: Overlap,
    /// Whether nothing counted by its outer maps proves nothing.
    is_open: bool,
}

impl Round {
    /// The counts of a session's round.
    #[must_use]
    pub fn new(session: &Session<'_>) -> Self {
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

/// Which candidates of a query are hit, by the exact test: those of its grid and those of the whole
/// search.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Truth {
    /// By path.
    hits: FxHashMap<PathId, bool>,
}

impl Truth {
    /// From answers to one query, each found by [`Evaluation::Exhaustive`](super::Evaluation::Exhaustive), with its rounds: of the whole search, and
    /// of the grid's.
    #[must_use]
    pub fn new<'r>(answers: impl IntoIterator<Item = (&'r Answer, &'r [Round])>) -> Self {
        let mut hits = FxHashMap::default();
        for (answer, rounds) in answers {
            if answer.source == Source::NothingClean {
                // The search is widened where all are hit.
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

    /// Holds the rounds of another answer to the same query to it. What is counted in both rounds is one candidate.
    pub fn judge(&self, rounds: &[Round], tally: &mut MapTally) {
        let mut seen = FxHashSet::default();
        let counted = rounds.iter().flat_map(|round| &round.counted);
        for one in counted.filter(|one| seen.insert(one.path)) {
            if let Some(&is_hit) = self.hits.get(&one.path) {
                tally.add((&one.overlap, one.is_open), is_hit);
            }
        }
    }
}

/// Candidates that were both counted and tested, by what either said.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct MapTally {
    /// Exactly hit.
    pub hits: usize,
    /// Of these, how many the maps let pass.
    pub hits_kept: usize,
    /// Exactly clean.
    pub clean: usize,
    /// Of these, how many the maps remove.
    pub clean_removed: usize,
    /// Neither removed nor proven clean: only the exact test can tell.
    pub undecided: usize,
    /// Exactly hit, and proven clean by the maps: a fault, but for maps that are not certain.
    pub hits_proven_clean: usize,
}

impl MapTally {
    /// Adds a candidate. `is_open`: nothing counted by its outer maps proves nothing.
    pub fn add(&mut self, (overlap, is_open): (&Overlap, bool), is_hit: bool) {
        let is_removed = overlap.body > 0;
        let is_proven = overlap.outer == 0 && !is_open;
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

    /// All that were added.
    #[must_use]
    pub fn candidates(&self) -> usize {
        self.hits + self.clean
    }

    /// Those that the maps do not remove.
    #[must_use]
    pub fn kept(&self) -> usize {
        self.hits_kept + self.clean - self.clean_removed
    }

    /// Share of the hit candidates that the maps let pass; 0 of none.
    #[must_use]
    pub fn weak(&self) -> f64 {
        share(self.hits_kept, self.hits)
    }

    /// Share of the clean candidates that the maps remove; 0 of none.
    #[must_use]
    pub fn wrong(&self) -> f64 {
        share(self.clean_removed, self.clean)
    }

    /// Share of all candidates that are left to the exact test; 0 of none.
    #[must_use]
    pub fn undecided_share(&self) -> f64 {
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
    fn counts_what_either_side_says() {
        let overlap = |body, outer| Overlap {
            body,
            outer,
            evasion: 0,
        };
        let mut tally = MapTally::default();
        tally.add((&overlap(3, 5), false), true);
        tally.add((&overlap(0, 5), false), true);
        tally.add((&overlap(0, 0), false), false);
        tally.add((&overlap(0, 0), true), false);
        tally.add((&overlap(1, 1), false), false);
        assert_eq!((tally.candidates(), tally.kept()), (5, 3));
        assert_eq!((tally.weak(), tally.wrong()), (0.5, 1.0 / 3.0));
        assert_eq!(tally.undecided, 2);
        assert_eq!(tally.hits_proven_clean, 0);
        assert_eq!(MapTally::default().weak(), 0.0);
    }
}
