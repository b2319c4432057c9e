//! The state machine of a query, and its one driver.
//!
//! Source: Masaoka & Oshita, section 5. A session goes through `start → (cull_input → submit)* → done`:
//!
//! ```text
//! start ─▶ gather ─▶ place ─▶ [a culling path counts] ─▶ evaluate ─▶ select ─▶ done
//!            ▲                                                         │
//!            └──────────────── no candidate of the grid is clean ──────┘
//! ```
//!
//! All state is stored in the [`QueryContext`]. A session can therefore be dropped while a device counts, and be resumed frames later.

use std::convert::Infallible;

use super::answer::Answer;
use super::ask::Query;
use super::blocked::reject_blocked;
use super::candidate::Candidate;
use super::context::{QueryContext, Scratch};
use super::cull::{CullInput, Overlap, cpu};
use super::enumerate::Enumerate;
use super::gather::Gather;
use super::place::PlaceCandidates;
use super::report::Report;
use super::request::{PlanScope, Request};
use super::select::{SelectionInput, select};
use super::source::Source;
use super::state::QueryState;
use crate::maps::PathId;

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
    #[must_use]
    pub fn start<'s>(&self, request: Request<'_>, context: &'s mut QueryContext) -> Session<'s>
    where
        'a: 's,
    {
        context.forget_poses();
        let QueryContext { state, scratch, .. } = context;
        Session::new(*self, state, scratch).start(request)
    }

    /// Resumes a session that was dropped before it was done. Use the query that started it.
    ///
    /// Returns `None` if `context` has since gone on to another round or query.
    #[must_use]
    pub fn resume<'s>(&self, id: SessionId, context: &'s mut QueryContext) -> Option<Session<'s>>
    where
        'a: 's,
    {
        let QueryContext { state, scratch, .. } = context;
        let is_waiting = state.is_waiting && state.round == id.0;
        is_waiting.then(|| Session::new(*self, state, scratch))
    }

    /// Answers a request, culling on the CPU.
    pub fn answer(&self, request: Request<'_>, context: &mut QueryContext, answer: &mut Answer) {
        context.forget_poses();
        let QueryContext {
            state,
            scratch,
            culler,
        } = context;
        let mut session = Session::new(*self, state, scratch).start(request);
        session.run_on_cpu(&mut culler.0, answer);
    }

    /// Answers a request of a plan. If no motion avoids its attack, the answer may avoid the attack without the margin.
    ///
    /// The queries of a plan have their poses in common: [`QueryContext::forget_poses`] comes before the first of them.
    pub(crate) fn answer_plan(
        &self,
        request: Request<'_>,
        scope: PlanScope<'_>,
        context: &mut QueryContext,
        answer: &mut Answer,
    ) {
        let QueryContext {
            state,
            scratch,
            culler,
        } = context;
        let mut session = Session::new(*self, state, scratch).start(request);
        session.state.request.limit(scope);
        session.run_on_cpu(&mut culler.0, answer);
    }
}

impl<'a> Session<'a> {
    fn new(query: Query<'a>, state: &'a mut QueryState, scratch: &'a mut Scratch) -> Self {
        Self {
            query,
            state,
            scratch,
        }
    }

    /// Begins a request.
    fn start(mut self, request: Request<'_>) -> Self {
        self.state.request.set(self.query.baked, request);
        self.state.candidates.known.clear();
        self.state.is_waiting = true;
        if self.query.settings.enumerate.uses_grid() {
            self.gather(Source::Grid);
            if self.state.candidates.list.is_empty() {
                self.gather(Source::NothingFiled);
            }
        } else {
            self.gather(Source::Whole);
        }
        self
    }

    /// Id of this round, for [`Query::resume`].
    #[must_use]
    pub fn id(&self) -> SessionId {
        SessionId(self.state.round)
    }

    /// The set that the candidates come from.
    #[must_use]
    pub fn source(&self) -> Source {
        self.state.source
    }

    /// The candidates that a culling path has to count: those that end in an evasion and that no earlier round has shown to be hit.
    #[must_use]
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
        let QueryState {
            maps, candidates, ..
        } = &mut *self.state;
        let input = CullInput {
            atlas: self.query.baked.atlas(),
            attack: &maps.attack,
            candidates: &maps.candidates,
        };
        count(&input, &mut candidates.overlaps)
    }

    /// The counts of this round, in the order of [`Session::cull_input`].
    #[must_use]
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
        let scratch = &mut self.scratch.evaluate;
        let input = SelectionInput {
            query: self.query,
            state: self.state,
            scratch,
        };
        let Some(selection) = select(input, &mut answer.motion) else {
            self.gather(Source::NothingClean);
            return Step::Recount;
        };
        answer.fill(&Report {
            query: self.query,
            state: self.state,
            evaluated: scratch.evaluated(),
            selection,
        });
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
        self.run_rounds(answer, |session| session.count(&mut count))
    }

    /// Runs the session to its end on the CPU.
    pub fn run_on_cpu(&mut self, culler: &mut cpu::Culler, answer: &mut Answer) {
        let Ok(()) = self.run(answer, |input, counts| {
            let _span = tracing::trace_span!("query: cull on the CPU").entered();
            culler.count(input, counts);
            Ok::<_, Infallible>(())
        });
    }

    /// Like [`Session::run`], for callers that also look at each round: `count` calls [`Session::count`].
    ///
    /// # Errors
    /// The error of `count`.
    pub fn run_rounds<E>(
        &mut self,
        answer: &mut Answer,
        mut count: impl FnMut(&mut Self) -> Result<(), E>,
    ) -> Result<(), E> {
        loop {
            count(self)?;
            if self.submit_counted(answer) == Step::Done {
                return Ok(());
            }
        }
    }

    /// Also draws the outer maps of the attack, so that [`Overlap::outer`] can be counted.
    ///
    /// The choice needs no proof of a miss. A session therefore starts without outer maps, and all its candidates are
    /// [open](super::cull::CullCandidate::open).
    pub fn draw_outer_maps(&mut self) {
        self.place(true);
    }

    /// The paths of the candidates of [`Session::cull_input`], in its order.
    #[doc(hidden)]
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
        let gather = Gather {
            query: self.query,
            enumerate: match source {
                Source::Grid => self.query.settings.enumerate,
                Source::NothingFiled | Source::NothingClean | Source::Whole => Enumerate::Whole,
            },
        };
        gather.run(self.state, &mut self.scratch.gather);
        reject_blocked(self.query, self.state);
        self.state.candidates.put_known_last();
        self.place(false);
    }

    fn place(&mut self, outer: bool) {
        let _span = tracing::trace_span!("query: draw the attack's maps").entered();
        let place = PlaceCandidates {
            baked: self.query.baked,
            outer,
        };
        place.run(self.state, &mut self.scratch.place);
    }
}
