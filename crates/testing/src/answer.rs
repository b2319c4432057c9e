//! Whole queries, culled on the CPU.

use sabaki::query::cull::{Overlap, cpu};
use sabaki::query::{Answer, Evaluation, Query, QueryContext, Request};
use sabaki_app::demo::throw::Throw;

/// The answer to a request.
pub fn answer_request(query: &Query<'_>, request: Request<'_>) -> Answer {
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    let mut session = query.start(request, &mut context);
    session.run_on_cpu(&mut cpu::Culler::default(), &mut answer);
    answer
}

/// The answer to a throw.
pub fn answer_throw(query: &Query<'_>, throw: &Throw, evaluation: Evaluation) -> Answer {
    let request = Request {
        evaluation,
        ..Request::new(throw.playhead, &throw.attack)
    };
    answer_request(query, request)
}

/// The counts of a query's first candidates.
pub fn first_counts(query: &Query<'_>, request: Request<'_>) -> Vec<Overlap> {
    let (mut context, mut overlaps) = (QueryContext::default(), Vec::new());
    let mut session = query.start(request, &mut context);
    session.draw_outer_maps();
    cpu::count(&session.cull_input(), &mut overlaps);
    overlaps
}
