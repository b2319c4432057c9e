//! The second half of a query: from the counts of a culling path to the answer.
//!
//! Source: Masaoka & Oshita, sections 5.3 and 5.4. Differs: the paper sometimes chose a path that
//! was hit. Here the exact test has the last word on every candidate that the maps let pass; where
//! none of them is clean, on those that the maps removed as well, and where a node's grid holds
//! nothing clean, the search goes on outside of it. So an answer is a hit only where every
//! candidate is, whatever the maps said: what is called a hit was found to be one where the body truly
//! is at that time, and what is chosen as clean is tested on its very motion. The price is paid in just
//! those queries: an exact test of each removed candidate, up to its first hit, and the wider search.

use super::Attack;
use super::Query;
use super::answer::{Answer, Decision, Source};
use super::candidate::{Candidate, Way};
use super::case::Case;
use super::context::QueryContext;
use super::cull::{CullInput, Overlap};
use super::gather::Gathering;
use super::judge::{Court, CourtScratch, Judging};
use super::placement::{PlacedRegion, Scene, clock};
use super::query::{Enumerate, Lookup};
use super::retime::Rate;
use super::situation::Situation;
use crate::graph::Playhead;
use crate::maps::PathId;

/// A query between its two halves: candidates that wait for the counts of a culling path.
#[derive(Debug)]
pub struct Prepared<'a, 'c> {
    query: Query<'a>,
    situation: Situation<'c>,
    context: &'c mut QueryContext,
    source: Source,
}

/// A query that waits for its counts and holds on to nothing meanwhile: for whoever keeps queries from frame to frame.
/// [`Query::resume`] takes it up again.
#[derive(Clone, Copy, Debug)]
pub struct Paused {
    playhead: Playhead,
    source: Source,
    serial: u64,
}

/// What became of a query.
#[derive(Debug)]
pub enum Verdict<'a, 'c> {
    /// The answer stands where the caller wanted it.
    Answered,
    /// Nothing that the node's grid holds for this attack is clean: here are the candidates from
    /// everywhere, to be counted anew.
    Widened(Prepared<'a, 'c>),
}

impl<'a, 'c> Prepared<'a, 'c> {
    pub(super) fn new(
        query: Query<'a>,
        situation: Situation<'c>,
        context: &'c mut QueryContext,
    ) -> Self {
        context.serial += 1;
        context.known.clear();
        let mut prepared = Self {
            query,
            situation,
            context,
            source: Source::Whole,
        };
        if let Enumerate::Grid(lookup) = query.settings.enumerate {
            prepared.source = Source::Grid;
            prepared.gather(Some(lookup));
            if !prepared.context.candidates.is_empty() {
                return prepared;
            }
            prepared.source = Source::NothingFiled;
        }
        prepared.gather(None);
        prepared
    }

    /// Lets go of context and attack until [`Query::resume`].
    #[must_use]
    pub fn pause(self) -> Paused {
        Paused {
            playhead: self.situation.playhead,
            source: self.source,
            serial: self.context.serial,
        }
    }

    pub(super) fn resume(
        query: Query<'a>,
        (paused, attack): (Paused, &'c Attack),
        context: &'c mut QueryContext,
    ) -> Option<Self> {
        (context.serial == paused.serial).then(|| Self {
            query,
            situation: Situation::new(query.baked, paused.playhead, attack),
            context,
            source: paused.source,
        })
    }

    fn gather(&mut self, lookup: Option<Lookup>) {
        let Query { baked, settings } = self.query;
        let gathering = Gathering {
            baked,
            settings,
            lookup,
        };
        gathering.run(&self.situation, self.context);
        self.context.known_last();
        self.draw_maps(false);
    }

    /// Draws up the maps of the candidates, in the frame of the next node.
    fn draw_maps(&mut self, outer: bool) {
        let baked = self.query.baked;
        let QueryContext {
            candidates,
            counted,
            placed,
            clocks,
            attack,
            maps,
            ..
        } = &mut *self.context;
        placed.clear();
        clocks.clear();
        let attack_start = self.situation.attack.start();
        placed.extend(candidates[..*counted].iter().filter_map(|candidate| {
            let Way::Evasion { path, start } = candidate.way else {
                return None;
            };
            let path = baked.paths().path(path);
            Some(PlacedRegion {
                region: baked.evasions()[path.evasion as usize].region,
                placement: path.placement,
                clock: clock(clocks, start - attack_start),
            })
        }));
        let to_node = self.situation.node_frame.inverse();
        let attack = attack.place(self.situation.attack, to_node);
        maps.fill(&Scene {
            atlas: baked.atlas(),
            attack,
            clocks,
            placed,
            reach: baked.reach(),
            outer,
        });
    }

    /// Draws the attack's outer maps too, so that [`Overlap::outer`] can be counted. A choice needs
    /// no proof of a miss, so they are left out at first, and all candidates are
    /// [open](super::cull::CullCandidate::open).
    pub fn draw_outer_maps(&mut self) {
        self.draw_maps(true);
    }

    /// What a culling path counts: the candidates that end in an evasion, but for those that are known to be hit since the
    /// search was widened.
    #[must_use]
    pub fn cull_input(&self) -> CullInput<'_> {
        CullInput {
            atlas: self.query.baked.atlas(),
            attack: &self.context.maps.attack,
            candidates: &self.context.maps.candidates,
        }
    }

