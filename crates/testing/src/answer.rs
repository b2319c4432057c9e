//! Whole queries, culled on the CPU.

use sabaki::graph::Playhead;
use sabaki::query::cull::{Overlap, cpu};
use sabaki::query::{Answer, Attack, Judging, Query, QueryContext, Verdict};
use sabaki_app::demo::throw::Throw;

/// The answer to an attack.
pub fn answer_attack(
    query: &Query<'_>,
    (playhead, attack): (Playhead, &Attack),
    judging: Judging,
) -> Answer {
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    let mut overlaps = Vec::new();
    let mut prepared = query.prepare(playhead, attack, &mut context);
    loop {
        cpu::count(&prepared.cull_input(), &mut overlaps);
        match prepared.decide(&overlaps, judging, &mut answer) {
            Verdict::Answered => return answer,
            Verdict::Widened(wider) => prepared = wider,
        }
    }
}

/// The answer to a throw.
pub fn answer_throw(query: &Query<'_>, throw: &Throw, judging: Judging) -> Answer {
    answer_attack(query, (throw.playhead, &throw.attack), judging)
}

/// The counts of a query's first candidates.
pub fn first_counts(query: &Query<'_>, (playhead, attack): (Playhead, &Attack)) -> Vec<Overlap> {
    let (mut context, mut overlaps) = (QueryContext::default(), Vec::new());
    let mut prepared = query.prepare(playhead, attack, &mut context);
    prepared.draw_outer_maps();
    cpu::count(&prepared.cull_input(), &mut overlaps);
    overlaps
}
