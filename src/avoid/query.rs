//! A query from end to end.
//!
//! Source: Masaoka & Oshita, section 5. Differs: the paper sometimes chose a path that was hit.
//! Here the exact test has the last word on every candidate that the maps let pass; and where none
//! of them is clean, on those that the maps removed as well. So an answer is a hit only where every
//! candidate is, whatever the maps said. The price is an exact test of the removed candidates in
//! just those queries.

use serde::{Deserialize, Serialize};

use super::Attack;
use super::answer::{Answer, CandidateReport, Counts, Fate};
use super::clearance::{Clearance, Extent, SAMPLE_RATE, clearance};
use super::cull::{CullInput, Overlap};
use super::enumerate::{
    EnumerateSettings, FoundPath, SearchReport, cell, paths_to_evasions, plain_paths,
};
use super::placement::{CullMaps, PlacedRegion, cull_maps};
use super::retime::{Direction, Rate, RateError, RateSettings, rate};
use super::score::{Score, Weights};
use crate::graph::{EdgeId, Motion, Playhead, Step};
use crate::region::{BakedGraph, Slab};

/// How a query is answered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct QuerySettings {
    /// The search for candidates.
    pub enumerate: EnumerateSettings,
    /// Limits of the playback rate.
    pub rates: RateSettings,
    /// Weights of the score.
    pub weights: Weights,
}

/// Asks a baked graph how to avoid attacks.
#[derive(Clone, Copy, Debug)]
pub struct Query<'a> {
    baked: &'a BakedGraph,
    settings: &'a QuerySettings,
}

/// A query between its two halves: candidates that wait for the counts of a culling path.
#[derive(Clone, Debug)]
pub struct Prepared<'a> {
    query: Query<'a>,
    playhead: Playhead,
    attack: Attack,
    candidates: Vec<Candidate>,
    /// Paths to an evasion that no rate brings in time.
    late: Vec<(FoundPath, RateError)>,
    maps: CullMaps,
    search: SearchReport,
}

/// A path that is in time.
#[derive(Clone, Debug)]
struct Candidate {
    path: FoundPath,
    rate: Rate,
}

impl<'a> Query<'a> {
    /// On one graph, with one set of settings.
    #[must_use]
    pub fn new(baked: &'a BakedGraph, settings: &'a QuerySettings) -> Self {
        Self { baked, settings }
    }

    /// Finds the candidates for a character at `playhead` and draws up their maps. `attack` is in
    /// the world of the playhead, its clock starts now.
    #[must_use]
    pub fn prepare(&self, playhead: Playhead, attack: &Attack) -> Prepared<'a> {
        let graph = self.baked.graph();
        let node = playhead.next_node(graph);
        let wait = playhead.seconds_to_next_node(graph);
        let available = attack.start() - wait;
        let limits = (&self.settings.enumerate, &self.settings.rates);
        let (mut paths, mut search) = paths_to_evasions(self.baked, node, available, limits);
        let (plain, plain_search) = plain_paths(
            self.baked,
            node,
            (attack.end() - wait).min(2.0 * self.settings.enumerate.horizon),
            &self.settings.enumerate,
        );
        search += plain_search;
        paths.extend(plain);
        let (mut candidates, mut late) = (Vec::new(), Vec::new());
        for path in paths {
            let unchanged = Rate {
                rate: 1.0,
                direction: Direction::Unchanged,
            };
            let in_time = match path.evasion {
                Some(_) => rate(&path.durations, available, &self.settings.rates),
                None => Ok(unchanged),
            };
            match in_time {
                Ok(rate) => candidates.push(Candidate { path, rate }),
                Err(error) => late.push((path, error)),
            }
        }
        let candidates = self.different_answers(playhead, candidates, &mut search);
        let start = graph.node(node);
        let path_start = graph.placement(start.clip, start.frame);
        let placed: Vec<PlacedRegion> = candidates
            .iter()
            .filter_map(|candidate| {
                let evasion = &self.baked.evasions()[candidate.path.evasion?];
                let placement = path_start.inverse() * candidate.path.to_start * evasion.placement;
                Some(PlacedRegion {
                    region: evasion.region,
                    placement,
                })
            })
            .collect();
        let to_path_start = (playhead.next_clip_to_world(graph) * path_start).inverse();
        let maps = cull_maps(self.baked.atlas(), &attack.placed(to_path_start), &placed);
        Prepared {
            query: *self,
            playhead,
            attack: attack.clone(),
            candidates,
            late,
            maps,
            search,
        }
    }

    /// Of candidates that perform the same evasion at nearly the same place the one whose rate is
    /// nearest to 1. Evasions come first.
    fn different_answers(
        &self,
        playhead: Playhead,
        mut all: Vec<Candidate>,
        search: &mut SearchReport,
    ) -> Vec<Candidate> {
        let settings = &self.settings.enumerate;
        let start = playhead.next_clip_to_world(self.baked.graph());
        let change = |candidate: &Candidate| (candidate.rate.rate - 1.0).abs();
        all.sort_by(|a, b| {
            a.path
                .evasion
                .is_none()
                .cmp(&b.path.evasion.is_none())
                .then(change(a).total_cmp(&change(b)))
        });
        let mut seen = rustc_hash::FxHashSet::default();
        let before = all.len();
        all.retain(|candidate| {
            let Some(evasion) = candidate.path.evasion else {
                return true;
            };
            let place = start * candidate.path.to_start * self.baked.evasions()[evasion].placement;
            let (x, z) = (
                cell(place.x, settings.alike_distance),
                cell(place.z, settings.alike_distance),
            );
            seen.insert((evasion, x, z, cell(place.heading(), settings.alike_angle)))
        });
        search.alike += before - all.len();
        let evasions = all.partition_point(|candidate| candidate.path.evasion.is_some());
        let kept = evasions.min(settings.evasion_candidates);
        all.drain(kept..evasions);
        search.cut += evasions - kept;
        all
    }
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
        let mut court = Court {
            case: &self,
            overlaps,
            judging,
            judged: vec![None; self.candidates.len()],
        };
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
    fn score(&self, index: usize, overlap: Option<&Overlap>, metres: f32) -> Score {
        let candidate = &self.candidates[index];
        let covered = overlap.map_or(0, |overlap| overlap.evasion);
        let weights = &self.query.settings.weights;
        Score::new(
            self.region_texels(candidate),
            covered,
            metres,
            candidate.rate.rate,
            weights,
        )
    }

    /// Texels of a candidate's evasion region in the slabs that the attack touches.
    fn region_texels(&self, candidate: &Candidate) -> u32 {
        let Some(evasion) = candidate.path.evasion else {
            return 0;
        };
        let region = self.query.baked.evasions()[evasion].region;
        let maps = |slab: Slab| self.query.baked.atlas().maps(region, slab);
        self.maps
            .attack
            .iter()
            .filter_map(|attack| maps(attack.slab))
            .map(|maps| maps.evasion.count())
            .sum()
    }

    /// A candidate's whole motion, from now until a sample after the attack's end at least.
    fn motion(&self, index: usize) -> Motion {
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

/// How much is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Judging {
    /// What the choice needs: candidates that the maps remove are left out as long as there is a
    /// clean one among the others, and a candidate that could not win even with no distance at all
    /// is not tested (with a weight of distance below 0 every one is).
    Needed,
    /// Every candidate, exactly, whatever the maps say: the culling path `exact`.
    All,
}

