//! The choice among candidates after a culling path has counted.
//!
//! Source: Masaoka & Oshita, sections 5.3 and 5.4. Differs: the paper sometimes chooses a path that is hit. Here every chosen path
//! is tested exactly. If no candidate that the maps kept is clean, the removed ones are tested too. If no candidate of the
//! node's grid is clean, all paths become candidates. The answer is therefore a hit only if every candidate is hit. The cost
//! falls on queries in which all kept candidates are hit: one exact test of each removed candidate, up to its first hit, and a second round.

use super::ask::Query;
use super::entries::gather_entries;
use super::evaluate::{EvaluateScratch, ExactEvaluator};
use super::evaluation::Evaluation;
use super::evaluation_input::EvaluationInput;
use super::gather_moves::gather_moves;
use super::layers::gather_layers;
use super::source::Source;
use super::state::QueryState;
use crate::graph::Motion;

/// The chosen candidate of a query.
#[derive(Clone, Copy, Debug)]
pub(super) struct Selection {
    /// Index of the chosen candidate.
    pub chosen: usize,
    /// Number of culled candidates that were tested because no other candidate was clean.
    pub reconsidered: usize,
}

/// Inputs of the selection.
pub(super) struct SelectionInput<'a> {
    pub query: Query<'a>,
    pub state: &'a mut QueryState,
    pub scratch: &'a mut EvaluateScratch,
}

/// Tests candidates, selects one and writes its motion to `motion`. Returns `None` if no candidate of the grid is clean.
pub(super) fn select(input: SelectionInput<'_>, motion: &mut Motion) -> Option<Selection> {
    let SelectionInput {
        query,
        state,
        scratch,
    } = input;
    let _span = tracing::trace_span!("query: test and choose").entered();
    let is_grid = state.source == Source::Grid;
    let only = state.request.evasions_only && !state.candidates.list.is_empty();
    let (mut has_layers, mut has_entries, mut has_moves) = (only, only, only);
    let mut reconsidered = 0;
    scratch.start(state);
    let walks = scratch.entries.walks(query, &state.request);
    loop {
        let input = EvaluationInput { query, state };
        let all = 0..input.state.candidates.list.len();
        let mut evaluator = ExactEvaluator::new(input, scratch);
        evaluator.evaluate(all.clone().filter(|&index| !input.is_culled(index)));
        if !evaluator.has_clean() && is_grid {
            let is_certain = query.baked.atlas().grid().is_certain();
            if state.request.evaluation == Evaluation::Lazy && is_certain {
                state.candidates.store_hits(scratch.evaluated());
            }
            return None;
        }
        // A walking body may keep walking, even if it could stop for another evasion.
        if !has_layers && walks && evaluator.has_clean() {
            has_layers = true;
            gather_layers(query, state, scratch);
            continue;
        }
        if !is_grid && !has_entries && !evaluator.has_clean() {
            if !std::mem::replace(&mut has_layers, true) {
                gather_layers(query, state, scratch);
            }
            has_entries = true;
            gather_entries(query, state, scratch);
            continue;
        }
        // If an entry is clean, moves are not searched: few would score better, and all would be tested.
        let is_entered = has_entries && evaluator.has_clean();
        if !is_grid && !has_moves && !is_entered && evaluator.can_moves_win() {
            has_moves = true;
            gather_moves(query, state);
            continue;
        }
        if !evaluator.has_clean() || reconsidered > 0 {
            let culled = all.filter(|&index| input.is_culled(index));
            reconsidered = culled.clone().count();
            evaluator.evaluate(culled);
        }
        if !evaluator.has_clean() {
            evaluator.measure_least_deep_hit();
        }
        // A hit by less than the sampling error may be clean.
        if !evaluator.has_clean()
            && let Some(chosen) = evaluator.warp(motion)
        {
            return Some(Selection {
                chosen,
                reconsidered,
            });
        }
        let chosen = evaluator.best();
        // If the final test shows a hit, the next iteration tests candidates that were skipped because of this one.
        if evaluator.confirm(chosen, motion) {
            evaluator.adjust(chosen, motion);
            return Some(Selection {
                chosen,
                reconsidered,
            });
        }
    }
}
