use super::ask::Query;
use super::candidate::CandidateKind;
use super::clearance::{Clearance, ExactTest, Extent, MotionBody, SAMPLE_RATE, Sampling};
use super::cull::Overlap;
use super::entry_candidate::EntryCandidate;
use super::evaluated::Evaluated;
use super::evaluation::Evaluation;
use super::moves::MoveId;
use super::obstacle::{ObstacleHit, ObstacleTest};
use super::retime::retimed;
use super::score::{Score, ScoreFacts};
use super::state::QueryState;
use crate::anim::EventKind;
use crate::graph::{Motion, MotionGraph, MotionStep};

/// Data of the candidates before the tests.
#[derive(Clone, Copy)]
pub(super) struct EvaluationInput<'a> {
    pub query: Query<'a>,
    pub state: &'a QueryState,
}

impl EvaluationInput<'_> {
    /// The path of a move; `None` for other candidates.
    pub(super) fn move_of(&self, index: usize) -> Option<MoveId> {
        match self.state.candidates.list[index].kind {
            CandidateKind::Move(path) => Some(path),
            _ => None,
        }
    }

    /// The counts of a candidate.
    pub(super) fn overlap(&self, index: usize) -> Option<Overlap> {
        self.state.candidates.overlap(index)
    }

    /// Whether the maps remove a candidate.
    pub(super) fn is_culled(&self, index: usize) -> bool {
        self.state.request.evaluation == Evaluation::Lazy
            && !self.starts_in_blend(index)
            && self.overlap(index).is_some_and(|overlap| overlap.body > 0)
    }

    /// Whether there are obstacles.
    pub(super) fn is_among_obstacles(&self) -> bool {
        !self.state.request.obstacles.all().is_empty()
    }

    /// Whether an evasion starts while the offset of an earlier motion still fades out. Maps and tracks do not include the offset.
    fn starts_in_blend(&self, index: usize) -> bool {
        match self.state.candidates.list[index].kind {
            CandidateKind::Evasion { start, .. } => start < self.state.request.blend.blends_until(),
            _ => false,
        }
    }

    /// The score of a candidate at a clearance of `metres`.
    pub(super) fn score(&self, index: usize, metres: f32) -> Score {
        let candidate = &self.state.candidates.list[index];
        let pitch = self.query.baked.atlas().grid().attack_pitch;
        let covered = self.overlap(index).map_or(0, |o| o.evasion) * pitch * pitch;
        let weights = &self.query.settings.weights;
        let facts = ScoreFacts {
            region_texels: self.region_texels(index),
            covered_texels: covered,
            clearance: metres,
            rate: candidate.rate.rate,
            is_layered: matches!(candidate.kind, CandidateKind::Layer(_)),
        };
        Score::new(facts, weights)
    }

    /// The result of a candidate that was tested.
    pub(super) fn result(&self, index: usize, clearance: Clearance) -> Evaluated {
        let score = || self.score(index, clearance.metres);
        Evaluated {
            clearance,
            score: clearance.is_clean().then(score),
            is_final: false,
            warp: None,
        }
    }

    /// Number of texels of a candidate's evasion region in the slabs that the attack touches.
    fn region_texels(&self, index: usize) -> u32 {
        let maps = &self.state.maps;
        let Some(candidate) = maps.candidates.get(index) else {
            return 0;
        };
        maps.slabs(index)
            .map(|slab| self.query.baked.evasion_texels(candidate.region, slab))
            .sum()
    }

    /// A test of the request's attack.
    pub(super) fn exact_test(&self, extent: Extent) -> ExactTest<'_> {
        ExactTest {
            extent,
            ..ExactTest::new(self.query.baked, &self.state.request.attack)
        }
    }

    /// Tests a candidate. Obstacles are tested exactly only if the attack misses it, because that is cheaper.
    pub(super) fn test(&self, index: usize, extent: Extent, body: &mut MotionBody) -> Clearance {
        if let Some(hit) = self.move_blocked(index, body) {
            return hit.as_clearance();
        }
        let clearance = self.test_attack(index, extent, body);
        let may_win = clearance.is_clean() && clearance.metres < extent.below;
        if !self.is_among_obstacles() || !may_win {
            return clearance;
        }
        worse(clearance, self.candidate_entered(index, 0.0, body))
    }

    /// The obstacle that the root of a move enters.
    fn move_blocked(&self, index: usize, body: &mut MotionBody) -> Option<ObstacleHit> {
        if !self.is_among_obstacles() || self.move_of(index).is_none() {
            return None;
        }
        let motion = &mut body.obstacles.motion;
        self.motion(index, motion);
        let request = &self.state.request;
        let end = motion.moment_at(request.attack.end());
        let obstacles = &request.obstacles;
        obstacles.until(self.query.baked.graph(), end, 0.0)
    }

    /// The most harmful entry of a candidate into an obstacle. The search stops at a harm above `enough`, in metres.
    pub(super) fn candidate_entered(
        &self,
        index: usize,
        enough: f32,
        body: &mut MotionBody,
    ) -> Option<ObstacleHit> {
        if !self.is_among_obstacles() {
            return None;
        }
        let mut motion = std::mem::take(&mut body.obstacles.motion);
        self.motion(index, &mut motion);
        let hit = self.entered(&mut motion, enough, body);
        body.obstacles.motion = motion;
        hit
    }

    /// The most harmful entry of a motion into an obstacle until the attack and its evasions have ended, or one above `enough`.
    pub(super) fn entered(
        &self,
        motion: &mut Motion,
        enough: f32,
        body: &mut MotionBody,
    ) -> Option<ObstacleHit> {
        let (baked, request) = (self.query.baked, &self.state.request);
        if !self.is_among_obstacles() {
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
        test.on_motion(motion, body)
    }

    /// Tests a candidate against the attack alone. An evasion is tested on its baked body track, a move at every fourth sample first.
    fn test_attack(&self, index: usize, extent: Extent, body: &mut MotionBody) -> Clearance {
        let build = |motion: &mut Motion| self.motion(index, motion);
        match self.state.candidates.list[index].kind {
            CandidateKind::Evasion { .. } if self.starts_in_blend(index) => {
                self.exact_test(extent).on_built_motion(body, build)
            }
            CandidateKind::Entry(entry) => {
                let entry = &self.state.entries[entry as usize];
                // The chosen candidate is tested again at every sample.
                let sampling = match self.is_among_obstacles() {
                    true => Sampling::CoarseFirst,
                    false => Sampling::Each,
                };
                let test = ExactTest {
                    sampling,
                    ..self.exact_test(extent)
                };
                test.on_entry(entry, body, build)
            }
            CandidateKind::Evasion { path, start } => {
                let request = &self.state.request;
                let evasion = request.evasion(self.query.baked, path, start);
                self.exact_test(extent).on_track(&evasion, body, build)
            }
            CandidateKind::Move(_) | CandidateKind::Layer(_) => {
                let test = ExactTest {
                    sampling: Sampling::CoarseFirst,
                    ..self.exact_test(extent)
                };
                test.on_built_motion(body, build)
            }
        }
    }

    /// Tests a candidate's whole motion, posed at every sample over the whole attack.
    pub(super) fn test_whole(&self, index: usize, body: &mut MotionBody) -> Clearance {
        let test = self.exact_test(Extent::WHOLE);
        let clearance = test.on_built_motion(body, |motion| self.motion(index, motion));
        worse(
            clearance,
            self.candidate_entered(index, f32::INFINITY, body),
        )
    }

    /// Writes a candidate's whole motion, from now until one sample after the attack's end or later.
    pub(super) fn motion(&self, index: usize, motion: &mut Motion) {
        let (baked, graph) = (self.query.baked, self.query.baked.graph());
        let request = &self.state.request;
        let candidate = &self.state.candidates.list[index];
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
                let backwards = self.state.moves.edges_backwards(path);
                let steps = backwards.map(|edge| MotionStep { edge, rate: 1.0 });
                motion.restart_backwards(graph, request.playhead, steps);
                motion.continue_blend(&request.blend, 0.0);
            }
            CandidateKind::Entry(entry) => {
                let EntryCandidate { delay, entry, .. } = &self.state.entries[entry as usize];
                motion.restart(graph, request.playhead, []);
                motion.continue_blend(&request.blend, 0.0);
                motion.enter(graph, *delay, entry);
            }
            CandidateKind::Layer(layer) => {
                motion.restart(graph, request.playhead, []);
                motion.continue_blend(&request.blend, 0.0);
                let layer = self.state.layers[layer as usize].layer;
                motion.set_layer(Some(layer));
                motion.extend(graph, layer.end());
            }
        }
        motion.extend(graph, request.attack.end() + 2.0 / SAMPLE_RATE);
    }
}

/// The clearance, or that of an obstacle hit if it is smaller.
pub(super) fn worse(clearance: Clearance, hit: Option<ObstacleHit>) -> Clearance {
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
