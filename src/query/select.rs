//! The choice among candidates after a culling path has counted.
//!
//! Source: Masaoka & Oshita, sections 5.3 and 5.4. Differs: the paper sometimes chooses a path that is hit. Here every chosen path
//! is tested exactly. If no candidate that the maps kept is clean, the removed ones are tested too. If no candidate of the
//! node's grid is clean, all paths become candidates. The answer is therefore a hit only if every candidate is hit. The cost
//! falls on queries in which all kept candidates are hit: one exact test of each removed candidate, up to its first hit, and a second round.
//! A candidate that would be chosen and asks the body to push harder than the clips do is refused, and the choice goes on without it.

use super::evaluate::{Evaluator, Round};
use super::gather::{GatherScratch, gather_entries, gather_layers, gather_moves};
use super::request::{Evaluation, PlanStage, Query};
use super::state::{QueryState, Source};
use super::warp::{Warper, adjust, warp_hits};
use crate::graph::Motion;

#[derive(Clone, Copy, Debug)]
pub(super) struct Selection {
    pub chosen: usize,
    /// Number of culled candidates that were tested because no other candidate was clean.
    pub reconsidered: usize,
}

/// Tests candidates, selects one and writes its motion to `motion`. Returns `None` if no candidate of the grid is clean.
pub(super) fn select(
    query: Query<'_>,
    state: &mut QueryState,
    gather: &mut GatherScratch,
    evaluator: &mut Evaluator,
    warper: &mut Warper,
    motion: &mut Motion,
) -> Option<Selection> {
    let _span = tracing::trace_span!("query: test and choose").entered();
    let is_grid = state.source == Source::Grid;
    let only = state.request.evasions_only && !state.candidates.list.is_empty();
    let (mut has_layers, mut has_entries, mut has_moves) = (only, only, only);
    let first = state.request.first_stage;
    if first == PlanStage::Moves {
        (has_layers, has_entries) = (true, true);
    }
    let (mut reconsidered, mut has_warped) = (0, false);
    let (natural, ranking) = (&mut gather.natural, &mut gather.ranking);
    natural.start();
    state.contact = None;
    evaluator.start(&state.candidates);
    let walks = natural.walks(query, &state.request);
    loop {
        let all = 0..state.candidates.list.len();
        measure_goals(query, state, motion);
        let round = Round { query, state };
        let kept = all.clone().filter(|&index| !state.is_culled(index));
        evaluator.evaluate(round, kept);
        let has_clean = evaluator.has_clean();
        let is_late = evaluator.body().is_late();
        if is_late && !has_clean {
            let stage = match (is_grid, has_entries, has_moves) {
                (true, ..) => PlanStage::Grid,
                _ if only => PlanStage::Evasions,
                (_, false, _) => PlanStage::Evasions,
                (_, true, false) => PlanStage::Entries,
                (_, true, true) => PlanStage::Moves,
            };
            state.late_stage.get_or_insert(stage.max(first));
            if !state.candidates.list.is_empty() {
                let round = Round { query, state };
                return Some(best_hit(round, evaluator, motion, reconsidered));
            }
        }
        let round = Round { query, state };
        if !has_clean && is_grid {
            let is_certain = query.baked.atlas().grid().is_certain();
            if state.request.evaluation == Evaluation::Lazy && is_certain {
                state.candidates.store_hits(&evaluator.evaluated);
            }
            return None;
        }
        // A walking body may keep walking, even if it could stop for another evasion.
        let may_walk_on = !has_layers && walks && has_clean && !is_late;
        let may_enter = !is_grid && !has_entries && !has_clean;
        // If an entry is clean, moves are not searched: few would score better, and all would be tested.
        let is_entered = has_entries && has_clean;
        let is_out = is_grid || has_moves || is_entered || (is_late && has_clean);
        let may_move = !is_out && evaluator.can_moves_win(round);
        if may_walk_on || may_enter || may_move {
            let (request, candidates) = (&state.request, &mut state.candidates);
            let body = evaluator.body();
            if may_walk_on || (may_enter && !has_layers) {
                gather_layers(query, request, candidates, natural, ranking, body);
            }
            if may_walk_on {
                has_layers = true;
            } else if may_enter {
                (has_layers, has_entries) = (true, true);
                gather_entries(query, request, candidates, natural, body);
            } else {
                has_moves = true;
                gather_moves(query, request, &mut state.moves, candidates);
            }
            state.contact = natural.known_contact();
            continue;
        }
        if (!has_clean || reconsidered > 0) && !is_late {
            let culled = all.filter(|&index| state.is_culled(index));
            reconsidered = culled.clone().count();
            evaluator.evaluate(round, culled);
        }
        // A clean candidate that was found is tested to its end.
        evaluator.body().set_grace(has_clean);
        if !evaluator.has_clean() {
            evaluator.measure_shallowest_hit(round);
            if evaluator.body().is_late() {
                state.late_stage.get_or_insert(PlanStage::Moves);
                let round = Round { query, state };
                return Some(best_hit(round, evaluator, motion, reconsidered));
            }
        }
        let round = Round { query, state };
        // A hit by less than the sampling error may be clean.
        let warped = match evaluator.has_clean() || has_warped {
            true => None,
            false => warp_hits(round, evaluator, warper, motion),
        };
        has_warped = !evaluator.has_clean();
        let chosen = warped.unwrap_or_else(|| evaluator.best());
        // If the final test shows a hit, the next iteration tests candidates that were skipped because of this one.
        let is_confirmed = warped.is_none() && evaluator.confirm(round, chosen, motion);
        evaluator.body().set_grace(false);
        if warped.is_none() && !is_confirmed && evaluator.body().is_late() {
            evaluator.refuse_unmeasured();
        }
        if is_confirmed && !is_late {
            adjust(round, evaluator, warper, chosen, motion);
        }
        if warped.is_some() || is_confirmed {
            return Some(Selection {
                chosen,
                reconsidered,
            });
        }
    }
}

/// Selects the best hit so far, where the limit of work was reached before anything was found.
fn best_hit(
    round: Round<'_>,
    evaluator: &Evaluator,
    motion: &mut Motion,
    reconsidered: usize,
) -> Selection {
    let chosen = evaluator.best();
    round.motion(chosen, motion);
    Selection {
        chosen,
        reconsidered,
    }
}

/// Measures how far the new candidates lead from where the goal leads. Their motions are written to `motion`.
fn measure_goals(query: Query<'_>, state: &mut QueryState, motion: &mut Motion) {
    let mut goals = std::mem::take(&mut state.candidates.goals);
    let round = Round { query, state };
    for index in goals.len()..state.candidates.list.len() {
        goals.push(match state.is_culled(index) {
            true => 0.0,
            false => round.goal(index, motion),
        });
    }
    state.candidates.goals = goals;
}
