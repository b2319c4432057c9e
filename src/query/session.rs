//! The state machine of a query, and its one driver.
//!
//! Source: Masaoka & Oshita, section 5. A session goes through `start → (cull_input → submit)* → done`:
//!
//! ```text
//! start ─▶ gather ─▶ draw maps ─▶ [a culling path counts] ─▶ evaluate, warp, select ─▶ done
//!            ▲                                                        │
//!            └─────────────── no candidate of the grid is clean ──────┘
//! ```
//!
//! All state is stored in the [`QueryContext`]. A session can therefore be dropped while a device counts, and be resumed frames later.

use std::convert::Infallible;

use super::answer::Answer;
use super::attack::Attack;
use super::clearance::{MotionBody, WorkLimit};
use super::cull::{Counted, CullInput, Overlap, PlacedRegion, cpu};
use super::evaluate::Evaluator;
use super::gather::{Candidate, CandidateKind, GatherScratch, gather_evasions, reject_blocked};
use super::request::{PlanScope, PlanStage, Query, Request};
use super::select::select;
use super::settings::Enumerate;
use super::state::{QueryState, Source};
use super::warp::Warper;
use crate::maps::PathId;

/// The memory of queries: the state of the current query, and scratch. A query allocates nothing if its context has been used for similar
/// queries. Every thread needs its own context, and so does every query that waits for its counts.
#[derive(Clone, Debug, Default)]
pub struct QueryContext {
    state: QueryState,
    scratch: Scratch,
    culler: Option<cpu::Culler>,
}

impl QueryContext {
    /// The memory of exact tests, with the poses of the latest query or plan.
    pub(crate) fn body(&mut self) -> &mut MotionBody {
        self.scratch.evaluator.body()
    }

    /// Sets what the tests of a plan may cost, and removes the poses of earlier queries.
    pub(crate) fn start_plan(&mut self, limit: WorkLimit) {
        self.forget_poses();
        self.body().set_limit(limit);
    }

    pub(crate) fn forget_poses(&mut self) {
        self.scratch.evaluator.forget_poses();
    }

    pub(crate) fn end_plan(&mut self) {
        self.body().set_limit(WorkLimit::default());
    }

    /// The stage in which the limit of the plan ended the last query without a clean candidate; `None` if it did not.
    pub(crate) fn late_stage(&self) -> Option<PlanStage> {
        self.state.late_stage
    }
}

#[derive(Clone, Debug, Default)]
struct Scratch {
    gather: GatherScratch,
    evaluator: Evaluator,
    warper: Warper,
    placed: Vec<PlacedRegion>,
    time_offsets: Vec<f32>,
    /// The attack in the node's frame.
    attack: Option<Attack>,
}

/// A query that waits for the counts of a culling path.
#[derive(Debug)]
pub struct Session<'a> {
    query: Query<'a>,
    state: &'a mut QueryState,
    scratch: &'a mut Scratch,
}

/// Identifies one round of one query in one context.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SessionId(u64);

/// What a session needs next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Step {
    /// The answer is written.
    Done,
    /// Other candidates must be counted. No candidate of the grid is clean, and [`Session::cull_input`] now holds the candidates of all paths.
    Recount,
}

impl<'a> Query<'a> {
    /// Gathers the candidates of a request and draws their maps.
    pub fn start<'s>(&self, request: Request<'_>, context: &'s mut QueryContext) -> Session<'s>
    where
        'a: 's,
    {
        context.forget_poses();
        let QueryContext { state, scratch, .. } = context;
        Session::start(*self, state, scratch, request, None)
    }

    /// Resumes a session that was dropped before it was done. Use the query that started it.
    ///
    /// Returns `None` if `context` has since gone on to another round or query.
    pub fn resume<'s>(&self, id: SessionId, context: &'s mut QueryContext) -> Option<Session<'s>>
    where
        'a: 's,
    {
        let query = *self;
        let QueryContext { state, scratch, .. } = context;
        let is_waiting = state.is_waiting && state.round == id.0;
        is_waiting.then_some(Session {
            query,
            state,
            scratch,
        })
    }

    /// Answers a request on the CPU without culling ([`CullPath::None`](super::CullPath::None)). To cull, use [`Query::start`] and
    /// [`Session::run`] or [`Session::run_on_cpu`]; the answer is the same.
    pub fn answer(&self, request: Request<'_>, context: &mut QueryContext, answer: &mut Answer) {
        context.forget_poses();
        self.answer_in_scope(request, None, context, answer);
    }

    /// Answers a request of a plan, or any request without a scope. If no motion avoids the attack of a plan, the answer may avoid the attack
    /// without the margin.
    ///
    /// The queries of a plan have their poses in common: [`QueryContext::start_plan`] comes before the first of them.
    pub(crate) fn answer_in_scope(
        &self,
        request: Request<'_>,
        scope: Option<PlanScope<'_>>,
        context: &mut QueryContext,
        answer: &mut Answer,
    ) {
        let (state, scratch) = (&mut context.state, &mut context.scratch);
        let new = || cpu::Culler::default().counting(Counted::FOR_A_SCORE);
        let culler = context.culler.get_or_insert_with(new);
        let mut session = Session::start(*self, state, scratch, request, scope);
        session.run_on_cpu(culler, answer);
    }
}

