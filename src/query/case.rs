use super::Query;
use super::candidate::{Candidate, Way};
use super::clearance::{
    Clearance, Extent, MotionBody, SAMPLE_RATE, Sampling, on_one_motion, on_track,
};
use super::context::KnownHit;
use super::cull::Overlap;
use super::moves::{MoveId, MoveSearch};
use super::placement::CullMaps;
use super::retime::Direction;
use super::score::Score;
use super::situation::Situation;
use crate::graph::{EdgeId, Motion, Step};
use crate::maps::PathId;

/// What is known of a query's candidates before they are tested.
#[derive(Clone, Copy)]
pub(super) struct Case<'a> {
    pub query: Query<'a>,
    pub situation: Situation<'a>,
    pub candidates: &'a [Candidate],
    pub moves: &'a MoveSearch,
    pub maps: &'a CullMaps,
    /// How many candidates were given to be counted; these come first.
    pub counted: usize,
    pub overlaps: &'a [Overlap],
    /// The candidates that come after those.
    pub known: &'a [KnownHit],
}

impl Case<'_> {
    /// The path of a candidate that only moves.
    pub(super) fn move_of(&self, index: usize) -> Option<MoveId> {
        match self.candidates[index].way {
            Way::Move(path) => Some(path),
            Way::Evasion { .. } => None,
        }
    }

    /// What was counted of a candidate, in this round or before.
    pub(super) fn overlap(&self, index: usize) -> Option<Overlap> {
        match index.checked_sub(self.counted) {
            None => self.overlaps.get(index).copied(),
            Some(index) => self.known.get(index).map(|hit| hit.overlap),
        }
    }

    /// A candidate's score if its clearance were `metres`.
    pub(super) fn score(&self, index: usize, metres: f32) -> Score {
        let candidate = &self.candidates[index];
        let pitch = self.query.baked.atlas().grid().attack_pitch;
        let covered = self.overlap(index).map_or(0, |o| o.evasion) * pitch * pitch;
        let weights = &self.query.settings.weights;
        let texels = self.region_texels(index);
        Score::new((texels, covered), metres, candidate.rate.rate, weights)
    }

    /// Texels of a candidate's evasion region in the slabs that the attack touches.
    fn region_texels(&self, index: usize) -> u32 {
        let Some(candidate) = self.maps.candidates.get(index) else {
            return 0;
        };
        self.maps
            .slabs(index)
            .map(|slab| self.query.baked.evasion_texels(candidate.region, slab))
            .sum()
    }

    /// The exact test of a candidate. An evasion is tested on what is known of it beforehand.
    pub(super) fn test(&self, index: usize, extent: Extent, body: &mut MotionBody) -> Clearance {
        let attack = (self.situation.attack, extent);
        let baked = self.query.baked;
        match self.candidates[index].way {
            Way::Evasion { path, start } => {
                let evasion = self.situation.evasion(baked, path, start);
                let motion = |motion: &mut Motion| self.motion(index, motion);
                on_track(baked, &evasion, attack, body, motion)
            }
            Way::Move(_) => self.test_posed(index, (Sampling::CoarseFirst, extent), body),
        }
    }

    /// The exact test of a candidate's very motion, posed sample by sample.
    pub(super) fn test_posed(
        &self,
        index: usize,
        (sampling, extent): (Sampling, Extent),
        body: &mut MotionBody,
    ) -> Clearance {
        let mut motion = body.take_motion();
        self.motion(index, &mut motion);
        let attack = (self.situation.attack, extent);
        let clearance = on_one_motion(self.query.baked, (&motion, sampling), attack, body);
        body.return_motion(motion);
        clearance
    }

    /// A candidate's whole motion, from now until a sample after the attack's end at least.
    pub(super) fn motion(&self, index: usize, motion: &mut Motion) {
        let graph = self.query.baked.graph();
        let playhead = self.situation.playhead;
        let candidate = &self.candidates[index];
        match candidate.way {
            Way::Evasion { path, .. } => {
                let steps = self.evasion_steps(path, candidate.rate.rate, candidate.rate.direction);
                motion.restart(graph, playhead, steps);
            }
            Way::Move(path) => {
                let backwards = self.moves.edges_backwards(path);
                let steps = backwards.map(|edge| Step { edge, rate: 1.0 });
                motion.restart_backwards(graph, playhead, steps);
            }
        }
        motion.extend(graph, self.situation.attack.end() + 2.0 / SAMPLE_RATE);
    }

    fn evasion_steps(
        &self,
        path: PathId,
        rate: f32,
        direction: Direction,
    ) -> impl Iterator<Item = Step> + '_ {
        let baked = self.query.baked;
        let rate_of = move |edge: EdgeId| {
            let retimable = baked.retimable(edge);
            let changed = match direction {
                Direction::Unchanged => false,
                Direction::Faster => retimable.faster,
                Direction::Slower => retimable.slower,
            };
            if changed { rate } else { 1.0 }
        };
        let steps = baked.paths().edges(path).map(move |edge| Step {
            edge,
            rate: rate_of(edge),
        });
        let evasion = baked.evasions()[baked.paths().path(path).evasion as usize].edge;
        steps.chain(std::iter::once(Step {
            edge: evasion,
            rate: 1.0,
        }))
    }
}
