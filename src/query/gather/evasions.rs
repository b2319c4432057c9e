//! Gathers the candidates of a node: paths to an evasion that can be in time at some rate.
//!
//! Source: Masaoka & Oshita, sections 5.1 and 5.2. Differs: of candidates that perform the same evasion at nearly the same place,
//! only the one with the rate nearest to 1 is kept. If no path can be in time, the paths that are nearest to being in time are taken.

use rustc_hash::FxHashSet;

use super::candidates::{Candidate, CandidateKind, CandidateList, KnownHit, SearchReport};
use crate::maps::{BakedGraph, CellColumn, NodePath, TouchedCells};
use crate::math::Sphere;
use crate::query::clearance::PlayedTrack;
use crate::query::cull::Overlap;
use crate::query::request::{ActiveRequest, Query};
use crate::query::retime::{Direction, Durations, Rate, rate};
use crate::query::score::Evaluated;
use crate::query::settings::Enumerate;

#[derive(Clone, Debug, Default)]
pub(in crate::query) struct EvasionScratch {
    touched: TouchedCells,
    seen: FxHashSet<[i32; 4]>,
}

/// Replaces the candidates by evasions of a set.
pub(in crate::query) fn gather_evasions(
    query: Query<'_>,
    request: &ActiveRequest,
    enumerate: Enumerate,
    candidates: &mut CandidateList,
    scratch: &mut EvasionScratch,
) {
    let baked = query.baked;
    candidates.list.clear();
    candidates.late.clear();
    candidates.late_count = 0;
    add_in_time(query, request, candidates);
    if candidates.list.is_empty() {
        add_nearly_in_time(query, request, candidates);
    }
    let list = &mut candidates.list;
    if enumerate.uses_grid() {
        touch_cells(baked, request, list, &mut scratch.touched);
    }
    match enumerate {
        Enumerate::TouchedCells => {
            let (grid, columns) = (baked.grid(), scratch.touched.merge());
            let vacates = |path| grid.vacates_any(request.path(path), columns);
            list.retain(|candidate| candidate.path().is_some_and(vacates));
        }
        Enumerate::NearestCell | Enumerate::NearestFiledCell => {
            let needs_path = enumerate == Enumerate::NearestFiledCell;
            keep_in_nearest_cell(baked, request, list, scratch, needs_path);
        }
        Enumerate::Whole => {}
    }
    candidates.search = keep_different(query, request, list, &mut scratch.seen);
}

fn add_in_time(query: Query<'_>, request: &ActiveRequest, candidates: &mut CandidateList) {
    let Query { baked, settings } = query;
    for (id, path) in request.paths() {
        let durations = Durations::new(baked, path);
        match rate(&durations, request.available, &settings.rates) {
            Ok(rate) => {
                let start = match rate.direction {
                    Direction::Unchanged => request.wait + durations.total,
                    Direction::Faster | Direction::Slower => request.attack.start(),
                };
                let kind = CandidateKind::Evasion { path: id, start };
                candidates.list.push(Candidate { kind, rate });
            }
            Err(error) => {
                candidates.late_count += 1;
                if settings.list_late {
                    candidates.late.push((id, error));
                }
            }
        }
    }
}

/// Adds the paths that are nearest to being in time, at rate 1.
fn add_nearly_in_time(query: Query<'_>, request: &ActiveRequest, candidates: &mut CandidateList) {
    let (baked, rates) = (query.baked, &query.settings.rates);
    let CandidateList { list, late, .. } = candidates;
    if rates.nearest <= 0.0 {
        return;
    }
    let total = |path: &NodePath| Durations::new(baked, path).total;
    let nearest = request
        .paths()
        .map(|(_, path)| (total(path) - request.available).abs())
        .fold(f32::INFINITY, f32::min);
    // The tolerance includes paths that are equally near but on the other side of the attack's start.
    let furthest = (nearest + rates.tolerance).min(rates.nearest);
    for (id, path) in request.paths() {
        let total = total(path);
        if (total - request.available).abs() <= furthest {
            let start = request.wait + total;
            list.push(Candidate {
                kind: CandidateKind::Evasion { path: id, start },
                rate: Rate::UNCHANGED,
            });
        }
    }
    late.retain(|(id, _)| !list.iter().any(|candidate| candidate.path() == Some(*id)));
    candidates.late_count -= list.len();
}

