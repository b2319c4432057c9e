//! One candidate: its motion, its exact test, and its score.

use crate::anim::EventKind;
use crate::graph::{Motion, MotionGraph, MotionStep};
use crate::query::clearance::{
    Clearance, ExactTest, Extent, MotionBody, ObstacleHit, ObstacleTest, SAMPLE_RATE, Sampling,
};
use crate::query::cull::Overlap;
use crate::query::gather::{CandidateKind, EntryCandidate, MoveId};
use crate::query::request::{Evaluation, Query};
use crate::query::retime::retimed;
use crate::query::score::{Evaluated, Score};
use crate::query::state::QueryState;

impl QueryState {
    /// The path of a move; `None` for other candidates.
    pub(in crate::query) fn move_of(&self, index: usize) -> Option<MoveId> {
        match self.candidates.list[index].kind {
            CandidateKind::Move(path) => Some(path),
            _ => None,
        }
    }

    /// The counts of a candidate.
    pub(in crate::query) fn overlap(&self, index: usize) -> Option<Overlap> {
        self.candidates.overlap(index)
    }

    /// Whether the maps remove a candidate.
    pub(in crate::query) fn is_culled(&self, index: usize) -> bool {
        self.request.evaluation == Evaluation::Lazy
            && !self.starts_in_blend(index)
            && self.overlap(index).is_some_and(|overlap| overlap.body > 0)
    }

    /// Whether an evasion starts while the offset of an earlier motion still fades out. Maps and tracks do not include the offset.
    fn starts_in_blend(&self, index: usize) -> bool {
        match self.candidates.list[index].kind {
            CandidateKind::Evasion { start, .. } => start < self.request.blend.blends_until(),
            _ => false,
        }
    }

    /// The score of a candidate at a clearance of `metres`.
    pub(in crate::query) fn score(&self, query: Query<'_>, index: usize, metres: f32) -> Score {
        let candidate = &self.candidates.list[index];
        let pitch = query.baked.atlas().grid().attack_pitch;
        let covered = self.overlap(index).map_or(0, |o| o.evasion) * pitch * pitch;
        let weights = &query.settings.weights;
        Score::new(
            self.region_texels(query, index),
            covered,
            metres,
            candidate.rate.rate,
            matches!(candidate.kind, CandidateKind::Layer(_)),
            weights,
        )
    }

    /// The result of a candidate that was tested.
    pub(in crate::query) fn result(
        &self,
        query: Query<'_>,
        index: usize,
        clearance: Clearance,
    ) -> Evaluated {
        let score = || self.score(query, index, clearance.metres);
        Evaluated {
            clearance,
            score: clearance.is_clean().then(score),
            is_final: false,
            warp: None,
        }
    }

    /// Number of texels of a candidate's evasion region in the slabs that the attack touches.
    fn region_texels(&self, query: Query<'_>, index: usize) -> u32 {
        let maps = &self.maps;
        let Some(candidate) = maps.candidates.get(index) else {
            return 0;
        };
        maps.slabs(index)
            .map(|slab| query.baked.evasion_texels(candidate.region, slab))
            .sum()
    }