impl<'a> Session<'a> {
    fn start(
        query: Query<'a>,
        state: &'a mut QueryState,
        scratch: &'a mut Scratch,
        request: Request<'_>,
        scope: Option<PlanScope<'_>>,
    ) -> Self {
        state.request.set(query.baked, request);
        state.late_stage = None;
        if let Some(scope) = scope {
            state.request.limit(scope);
        }
        let first = state.request.first_stage;
        state.candidates.known.clear();
        state.is_waiting = true;
        let mut session = Self {
            query,
            state,
            scratch,
        };
        let uses_grid = query.settings.enumerate.uses_grid() && !session.state.request.fills_room();
        if uses_grid && first == PlanStage::Grid {
            session.gather(Source::Grid);
            if session.state.candidates.list.is_empty() {
                session.gather(Source::EmptyCells);
            }
        } else {
            session.gather(Source::Whole);
        }
        session
    }

    /// Id of this round, for [`Query::resume`].
    pub fn id(&self) -> SessionId {
        SessionId(self.state.round)
    }

    /// The set that the candidates come from.
    pub fn source(&self) -> Source {
        self.state.source
    }

    /// The candidates that a culling path has to count: those that end in an evasion and that no earlier round has shown to be hit.
    pub fn cull_input(&self) -> CullInput<'_> {
        CullInput {
            atlas: self.query.baked.atlas(),
            attack: &self.state.maps.attack,
            candidates: &self.state.maps.candidates,
        }
    }

    /// Counts with a culling path, for [`Session::submit_counted`]. `count` writes an [`Overlap`] for each candidate of its input.
    ///
    /// # Errors
    /// The error of `count`.
    pub fn count<E>(
        &mut self,
        count: impl FnOnce(&CullInput<'_>, &mut Vec<Overlap>) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut overlaps = std::mem::take(&mut self.state.candidates.overlaps);
        let counted = count(&self.cull_input(), &mut overlaps);
        self.state.candidates.overlaps = overlaps;
        counted
    }

    /// The counts of this round, in the order of [`Session::cull_input`].
    pub fn counts(&self) -> &[Overlap] {
        &self.state.candidates.overlaps
    }

    /// Continues with counts of [`Session::cull_input`], in its order.
    pub fn submit(&mut self, counts: &[Overlap], answer: &mut Answer) -> Step {
        let overlaps = &mut self.state.candidates.overlaps;
        overlaps.clear();
        overlaps.extend_from_slice(counts);
        self.submit_counted(answer)
    }

    /// Continues with the counts of [`Session::count`]: tests candidates, and writes the answer or gathers other candidates.
    pub fn submit_counted(&mut self, answer: &mut Answer) -> Step {
        let (gather, evaluator) = (&mut self.scratch.gather, &mut self.scratch.evaluator);
        let (query, warper) = (self.query, &mut self.scratch.warper);
        let motion = &mut answer.motion;
        let selection = select(query, self.state, gather, evaluator, warper, motion);
        let Some(selection) = selection else {
            self.gather(Source::NothingClean);
            return Step::Recount;
        };
        answer.fill(query.baked, self.state, &evaluator.evaluated, selection);
        self.state.is_waiting = false;
        Step::Done
    }

    /// Runs the session to its end with a culling path.
    ///
    /// # Errors
    /// The error of `count`. The session then still waits for the counts of its round.
    pub fn run<E>(
        &mut self,
        answer: &mut Answer,
        mut count: impl FnMut(&CullInput<'_>, &mut Vec<Overlap>) -> Result<(), E>,
    ) -> Result<(), E> {
        loop {
            self.count(&mut count)?;
            if self.submit_counted(answer) == Step::Done {
                return Ok(());
            }
        }
    }

    /// Runs the session to its end on the CPU.
    pub fn run_on_cpu(&mut self, culler: &mut cpu::Culler, answer: &mut Answer) {
        let Ok(()) = self.run(answer, |input, counts| {
            let _span = tracing::trace_span!("query: cull on the CPU").entered();
            culler.count(input, counts);
            Ok::<_, Infallible>(())
        });
    }

    /// Also draws the outer maps of the attack, so that [`Overlap::outer`] can be counted.
    ///
    /// The choice needs no proof of a miss. A session therefore starts without outer maps, and all its candidates are
    /// [open](super::cull::CullCandidate::open).
    pub fn draw_outer_maps(&mut self) {
        self.draw_maps(true);
    }

    /// The paths of the candidates of [`Session::cull_input`], in its order.
    pub fn counted_paths(&self) -> impl Iterator<Item = PathId> {
        let candidates = &self.state.candidates;
        candidates.list[..candidates.counted]
            .iter()
            .filter_map(Candidate::path)
    }

    /// Begins a round: finds its candidates and draws their maps.
    fn gather(&mut self, source: Source) {
        let _span = tracing::trace_span!("query: gather", source = ?source).entered();
        self.state.round += 1;
        self.state.source = source;
        let enumerate = match source {
            Source::Grid => self.query.settings.enumerate,
            _ => Enumerate::Whole,
        };
        let (request, candidates) = (&self.state.request, &mut self.state.candidates);
        let scratch = &mut self.scratch.gather.evasions;
        gather_evasions(self.query, request, enumerate, candidates, scratch);
        if request.first_stage > PlanStage::Evasions {
            candidates.list.clear();
            candidates.counted = 0;
        }
        reject_blocked(self.query.baked, request, candidates);
        candidates.put_known_last();
        candidates.goals.clear();
        self.draw_maps(false);
    }

    /// Transforms the evasions of the candidates to the frame of the next node, and draws the attack's maps there.
    fn draw_maps(&mut self, outer: bool) {
        let _span = tracing::trace_span!("query: draw the attack's maps").entered();
        let (placed, time_offsets) = (&mut self.scratch.placed, &mut self.scratch.time_offsets);
        let (baked, request) = (self.query.baked, &self.state.request);
        placed.clear();
        time_offsets.clear();
        let attack_start = request.attack.start();
        let counted = match request.fills_room() {
            true => 0,
            false => self.state.candidates.counted,
        };
        let counted = &self.state.candidates.list[..counted];
        placed.extend(counted.iter().filter_map(|candidate| {
            let CandidateKind::Evasion { path, start } = candidate.kind else {
                return None;
            };
            let path = request.path(path);
            Some(PlacedRegion {
                region: baked.evasions()[path.goal as usize].region,
                placement: path.placement,
                clock: offset_index(time_offsets, start - attack_start),
            })
        }));
        let attack = self.scratch.attack.get_or_insert_with(Attack::empty);
        attack.place_from(&request.attack, request.node_frame.inverse());
        let (atlas, reach) = (baked.atlas(), baked.reach());
        let maps = &mut self.state.maps;
        maps.draw(atlas, attack, time_offsets, placed, reach, outer);
    }
}

/// Index of the time offset from the attack's start to the evasion's start, in seconds. Adds it if there is none. Offsets that single precision
/// cannot distinguish share an index.
fn offset_index(time_offsets: &mut Vec<f32>, offset: f32) -> u32 {
    const ALIKE: f32 = 1e-5;
    let alike = |other: &f32| (other - offset).abs() <= ALIKE;
    let found = time_offsets.iter().position(alike);
    found.unwrap_or_else(|| {
        time_offsets.push(offset);
        time_offsets.len() - 1
    }) as u32
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::graph::{EdgeId, Playhead};
    use crate::maps::SphereKey;
    use crate::math::Rigid2;
    use crate::query::fixture::baked;
    use crate::query::settings::QuerySettings;

    #[test]
    fn a_plan_that_ran_out_of_work_says_where_and_what_follows_is_what_it_would_have_been() {
        let key = |t: f32, z: f32| SphereKey {
            t,
            center: Vec3::new(0.0, 1.3, z),
            radius: 0.1,
        };
        let attack = Attack::new(vec![vec![key(0.5, 3.0), key(1.0, -1.0)]]).unwrap();
        let settings = QuerySettings::default();
        let plan = |context: &mut QueryContext, most: usize, first_stage: PlanStage| {
            let playhead = Playhead::at(baked().graph(), EdgeId(0), 0.0, Rigid2::IDENTITY);
            let scope = PlanScope {
                plain: &attack,
                margin: 0.03,
                evasions_only: false,
                first_stage,
                velocity: glam::Vec2::ZERO,
            };
            let mut answer = Answer::default();
            let deadline = None;
            context.start_plan(WorkLimit { deadline, most });
            let request = Request::new(playhead, &attack);
            let query = Query::new(baked(), &settings);
            query.answer_in_scope(request, Some(scope), context, &mut answer);
            context.end_plan();
            (context.late_stage(), answer)
        };
        let (late, alone) = plan(&mut QueryContext::default(), 0, PlanStage::Grid);
        assert_eq!(late, None);
        let mut context = QueryContext::default();
        for most in [1, 2, 5, 20] {
            for stage in PlanStage::ALL {
                let (late, answer) = plan(&mut context, most, stage);
                assert!(late.is_none_or(|late| late >= stage && !answer.avoided));
            }
        }
        let (late, _) = plan(&mut context, 1, PlanStage::Grid);
        assert!(late.is_some());
        for most in [0, 1_000_000] {
            let (late, after) = plan(&mut context, most, PlanStage::Grid);
            assert_eq!(late, None);
            assert_eq!(format!("{after:?}"), format!("{alone:?}"));
        }
    }
}