/// Finds the cells that the attack touches within the reach of a body, in the node's frame.
fn touch_cells(
    baked: &BakedGraph,
    request: &ActiveRequest,
    list: &[Candidate],
    touched: &mut TouchedCells,
) {
    let grid = baked.grid();
    let furthest = list
        .iter()
        .filter_map(Candidate::path)
        .map(|path| request.path(path).placement.ground().abs().max_element())
        .fold(0.0, f32::max);
    let reach = baked.reach() + furthest;
    let to_node = request.node_frame.inverse();
    touched.clear();
    for sphere in request.attack.spheres() {
        sphere.for_each_step(|ball| {
            let centre = to_node.point(ball.centre);
            touched.add(Sphere { centre, ..ball }, grid.cell(), reach);
        });
    }
}

/// Keeps the candidates that vacate the touched cell that is nearest to the root. With `needs_path`, only cells that some candidate vacates count.
fn keep_in_nearest_cell(
    baked: &BakedGraph,
    request: &ActiveRequest,
    list: &mut Vec<Candidate>,
    scratch: &mut EvasionScratch,
    needs_path: bool,
) {
    let (grid, root) = (baked.grid(), request.root(baked));
    let vacates = |candidate: &Candidate, cell: CellColumn| {
        let path = candidate.path();
        path.is_some_and(|path| grid.vacates(request.path(path), cell) != 0)
    };
    let order = |a: &CellColumn, b: &CellColumn| {
        let [near, far] = [a, b].map(|c| c.middle(grid.cell()).distance_squared(root));
        let [first, second] = [a, b].map(|c| (c.x, c.z, c.heights));
        near.total_cmp(&far).then(first.cmp(&second))
    };
    let mut nearest: Option<CellColumn> = None;
    for cell in scratch.touched.merge().iter().flat_map(CellColumn::cells) {
        let is_nearer = nearest.is_none_or(|nearest| order(&cell, &nearest).is_lt());
        if is_nearer && (!needs_path || list.iter().any(|one| vacates(one, cell))) {
            nearest = Some(cell);
        }
    }
    list.retain(|candidate| nearest.is_some_and(|cell| vacates(candidate, cell)));
}

/// Keeps the candidate with the rate nearest to 1 among those that perform the same evasion at nearly the same place, and no more candidates
/// than the settings allow.
fn keep_different(
    query: Query<'_>,
    request: &ActiveRequest,
    list: &mut Vec<Candidate>,
    seen: &mut FxHashSet<[i32; 4]>,
) -> SearchReport {
    let settings = query.settings;
    let path = |candidate: &Candidate| candidate.path().unwrap_or_default();
    let change = |candidate: &Candidate| (candidate.rate.rate - 1.0).abs();
    list.sort_unstable_by(|a, b| {
        change(a)
            .total_cmp(&change(b))
            .then_with(|| path(a).cmp(&path(b)))
    });
    seen.clear();
    let all = list.len();
    list.retain(|candidate| {
        let path = request.path(path(candidate));
        let [x, z, heading] = path.alike_cell(settings.alike_distance, settings.alike_angle);
        seen.insert([path.goal as i32, x, z, heading])
    });
    let different = list.len();
    list.truncate(settings.most_evasions);
    SearchReport {
        alike: all - different,
        cut: different - list.len(),
        followed: list.len(),
    }
}

/// Stores the evasions that enter an obstacle on their baked tracks as known hits, which are not drawn, counted or posed.
pub(in crate::query) fn reject_blocked(
    baked: &BakedGraph,
    request: &ActiveRequest,
    candidates: &mut CandidateList,
) {
    if !request.removes_blocked() {
        return;
    }
    let blends_until = request.blend.blends_until();
    let known = &mut candidates.known;
    let before = known.len();
    for candidate in &candidates.list {
        let CandidateKind::Evasion { path, start } = candidate.kind else {
            continue;
        };
        let at = known[..before].binary_search_by_key(&path, |hit| hit.path);
        let is_tested = at.is_ok_and(|at| known[at].evaluated.is_some());
        // Tracks do not include the offset of a blend.
        if is_tested || start < blends_until {
            continue;
        }
        let evasion = baked.evasions()[request.path(path).goal as usize];
        let end = start + baked.graph().seconds(evasion.edge);
        let evasion = PlayedTrack {
            seconds: (start, end),
            ..request.evasion(baked, path, start)
        };
        let Some(hit) = request.obstacles.on_track(&evasion) else {
            continue;
        };
        let evaluated = Some(Evaluated::hit(hit.as_clearance()));
        match at {
            Ok(at) => known[at].evaluated = evaluated,
            Err(_) => known.push(KnownHit {
                path,
                overlap: Overlap::default(),
                evaluated,
            }),
        }
    }
    candidates.sort_known();
}
