//! The choice among candidates after a culling path has counted.
//!
//! Source: Masaoka & Oshita, sections 5.3 and 5.4. Differs: the paper sometimes chooses a path that is hit. Here every chosen path
//! is tested exactly. If no candidate that the maps kept is clean, the removed ones are tested too. If no candidate of the
//! node's grid is clean, all paths become candidates. The answer is therefore a hit only if every candidate is hit. The cost
//! falls on queries in which all kept candidates are hit: one exact test of each removed candidate, up to its first hit, and a second round.

use super::evaluate::Evaluator;
use super::gather::{GatherScratch, gather_entries, gather_layers, gather_moves};
use super::request::{Evaluation, Query};
use super::state::{QueryState, Source};
use super::warp::{Warper, adjust, warp_hits};
use crate::graph::Motion;

/// The chosen candidate of a query.
#[derive(Clone, Copy, Debug)]
pub(super) struct Selection {
    /// Index of the chosen candidate.
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
    let mut reconsidered = 0;
    gather.natural.start();
    evaluator.start(state);
    let walks = gather.natural.walks(query, &state.request);
    let layer = |state: &mut QueryState, gather: &mut GatherScratch, body: &mut _| {
        let QueryState {
            request,
            layers,
            candidates,
            search,
            ..
        } = state;
        let natural = (&mut gather.natural, &mut gather.ranking);
        search.followed +=
            gather_layers(query, request, layers, &mut candidates.list, natural, body);
    };
    loop {
        let all = 0..state.candidates.list.len();
        let kept = all.clone().filter(|&index| !state.is_culled(index));
        evaluator.evaluate(query, state, kept);
        if !evaluator.has_clean() && is_grid {
            let is_certain = query.baked.atlas().grid().is_certain();
            if state.request.evaluation == Evaluation::Lazy && is_certain {
                state.candidates.store_hits(&evaluator.evaluated);
            }
            return None;
        }
        // A walking body may keep walking, even if it could stop for another evasion.
        if !has_layers && walks && evaluator.has_clean() {
            has_layers = true;
            layer(state, gather, evaluator.body());
            continue;
        }
        if !is_grid && !has_entries && !evaluator.has_clean() {
            if !std::mem::replace(&mut has_layers, true) {
                layer(state, gather, evaluator.body());
            }
            has_entries = true;
            let QueryState {
                request,
                entries,
                candidates,
                search,
                ..
            } = &mut *state;
            let (natural, body) = (&mut gather.natural, evaluator.body());
            search.followed +=
                gather_entries(query, request, entries, &mut candidates.list, natural, body);
            continue;
        }
        // If an entry is clean, moves are not searched: few would score better, and all would be tested.
        let is_entered = has_entries && evaluator.has_clean();
        if !is_grid && !has_moves && !is_entered && evaluator.can_moves_win(query, state) {
            has_moves = true;
            let QueryState {
                request,
                moves,
                candidates,
                search,
                ..
            } = &mut *state;
            *search += gather_moves(query, request, moves, &mut candidates.list);
            continue;
        }
        let state = &*state;
        if !evaluator.has_clean() || reconsidered > 0 {
            let culled = all.filter(|&index| state.is_culled(index));
            reconsidered = culled.clone().count();
            evaluator.evaluate(query, state, culled);
        }
        if !evaluator.has_clean() {
            evaluator.measure_shallowest_hit(query, state);
        }
        // A hit by less than the sampling error may be clean.
        if !evaluator.has_clean()
            && let Some(chosen) = warp_hits(query, state, evaluator, warper, motion)
        {
            return Some(Selection {
                chosen,
                reconsidered,
            });
        }
        let chosen = evaluator.best();
        // If the final test shows a hit, the next iteration tests candidates that were skipped because of this one.
        if evaluator.confirm(query, state, chosen, motion) {
            adjust(query, state, evaluator, warper, chosen, motion);
            return Some(Selection {
                chosen,
                reconsidered,
            });
        }
    }
}
