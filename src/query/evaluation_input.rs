use super::ask::Query;
use super::candidate::CandidateKind;
use super::clearance::{Clearance, ExactTest, Extent, MotionBody, SAMPLE_RATE, Sampling};
use super::cull::Overlap;
use super::entry_candidate::EntryCandidate;
use super::evaluated::Evaluated;
use super::evaluation::Evaluation;
use super::moves::MoveId;
use super::retime::retimed;
use super::score::{Score, ScoreFacts};
use super::state::QueryState;
use crate::graph::{Motion, Step};

/// Data of the candidates before the tests.
#[derive(Clone, Copy)]
pub(super) struct EvaluationInput<'a> {
    pub query: Query<'a>,
    pub state: &'a QueryState,
}

impl EvaluationInput<'_> {
    /// The path of a move; `None` for an evasion.
    pub(super) fn move_of(&self, index: usize) -> Option<MoveId> {
        match self.state.candidates.list[index].kind {
            CandidateKind::Move(path) => Some(path),
            CandidateKind::Evasion { .. } | CandidateKind::Entry(_) => None,
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

    /// Whether an evasion starts while the offset of an earlier motion still fades out. Maps and tracks do not show that body.
    fn starts_in_blend(&self, index: usize) -> bool {
        match self.state.candidates.list[index].kind {
            CandidateKind::Evasion { start, .. } => start < self.state.request.blend.blends_until(),
            CandidateKind::Move(_) | CandidateKind::Entry(_) => false,
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

    /// Texels of a candidate's evasion region in the slabs that the attack touches.
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

    /// Tests a candidate as cheaply as it can be. An evasion is tested on its baked body track, a move at every fourth sample first.
    pub(super) fn test(&self, index: usize, extent: Extent, body: &mut MotionBody) -> Clearance {
        let build = |motion: &mut Motion| self.motion(index, motion);
        match self.state.candidates.list[index].kind {
            CandidateKind::Evasion { .. } if self.starts_in_blend(index) => {
                self.exact_test(extent).on_built_motion(body, build)
            }
            CandidateKind::Entry(entry) => {
                let entry = &self.state.entries[entry as usize];
                self.exact_test(extent).on_entry(entry, body, build)
            }
            CandidateKind::Evasion { path, start } => {
                let request = &self.state.request;
                let evasion = request.evasion(self.query.baked, path, start);
                self.exact_test(extent).on_track(&evasion, body, build)
            }
            CandidateKind::Move(_) => {
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
        test.on_built_motion(body, |motion| self.motion(index, motion))
    }

    /// Writes a candidate's whole motion, from now until one sample after the attack's end or later.
    pub(super) fn motion(&self, index: usize, motion: &mut Motion) {
        let (baked, graph) = (self.query.baked, self.query.baked.graph());
        let request = &self.state.request;
        let candidate = &self.state.candidates.list[index];
        match candidate.kind {
            CandidateKind::Evasion { path, .. } => {
                let steps = retimed(baked, candidate.rate, baked.paths().edges(path));
                let evasion = baked.evasions()[baked.paths().path(path).evasion as usize];
                let evasion = Step {
                    edge: evasion.edge,
                    rate: 1.0,
                };
                motion.restart(graph, request.playhead, steps.chain([evasion]));
                motion.continue_blend(&request.blend, 0.0);
            }
            CandidateKind::Move(path) => {
                let backwards = self.state.moves.edges_backwards(path);
                let steps = backwards.map(|edge| Step { edge, rate: 1.0 });
                motion.restart_backwards(graph, request.playhead, steps);
                motion.continue_blend(&request.blend, 0.0);
            }
            CandidateKind::Entry(entry) => {
                let EntryCandidate { delay, entry, .. } = &self.state.entries[entry as usize];
                motion.restart(graph, request.playhead, []);
                motion.continue_blend(&request.blend, 0.0);
                motion.enter(graph, *delay, entry);
            }
        }
        motion.extend(graph, request.attack.end() + 2.0 / SAMPLE_RATE);
    }
}