/// The exact test of candidates, from the most promising on.
struct Court<'a, 'b> {
    case: &'b Prepared<'a>,
    overlaps: &'b [Overlap],
    judging: Judging,
    judged: Vec<Option<Judged>>,
}

impl Court<'_, '_> {
    fn has_clean(&self) -> bool {
        self.judged
            .iter()
            .flatten()
            .any(|judged| judged.score.is_some())
    }

    /// Judges candidates, best bound first, as far as it is needed: V_d is never below 0, so that V
    /// without it is a bound, unless its weight rewards distance.
    fn judge(&mut self, candidates: Vec<usize>) {
        let bound = |&index: &usize| {
            (
                self.case.score(index, self.overlaps.get(index), 0.0).total,
                index,
            )
        };
        let mut bounds: Vec<(f32, usize)> = candidates.iter().map(bound).collect();
        bounds.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let extent = if self.judging == Judging::All {
            Extent::Whole
        } else {
            Extent::UntilHit
        };
        let is_bounded =
            self.judging == Judging::Needed && self.case.query.settings.weights.distance >= 0.0;
        let mut best = f32::INFINITY;
        for (bound, index) in bounds {
            if is_bounded && bound >= best {
                break;
            }
            let judged = self.test(index, extent);
            best = judged.score.map_or(best, |score| best.min(score.total));
            self.judged[index] = Some(judged);
        }
    }

    /// Which hit is the least deep? Asked where there is nothing else. What was found of a hit so
    /// far is a bound: the whole attack can only show it to be deeper.
    fn measure_least(&mut self) {
        let bound = |(index, judged): (usize, &Option<Judged>)| {
            Some((index, judged.as_ref()?.clearance.metres))
        };
        let mut bounds: Vec<(usize, f32)> =
            self.judged.iter().enumerate().filter_map(bound).collect();
        bounds.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mut least = f32::NEG_INFINITY;
        for (index, bound) in bounds {
            if bound < least {
                break;
            }
            let judged = self.test(index, Extent::Whole);
            least = least.max(judged.clearance.metres);
            self.judged[index] = Some(judged);
        }
    }

    fn test(&self, index: usize, extent: Extent) -> Judged {
        let clearance = clearance(
            self.case.query.baked,
            &self.case.motion(index),
            &self.case.attack,
            extent,
        );
        let clean = clearance.metres >= 0.0;
        Judged {
            clearance,
            score: clean.then(|| {
                self.case
                    .score(index, self.overlaps.get(index), clearance.metres)
            }),
        }
    }
}

/// What the exact test says of a candidate.
#[derive(Clone, Copy, Debug)]
struct Judged {
    clearance: Clearance,
    /// `None` for a hit.
    score: Option<Score>,
}

/// The clean candidate with the smallest score, or where none is clean, the one that is hit least
/// deep.
fn choose(judged: &[Option<Judged>]) -> usize {
    let of = |value: fn(&Judged) -> Option<f32>| {
        let values = judged
            .iter()
            .enumerate()
            .filter_map(move |(index, j)| Some((index, value(j.as_ref()?)?)));
        values
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(index, _)| index)
    };
    let best = of(|judged| judged.score.map(|score| score.total));
    best.or_else(|| of(|judged| Some(-judged.clearance.metres)))
        .unwrap_or(0)
}
