//! The second half of a query: from the counts of a culling path to the answer.
//!
//! Source: Masaoka & Oshita, sections 5.3 and 5.4. Differs: the paper sometimes chose a path that was hit.
//! Here the exact test has the last word on every candidate that the maps let pass; and where none
//! of them is clean, on those that the maps removed as well. So an answer is a hit only where every
//! candidate is, whatever the maps said. The price is an exact test of the removed candidates in
//! just those queries.

use super::answer::{Answer, CandidateReport, Counts, Fate};
use super::clearance::{Clearance, SAMPLE_RATE};
use super::cull::{CullInput, Overlap};
use super::enumerate::{FoundPath, SearchReport};
use super::judge::{Court, Judged, Judging, choose};
use super::placement::CullMaps;
use super::retime::{Direction, Rate, RateError};
use super::score::Score;
use super::{Attack, Query};
use crate::graph::{EdgeId, Motion, Playhead, Step};
use crate::region::Slab;

/// A query between its two halves: candidates that wait for the counts of a culling path.
#[derive(Clone, Debug)]
pub struct Prepared<'a> {
    pub(super) query: Query<'a>,
    pub(super) playhead: Playhead,
    pub(super) attack: Attack,
    pub(super) candidates: Vec<Candidate>,
    /// Paths to an evasion that no rate brings in time.
    pub(super) late: Vec<(FoundPath, RateError)>,
    pub(super) maps: CullMaps,
    pub(super) search: SearchReport,
}

/// A path that is in time.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub(super) path: FoundPath,
    pub(super) rate: Rate,
}

impl<'a> Prepared<'a> {
    /// What a culling path counts. Its candidates are those that end in an evasion; a path that
    /// only moves has no maps.
    #[must_use]
    pub fn cull_input(&self) -> CullInput<'_> {
        CullInput {
            atlas: self.query.baked.atlas(),
            attack: &self.maps.attack,
            candidates: &self.maps.candidates,
        }
    }

    /// Chooses. `overlaps` are the counts for [`Prepared::cull_input`], in its order.
    #[must_use]
    pub fn decide(self, overlaps: &[Overlap], judging: Judging) -> Answer {
        // What only moves has no counts, however many are given.
        let overlaps = &overlaps[..overlaps.len().min(self.maps.candidates.len())];
        let culled = |index: usize| {
            judging == Judging::Needed && overlaps.get(index).is_some_and(|o| o.body > 0)
        };
        let (removed, passed): (Vec<usize>, Vec<usize>) =
            (0..self.candidates.len()).partition(|&index| culled(index));
        let mut counts = Counts {
            candidates: self.candidates.len(),
            with_evasion: self.maps.candidates.len(),
            not_in_time: self.late.len(),
            culled: removed.len(),
            ..Counts::default()
        };
        let mut court = Court::new(&self, overlaps, judging);
        court.judge(passed);
        if !court.has_clean() {
            counts.reconsidered = removed.len();
            court.judge(removed);
        }
        if !court.has_clean() && judging == Judging::Needed {
            court.measure_least();
        }
        let judged = court.judged;
        counts.clean = judged
            .iter()
            .flatten()
            .filter(|judged| judged.score.is_some())
            .count();
        counts.hits = judged.iter().flatten().count() - counts.clean;
        let chosen = choose(&judged);
        self.answer(chosen, &judged, overlaps, counts)
    }

    /// A candidate's score if its clearance were `metres`.
    pub(super) fn score(&self, index: usize, overlap: Option<&Overlap>, metres: f32) -> Score {
        let candidate = &self.candidates[index];
        let covered = overlap.map_or(0, |overlap| overlap.evasion);
        let weights = &self.query.settings.weights;
        Score::new(
            self.region_texels(index),
            covered,
            metres,
            candidate.rate.rate,
            weights,
        )
    }

    /// Texels of a candidate's evasion region in the slabs that the attack touches.
    fn region_texels(&self, index: usize) -> u32 {
        let Some(candidate) = self.maps.candidates.get(index) else {
            return 0;
        };
        let maps = |slab: Slab| self.query.baked.atlas().maps(candidate.region, slab);
        self.maps
            .attack
            .layers
            .iter()
            .filter(|layer| layer.clock == candidate.clock && !layer.inner.is_empty())
            .filter_map(|layer| maps(layer.slab))
            .map(|maps| maps.evasion.count())
            .sum()
    }

    /// A candidate's whole motion, from now until a sample after the attack's end at least.
    pub(super) fn motion(&self, index: usize) -> Motion {
        let graph = self.query.baked.graph();
        let candidate = &self.candidates[index];
        let rate_of = |edge: EdgeId| {
            let retimable = self.query.baked.retimable(edge);
            let changed = match candidate.rate.direction {
                Direction::Unchanged => false,
                Direction::Faster => retimable.faster,
                Direction::Slower => retimable.slower,
            };
            if changed { candidate.rate.rate } else { 1.0 }
        };
        let mut steps: Vec<Step> = candidate
            .path
            .edges
            .iter()
            .map(|&edge| Step {
                edge,
                rate: rate_of(edge),
            })
            .collect();
        if let Some(evasion) = candidate.path.evasion {
            steps.push(Step {
                edge: self.query.baked.evasions()[evasion].edge,
                rate: 1.0,
            });
        }
        let mut motion = Motion::new(graph, self.playhead, &steps);
        motion.extend(graph, self.attack.end() + 2.0 / SAMPLE_RATE);
        motion
    }

    fn answer(
        self,
        chosen: usize,
        judged: &[Option<Judged>],
        overlaps: &[Overlap],
        counts: Counts,
    ) -> Answer {
        let motion = self.motion(chosen);
        let body = |index: usize| overlaps.get(index).map_or(0, |overlap| overlap.body);
        let fate = |index: usize| match &judged[index] {
            _ if index == chosen => Fate::Chosen,
            Some(judged) if judged.score.is_none() => Fate::Hit,
            None if body(index) > 0 => Fate::Culled,
            _ => Fate::Outscored,
        };
        let edge_of = |path: &FoundPath| {
            path.evasion
                .map(|evasion| self.query.baked.evasions()[evasion].edge)
        };
        let mut candidates: Vec<CandidateReport> = self
            .candidates
            .iter()
            .enumerate()
            .map(|(index, candidate)| CandidateReport {
                path: candidate.path.edges.clone(),
                evasion: edge_of(&candidate.path),
                rate: Ok(candidate.rate),
                overlap: overlaps.get(index).copied(),
                clearance: judged[index].as_ref().map(|judged| judged.clearance),
                score: judged[index].as_ref().and_then(|judged| judged.score),
                fate: fate(index),
            })
            .collect();
        candidates.extend(self.late.iter().map(|(path, error)| CandidateReport {
            path: path.edges.clone(),
            evasion: edge_of(path),
            rate: Err(*error),
            overlap: None,
            clearance: None,
            score: None,
            fate: Fate::NotInTime,
        }));
        // Every candidate that could be chosen was judged; there is always one that only moves.
        let clearance = candidates[chosen].clearance.unwrap_or(Clearance {
            metres: 0.0,
            time: 0.0,
            body_sphere: 0,
        });
        let avoided = candidates[chosen].score.is_some();
        Answer {
            chosen,
            avoided,
            clearance,
            motion,
            candidates,
            counts,
            search: self.search,
        }
    }
}
