//! How good are the maps? What they say of candidates, held to the exact test.
//!
//! Source: Masaoka & Oshita, section 6: their culling leaves 70 of about 100 candidates. Differs:
//! every candidate is known to be hit or clean, so that it can be told which were rightly removed.

use serde::Serialize;

use super::cull::{CullInput, Overlap};
use super::{Answer, Source};

/// What a culling path said of the candidates of one round of a query. A query has two rounds where
/// the grid's candidates were counted and none of them was clean.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Round {
    /// By candidate.
    pub overlaps: Vec<Overlap>,
    /// By candidate, whether its maps cannot prove it clean.
    pub open: Vec<bool>,
}

impl Round {
    /// What was counted of `input`.
    #[must_use]
    pub fn new(input: &CullInput<'_>, overlaps: &[Overlap]) -> Self {
        Self {
            overlaps: overlaps.to_vec(),
            open: input.candidates.iter().map(|one| one.open).collect(),
        }
    }
}

/// Which candidates of a query are hit, by the exact test: those of its grid and those of the whole
/// search.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Truth {
    filed: Vec<bool>,
    whole: Vec<bool>,
}

impl Truth {
    /// From two answers to one query, both found by [`Judging::All`](super::Judging::All): of the
    /// whole search, and of the grid's with its rounds.
    #[must_use]
    pub fn new(whole: (&Answer, &[Round]), filed: (&Answer, &[Round])) -> Self {
        let of = |(answer, rounds): (&Answer, &[Round])| {
            // Those with maps come first.
            let mapped = rounds.last().map_or(0, |round| round.overlaps.len());
            let hit = |report: &super::CandidateReport| {
                report.clearance.is_some_and(|clear| !clear.is_clean())
            };
            let reports = answer.candidates.iter().take(mapped);
            reports.map(hit).collect::<Vec<bool>>()
        };
        let first = filed.1.first().map_or(0, |round| round.overlaps.len());
        Self {
            whole: of(whole),
            filed: match filed.0.source {
                // The search is widened where all are hit.
                Source::NothingClean => vec![true; first],
                _ => of(filed),
            },
        }
    }

    /// Holds the rounds of another answer to the same query to it.
    pub fn judge(&self, (source, rounds): (Source, &[Round]), tally: &mut MapTally) {
        let from_grid = matches!(source, Source::Grid | Source::NothingClean);
        for (index, round) in rounds.iter().enumerate() {
            let hits = if from_grid && index == 0 {
                &self.filed
            } else {
                &self.whole
            };
            let counted = round.overlaps.iter().zip(&round.open);
            for ((overlap, open), hit) in counted.zip(hits) {
                tally.add((overlap, *open), *hit);
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
