//! Whole queries, culled on the CPU.

use sabaki::graph::Playhead;
use sabaki::query::cull::{Overlap, cpu};
use sabaki::query::{Answer, Attack, Evaluation, Query, QueryContext, Request};
use sabaki_app::demo::throw::Throw;

/// The answer to an attack.
pub fn answer_attack(
    query: &Query<'_>,
    (playhead, attack): (Playhead, &Attack),
    evaluation: Evaluation,
) -> Answer {
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    let request = Request {
        evaluation,
        ..Request::new(playhead, attack)
    };
    let mut session = query.start(request, &mut context);
    session.run_on_cpu(&mut cpu::Culler::default(), &mut answer);
    answer
}

/// The answer to a throw.
pub fn answer_throw(query: &Query<'_>, throw: &Throw, evaluation: Evaluation) -> Answer {
    answer_attack(query, (throw.playhead, &throw.attack), evaluation)
}

/// The counts of a query's first candidates.
pub fn first_counts(query: &Query<'_>, (playhead, attack): (Playhead, &Attack)) -> Vec<Overlap> {
    let (mut context, mut overlaps) = (QueryContext::default(), Vec::new());
    let mut session = query.start(Request::new(playhead, attack), &mut context);
    session.draw_outer_maps();
    cpu::count(&session.cull_input(), &mut overlaps);
    overlaps
}
