//! Warps candidates: hits, so that one of them is clean, or the chosen candidate, if the settings ask for a larger or a smaller clearance.

use super::warper::{WarpCase, Warper};
use crate::graph::Motion;
use crate::query::clearance::Clearance;
use crate::query::evaluate::{Bound, Evaluator};
use crate::query::request::Query;
use crate::query::score::Evaluated;
use crate::query::state::QueryState;

/// Warps one of the shallowest hits so that it is clean, the shallowest first, and writes its motion to `motion`. Returns its index, or
/// `None` if no hit can be made clean.
pub(in crate::query) fn warp_hits(
    query: Query<'_>,
    state: &QueryState,
    evaluator: &mut Evaluator,
    warper: &mut Warper,
    motion: &mut Motion,
) -> Option<usize> {
    let _span = tracing::trace_span!("query: warp").entered();
    let (baked, settings, request) = (query.baked, query.settings, &state.request);
    evaluator.order_by_depth();
    let Evaluator {
        order, evaluated, ..
    } = evaluator;
    // If there are obstacles, only hits that enter none were measured.
    order.retain(|bound| {
        let one = evaluated[bound.index];
        !request.is_among_obstacles() || one.is_some_and(|one| one.is_final)
    });
    order.truncate(settings.warp.candidates);
    let case = WarpCase {
        baked,
        attack: &request.attack,
        settings: &settings.warp,
    };
    let plain = WarpCase {
        attack: &request.plain,
        ..case
    };
    let turns = [(case, 0.0), (plain, request.margin)];
    let turns = turns
        .into_iter()
        .take(if request.margin > 0.0 { 2 } else { 1 });
    for (case, margin) in turns {
        for at in 0..evaluator.order.len() {
            let Bound { value, index } = evaluator.order[at];
            let hit = evaluator.evaluated[index].map(|one| one.clearance)?;
            if -value - margin > settings.warp.deepest {
                break;
            }
            state.motion(query, index, motion);
            if value + margin >= 0.0 {
                // The attack without the margin misses the motion without a warp.
                return Some(index);
            }
            let hit = Clearance {
                metres: hit.metres + margin,
                ..hit
            };
            let body = evaluator.body();
            let Some(warped) = warper.warp_away(case, motion, hit, body) else {
                continue;
            };
            if state.entered(query, motion, 0.0, body).is_some() {
                continue;
            }
            // The clearance of the request's attack, which is larger by the margin.
            let clearance = Clearance {
                metres: warped.clearance.metres - margin,
                ..warped.clearance
            };
            let score = state.score(query, index, clearance.metres);
            evaluator.evaluated[index] = Some(Evaluated {
                clearance,
                score: Some(score.warped(warped.effort, &settings.weights)),
                is_final: true,
                warp: motion.warp().copied(),
            });
            return Some(index);
        }
    }
    None
}

/// Warps the chosen candidate, which is clean and whose motion is `motion`, if the settings ask for a larger or a smaller clearance.
pub(in crate::query) fn adjust(
    query: Query<'_>,
    state: &QueryState,
    evaluator: &mut Evaluator,
    warper: &mut Warper,
    chosen: usize,
    motion: &mut Motion,
) {
    let weights = &query.settings.weights;
    let mut settings = query.settings.warp;
    let Some(before) = evaluator.evaluated[chosen].filter(|one| one.score.is_some()) else {
        return;
    };
    let is_near = before.clearance.metres < settings.nearest;
    settings.margin = settings.margin.max(settings.nearest);
    let case = WarpCase {
        baked: query.baked,
        attack: &state.request.attack,
        settings: &settings,
    };
    let is_far = settings
        .widest
        .is_some_and(|widest| before.clearance.metres > widest);
    let body = evaluator.body();
    let warped = match (is_near, is_far) {
        (true, _) => warper.warp_away(case, motion, before.clearance, body),
        (_, true) => warper.warp_towards(case, motion, before.clearance, body),
        _ => return,
    };
    let Some(warped) = warped else {
        return;
    };
    let metres = warped.clearance.metres;
    let score = state
        .score(query, chosen, metres)
        .warped(warped.effort, weights);
    let gains = match is_near {
        true => metres > before.clearance.metres,
        false => before.score.is_some_and(|own| score.total < own.total),
    };
    if !gains || state.entered(query, motion, 0.0, body).is_some() {
        motion.set_warp(None);
        return;
    }
    evaluator.evaluated[chosen] = Some(Evaluated {
        clearance: warped.clearance,
        score: Some(score),
        is_final: true,
        warp: motion.warp().copied(),
    });
}
