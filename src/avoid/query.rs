//! The first half of a query: from where a character is to the candidates and their maps.
//!
//! Source: Masaoka & Oshita, sections 5.1 to 5.3. The second half is [`Prepared::decide`]; between the two, somebody counts.

use serde::{Deserialize, Serialize};

use super::enumerate::{
    EnumerateSettings, FoundPath, SearchReport, cell, paths_to_evasions, plain_paths,
};
use super::placement::{CullMaps, PlacedRegion, Scene};
use super::prepared::Candidate;
use super::retime::{Direction, Rate, RateError, RateSettings, rate};
use super::score::Weights;
use super::{Attack, Prepared};
use crate::graph::Playhead;
use crate::region::BakedGraph;

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
    pub(super) baked: &'a BakedGraph,
    pub(super) settings: &'a QuerySettings,
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
        let (node, wait) = (
            playhead.next_node(graph),
            playhead.seconds_to_next_node(graph),
        );
        let available = attack.start() - wait;
        let limits = (&self.settings.enumerate, &self.settings.rates);
        let (mut paths, mut search) = paths_to_evasions(self.baked, node, available, limits);
        let seconds = (attack.end() - wait).min(2.0 * self.settings.enumerate.horizon);
        let (plain, plain_search) =
            plain_paths(self.baked, node, seconds, &self.settings.enumerate);
        search += plain_search;
        paths.extend(plain);
        let (in_time, late) = self.retime(paths, available);
        let candidates = self.different_answers(playhead, in_time, &mut search);
        Prepared {
            query: *self,
            playhead,
            attack: attack.clone(),
            maps: self.maps(playhead, attack, &candidates),
            candidates,
            late,
            search,
        }
    }

    /// Parts the paths into those that a rate brings in time, `available` seconds after their
    /// start, and those that none does. A path that only moves is always in time.
    fn retime(
        &self,
        paths: Vec<FoundPath>,
        available: f32,
    ) -> (Vec<Candidate>, Vec<(FoundPath, RateError)>) {
        let unchanged = Rate {
            rate: 1.0,
            direction: Direction::Unchanged,
        };
        let (mut in_time, mut late) = (Vec::new(), Vec::new());
        for path in paths {
            let found = match path.evasion {
                Some(_) => rate(&path.durations, available, &self.settings.rates),
                None => Ok(unchanged),
            };
            match found {
                Ok(rate) => in_time.push(Candidate { path, rate }),
                Err(error) => late.push((path, error)),
            }
        }
        (in_time, late)
    }

    /// The maps of the candidates that end in an evasion, in the frame of the next node.
    fn maps(&self, playhead: Playhead, attack: &Attack, candidates: &[Candidate]) -> CullMaps {
        let graph = self.baked.graph();
        let start = graph.node(playhead.next_node(graph));
        let path_start = graph.placement(start.clip, start.frame);
        let available = attack.start() - playhead.seconds_to_next_node(graph);
        let mut clocks: Vec<f32> = Vec::new();
        let mut clock = |candidate: &Candidate| {
            // Retimed, the evasion starts just with the attack.
            let late = match candidate.rate.direction {
                Direction::Unchanged => candidate.path.durations.total - available,
                _ => 0.0,
            };
            let alike = |other: &f32| (other - late).abs() <= 1e-5;
            clocks.iter().position(alike).unwrap_or_else(|| {
                clocks.push(late);
                clocks.len() - 1
            }) as u32
        };
        let placed = candidates.iter().filter_map(|candidate| {
            let evasion = &self.baked.evasions()[candidate.path.evasion?];
            let placement = path_start.inverse() * candidate.path.to_start * evasion.placement;
            Some(PlacedRegion {
                region: evasion.region,
                placement,
                clock: clock(candidate),
            })
        });
        let placed: Vec<PlacedRegion> = placed.collect();
        let to_path_start = (playhead.next_clip_to_world(graph) * path_start).inverse();
        let mut maps = CullMaps::default();
        maps.fill(&Scene {
            atlas: self.baked.atlas(),
            attack: &attack.placed(to_path_start),
            clocks: &clocks,
            placed: &placed,
            reach: self.baked.reach(),
        });
        maps
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
