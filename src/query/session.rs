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
//! All state lies in the [`QueryContext`]. A session can therefore be dropped while a device counts, and be resumed frames later.

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
use super::select::select;
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

/// Names one round of one query in one context.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SessionId(u64);

/// What a session needs next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Step {
    /// Nothing. The answer is written.
    Done,
    /// Counts for other candidates: no candidate of the grid is clean, and [`Session::cull_input`] now has those of all paths.
    Recount,
}

impl<'a> Query<'a> {
    /// Gathers the candidates of a request and draws their maps.
    #[must_use]
    pub fn start<'s>(&self, request: Request<'_>, context: &'s mut QueryContext) -> Session<'s>
    where
        'a: 's,
    {
        Session::start(*self, request, &mut context.state, &mut context.scratch)
    }

    /// Takes up a session that was dropped before it was done. Use the query that started it.
    ///
    /// Returns `None` if `context` has since gone on to another round or query.
    #[must_use]
    pub fn resume<'s>(&self, id: SessionId, context: &'s mut QueryContext) -> Option<Session<'s>>
    where
        'a: 's,
    {
        let QueryContext { state, scratch, .. } = context;
        (state.is_waiting && state.round == id.0).then_some(Session {
            query: *self,
            state,
            scratch,
        })
    }

    /// Answers a request at once, culling on the CPU.
    pub fn answer(&self, request: Request<'_>, context: &mut QueryContext, answer: &mut Answer) {
        let QueryContext {
            state,
            scratch,
            culler,
        } = context;
        Session::start(*self, request, state, scratch).run_on_cpu(&mut culler.0, answer);
    }

    /// Answers a request of a plan. Where nothing avoids its attack, the answer may avoid the attack without the margin.
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
        let mut session = Session::start(*self, request, state, scratch);
        session.state.request.limit(scope);
        session.run_on_cpu(&mut culler.0, answer);
    }
}

impl<'a> Session<'a> {
    fn start(
        query: Query<'a>,
        request: Request<'_>,
        state: &'a mut QueryState,
        scratch: &'a mut Scratch,
    ) -> Self {
        state.request.set(query.baked, request);
        state.candidates.known.clear();
        state.is_waiting = true;
        let mut session = Self {
            query,
            state,
            scratch,
        };
        if query.settings.enumerate.uses_grid() {
            session.gather(Source::Grid);
            if session.state.candidates.list.is_empty() {
                session.gather(Source::NothingFiled);
            }
        } else {
            session.gather(Source::Whole);
        }
        session
    }

    /// The name of this round, for [`Query::resume`].
    #[must_use]
    pub fn id(&self) -> SessionId {
        SessionId(self.state.round)
    }

    /// The set that the candidates come from.
    #[must_use]
    pub fn source(&self) -> Source {
        self.state.source
    }

    /// The candidates that a culling path has to count: those that end in an evasion, without those that an earlier round has
    /// shown to be hit.
    #[must_use]
    pub fn cull_input(&self) -> CullInput<'_> {
        CullInput {
            atlas: self.query.baked.atlas(),
            attack: &self.state.maps.attack,
            candidates: &self.state.maps.candidates,
        }
    }

    /// Counts by a culling path, for [`Session::submit_counted`]: `count` writes an [`Overlap`] for each candidate of its input.
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

    /// Continues with counts from elsewhere: `counts` are those of [`Session::cull_input`], in its order.
    pub fn submit(&mut self, counts: &[Overlap], answer: &mut Answer) -> Step {
        let overlaps = &mut self.state.candidates.overlaps;
        overlaps.clear();
        overlaps.extend_from_slice(counts);
        self.submit_counted(answer)
    }

    /// Continues with the counts of [`Session::count`]: tests candidates, and writes the answer or gathers other candidates.
    pub fn submit_counted(&mut self, answer: &mut Answer) -> Step {
        let scratch = &mut self.scratch.evaluate;
        let Some(selection) = select(self.query, self.state, scratch, &mut answer.motion) else {
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

    /// Draws the outer maps of the attack too, so that [`Overlap::outer`] can be counted.
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