    /// The paths of the candidates that are counted, in order.
    pub(super) fn counted_paths(&self) -> impl Iterator<Item = PathId> {
        let counted = &self.context.candidates[..self.context.counted];
        counted.iter().filter_map(Candidate::path)
    }

    /// Where the candidates come from.
    #[must_use]
    pub fn source(&self) -> Source {
        self.source
    }

    /// Chooses. `overlaps` are the counts for [`Prepared::cull_input`], in its order.
    pub fn decide(
        mut self,
        overlaps: &[Overlap],
        judging: Judging,
        answer: &mut Answer,
    ) -> Verdict<'a, 'c> {
        let mut court = std::mem::take(&mut self.context.court);
        court.clear(self.context);
        let (mut has_moves, mut reconsidered) = (false, 0);
        let chosen = loop {
            let all = self.context.candidates.len();
            let case = self.case(overlaps);
            let is_culled = |index: usize| {
                judging == Judging::Needed && case.overlap(index).is_some_and(|o| o.body > 0)
            };
            let mut bench = Court::new(&mut court, case, judging);
            bench.judge((0..all).filter(|&index| !is_culled(index)));
            if !bench.has_clean() && self.source == Source::Grid {
                if judging == Judging::Needed && self.query.baked.atlas().grid().is_certain() {
                    self.context.know(&court, overlaps);
                }
                return self.widened(court);
            }
            if self.source != Source::Grid && !has_moves && bench.can_moves_win() {
                has_moves = true;
                self.search_moves();
                continue;
            }
            if !bench.has_clean() && reconsidered == 0 {
                reconsidered = (0..all).filter(|&index| is_culled(index)).count();
                bench.judge((0..all).filter(|&index| is_culled(index)));
            }
            if !bench.has_clean() {
                bench.measure_least();
            }
            // Where the winner is none after all, what was left out since it seemed to be one is
            // judged as well.
            let chosen = bench.choose();
            if bench.confirms(chosen, &mut answer.motion) {
                break chosen;
            }
        };
        let verdict = Decision {
            chosen,
            source: self.source,
            search: self.context.search,
            judging,
            reconsidered,
            not_in_time: self.context.late_count,
        };
        answer.fill(&self.case(overlaps), &court.judged, &verdict);
        answer.list_late(self.query.baked, &self.context.late);
        self.context.court = court;
        Verdict::Answered
    }

    /// The same query with the candidates from everywhere.
    fn widened(mut self, court: CourtScratch) -> Verdict<'a, 'c> {
        self.context.court = court;
        self.context.serial += 1;
        self.source = Source::NothingClean;
        self.gather(None);
        Verdict::Widened(self)
    }

    fn case<'b>(&'b self, overlaps: &'b [Overlap]) -> Case<'b> {
        Case {
            query: self.query,
            situation: self.situation,
            candidates: &self.context.candidates,
            moves: &self.context.moves,
            maps: &self.context.maps,
            counted: self.context.counted,
            overlaps,
            known: &self.context.known,
        }
    }

    /// Adds the paths that only move.
    fn search_moves(&mut self) {
        let QueryContext {
            candidates,
            moves,
            search,
            ..
        } = &mut *self.context;
        let settings = &self.query.settings;
        let seconds = (self.situation.attack.end() - self.situation.wait).min(LONGEST_MOVE);
        let start = (self.situation.node, seconds);
        let report = moves.run(self.query.baked.graph(), start, &settings.moves, |path| {
            candidates.push(Candidate {
                way: Way::Move(path),
                rate: Rate::UNCHANGED,
            });
        });
        *search += report;
    }
}

/// Moves are searched this far; then they go on along the natural way, seconds.
const LONGEST_MOVE: f32 = 4.0;