    /// A test of the request's attack.
    pub(in crate::query) fn exact_test<'a>(
        &'a self,
        query: Query<'a>,
        extent: Extent,
    ) -> ExactTest<'a> {
        ExactTest {
            extent,
            ..ExactTest::new(query.baked, &self.request.attack)
        }
    }

    /// Tests a candidate. Obstacles are tested exactly only if the attack misses it, because that is cheaper.
    pub(in crate::query) fn test(
        &self,
        query: Query<'_>,
        index: usize,
        extent: Extent,
        body: &mut MotionBody,
    ) -> Clearance {
        if let Some(hit) = self.move_blocked(query, index, body) {
            return hit.as_clearance();
        }
        let clearance = self.test_attack(query, index, extent, body);
        let may_win = clearance.is_clean() && clearance.metres < extent.below;
        if !self.request.is_among_obstacles() || !may_win {
            return clearance;
        }
        worse(clearance, self.candidate_entered(query, index, 0.0, body))
    }

    /// The obstacle that the root of a move enters.
    fn move_blocked(
        &self,
        query: Query<'_>,
        index: usize,
        body: &mut MotionBody,
    ) -> Option<ObstacleHit> {
        if !self.request.is_among_obstacles() || self.move_of(index).is_none() {
            return None;
        }
        let motion = &mut body.among_obstacles;
        self.motion(query, index, motion);
        let request = &self.request;
        let end = motion.moment_at(request.attack.end());
        let obstacles = &request.obstacles;
        obstacles.until(query.baked.graph(), end, 0.0)
    }

    /// The most harmful entry of a candidate into an obstacle. The search stops at a harm above `enough`, in metres.
    pub(in crate::query) fn candidate_entered(
        &self,
        query: Query<'_>,
        index: usize,
        enough: f32,
        body: &mut MotionBody,
    ) -> Option<ObstacleHit> {
        if !self.request.is_among_obstacles() {
            return None;
        }
        let mut motion = std::mem::take(&mut body.among_obstacles);
        self.motion(query, index, &mut motion);
        let hit = self.entered(query, &mut motion, enough, body);
        body.among_obstacles = motion;
        hit
    }

    /// The most harmful entry of a motion into an obstacle until the attack and its evasions have ended, or one above `enough`.
    pub(in crate::query) fn entered(
        &self,
        query: Query<'_>,
        motion: &mut Motion,
        enough: f32,
        body: &mut MotionBody,
    ) -> Option<ObstacleHit> {
        let (baked, request) = (query.baked, &self.request);
        if !self.request.is_among_obstacles() {
            return None;
        }
        let end = evasions_end(baked.graph(), motion, request.attack.end());
        motion.extend(baked.graph(), end);
        let until = motion.moment_at(end);
        let quick = request.obstacles.until(baked.graph(), until, enough);
        if quick.is_some() {
            return quick;
        }
        let test = ObstacleTest {
            baked,
            obstacles: request.obstacles.all(),
            seconds: (0.0, end),
            enough,
        };
        body.worst_entry(&test, motion)
    }

    /// Tests a candidate against the attack alone. An evasion is tested on its baked body track, a move at every fourth sample first.
    fn test_attack(
        &self,
        query: Query<'_>,
        index: usize,
        extent: Extent,
        body: &mut MotionBody,
    ) -> Clearance {
        let build = |motion: &mut Motion| self.motion(query, index, motion);
        match self.candidates.list[index].kind {
            CandidateKind::Evasion { .. } if self.starts_in_blend(index) => {
                self.exact_test(query, extent).on_built_motion(body, build)
            }
            CandidateKind::Entry(entry) => {
                // The chosen candidate is tested again at every sample.
                let sampling = match self.request.is_among_obstacles() {
                    true => Sampling::CoarseFirst,
                    false => Sampling::Each,
                };
                let test = ExactTest {
                    sampling,
                    ..self.exact_test(query, extent)
                };
                match self.entries[entry as usize].played_track(query.baked) {
                    Some(track) => test.on_track(&track, body, build),
                    None => test.on_built_motion(body, build),
                }
            }
            CandidateKind::Evasion { path, start } => {
                let evasion = self.request.evasion(query.baked, path, start);
                self.exact_test(query, extent)
                    .on_track(&evasion, body, build)
            }
            CandidateKind::Move(_) | CandidateKind::Layer(_) => {
                let test = ExactTest {
                    sampling: Sampling::CoarseFirst,
                    ..self.exact_test(query, extent)
                };
                test.on_built_motion(body, build)
            }
        }
    }

    /// Tests a candidate's whole motion, posed at every sample over the whole attack.
    pub(in crate::query) fn test_whole(
        &self,
        query: Query<'_>,
        index: usize,
        body: &mut MotionBody,
    ) -> Clearance {
        let test = self.exact_test(query, Extent::WHOLE);
        let clearance = test.on_built_motion(body, |motion| self.motion(query, index, motion));
        worse(
            clearance,
            self.candidate_entered(query, index, f32::INFINITY, body),
        )
    }

    /// Writes a candidate's whole motion, from now until one sample after the attack's end or later.
    pub(in crate::query) fn motion(&self, query: Query<'_>, index: usize, motion: &mut Motion) {
        let (baked, graph) = (query.baked, query.baked.graph());
        let request = &self.request;
        let candidate = &self.candidates.list[index];
        match candidate.kind {
            CandidateKind::Evasion { path, .. } => {
                let steps = retimed(baked, candidate.rate, baked.paths().edges(path));
                let evasion = MotionStep {
                    edge: baked.path_evasion(path).edge,
                    rate: 1.0,
                };
                motion.restart(graph, request.playhead, steps.chain([evasion]));
                motion.continue_blend(&request.blend, 0.0);
            }
            CandidateKind::Move(path) => {
                let backwards = self.moves.edges_backwards(path);
                let steps = backwards.map(|edge| MotionStep { edge, rate: 1.0 });
                motion.restart_backwards(graph, request.playhead, steps);
                motion.continue_blend(&request.blend, 0.0);
            }
            CandidateKind::Entry(entry) => {
                let EntryCandidate { delay, entry, .. } = &self.entries[entry as usize];
                motion.restart(graph, request.playhead, []);
                motion.continue_blend(&request.blend, 0.0);
                motion.enter(graph, *delay, entry);
            }
            CandidateKind::Layer(layer) => {
                motion.restart(graph, request.playhead, []);
                motion.continue_blend(&request.blend, 0.0);
                let layer = self.layers[layer as usize].layer;
                motion.set_layer(Some(layer));
                motion.extend(graph, layer.end());
            }
        }
        motion.extend(graph, request.attack.end() + 2.0 / SAMPLE_RATE);
    }
}

/// The clearance, or that of an obstacle hit if it is smaller.
pub(in crate::query) fn worse(clearance: Clearance, hit: Option<ObstacleHit>) -> Clearance {
    match hit {
        Some(hit) if -hit.harm < clearance.metres => hit.as_clearance(),
        _ => clearance,
    }
}

/// Time at which the attack, and all evasions that the motion begins before the attack's end, have ended, in seconds.
pub(crate) fn evasions_end(graph: &MotionGraph, motion: &Motion, attack_end: f32) -> f32 {
    let ends = motion.events(graph).filter_map(|(event, [start, end])| {
        let is_evasion = graph.event(event).kind == EventKind::Evasion;
        (is_evasion && start < attack_end).then_some(end)
    });
    ends.fold(attack_end, f32::max)
}
