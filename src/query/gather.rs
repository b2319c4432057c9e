//! Gathers the candidates of a node: paths to an evasion that can be in time at some rate.
//!
//! Source: Masaoka & Oshita, sections 5.1 and 5.2. Differs: of candidates that perform the same evasion at nearly the same place,
//! only the one with the rate nearest to 1 is kept. If no path can be in time, the paths that are nearest to being in time are taken.

use crate::math::Sphere;
use rustc_hash::FxHashSet;

use super::ask::Query;
use super::candidate::{Candidate, CandidateKind};
use super::enumerate::Enumerate;
use super::moves::SearchReport;
use super::request::ActiveRequest;
use super::retime::{Direction, Rate, rate};
use super::state::{LatePaths, QueryState};
use crate::maps::{CellColumn, NodePath, PathId, TouchedCells};

/// The gather stage: fills the candidate list with evasions.
#[derive(Clone, Copy)]
pub(super) struct Gather<'a> {
    pub query: Query<'a>,
    /// The set that candidates come from.
    pub enumerate: Enumerate,
}

/// Scratch of the stage.
#[derive(Clone, Debug, Default)]
pub(super) struct GatherScratch {
    touched: TouchedCells,
    /// Columns of cells, each with its distance from the root.
    nearest: Vec<(f32, CellColumn)>,
    seen: FxHashSet<[i32; 4]>,
}

impl Gather<'_> {
    /// Runs the stage.
    pub(super) fn run(&self, state: &mut QueryState, scratch: &mut GatherScratch) {
        let mut list = Gathered {
            query: self.query,
            request: &state.request,
            list: &mut state.candidates.list,
            late: &mut state.late,
            scratch,
        };
        list.clear();
        list.add_in_time();
        if list.list.is_empty() {
            list.add_nearly_in_time();
        }
        if self.enumerate.uses_grid() {
            list.touch_cells();
        }
        match self.enumerate {
            Enumerate::TouchedCells => list.keep_filed_in_any(),
            Enumerate::NearestCell | Enumerate::NearestFiledCell => {
                list.keep_filed_in_one(self.enumerate);
            }
            Enumerate::Whole => {}
        }
        state.search = list.keep_different();
    }
}

/// The candidate list while it is gathered.
struct Gathered<'a> {
    query: Query<'a>,
    request: &'a ActiveRequest,
    list: &'a mut Vec<Candidate>,
    late: &'a mut LatePaths,
    scratch: &'a mut GatherScratch,
}

impl<'a> Gathered<'a> {
    fn clear(&mut self) {
        self.list.clear();
        self.late.list.clear();
        self.late.count = 0;
    }

    /// The node's paths to evasions.
    fn paths(&self) -> impl Iterator<Item = (PathId, &'a NodePath)> + use<'a> {
        let (table, node) = (self.query.baked.paths(), self.request.node);
        table.ids(node).zip(table.from_node(node))
    }

    fn total(&self, path: &NodePath) -> f32 {
        ActiveRequest::durations(self.query.baked, path).total
    }

    /// Adds the paths that some rate brings in time.
    fn add_in_time(&mut self) {
        let Query { baked, settings } = self.query;
        for (id, path) in self.paths() {
            let durations = ActiveRequest::durations(baked, path);
            match rate(&durations, self.request.available, &settings.rates) {
                Ok(rate) => {
                    let start = match rate.direction {
                        Direction::Unchanged => self.request.wait + durations.total,
                        Direction::Faster | Direction::Slower => self.request.attack.start(),
                    };
                    let kind = CandidateKind::Evasion { path: id, start };
                    self.list.push(Candidate { kind, rate });
                }
                Err(error) => {
                    self.late.count += 1;
                    if settings.list_late {
                        self.late.list.push((id, error));
                    }
                }
            }
        }
    }

    /// Adds the paths that are nearest to being in time, at rate 1.
    fn add_nearly_in_time(&mut self) {
        let rates = &self.query.settings.rates;
        if rates.nearest <= 0.0 {
            return;
        }
        let available = self.request.available;
        let nearest = self
            .paths()
            .map(|(_, path)| (self.total(path) - available).abs())
            .fold(f32::INFINITY, f32::min);
        // The tolerance includes paths that are equally near but on the other side of the attack's start.
        let furthest = (nearest + rates.tolerance).min(rates.nearest);
        for (id, path) in self.paths() {
            let total = self.total(path);
            if (total - available).abs() <= furthest {
                let start = self.request.wait + total;
                self.list.push(Candidate {
                    kind: CandidateKind::Evasion { path: id, start },
                    rate: Rate::UNCHANGED,
                });
            }
        }
        self.late.count -= self.list.len();
        let list = &self.list;
        self.late
            .list
            .retain(|(id, _)| !list.iter().any(|candidate| candidate.path() == Some(*id)));
    }

    /// Finds the cells that the attack touches within the reach of a body, in the node's frame.
    fn touch_cells(&mut self) {
        let Query { baked, .. } = self.query;
        let (grid, table) = (baked.grid(), baked.paths());
        let furthest = self
            .list
            .iter()
            .filter_map(Candidate::path)
            .map(|path| table.path(path).placement.ground().abs().max_element())
            .fold(0.0, f32::max);
        let reach = baked.reach() + furthest;
        let to_node = self.request.node_frame.inverse();
        let touched = &mut self.scratch.touched;
        touched.clear();
        for sphere in self.request.attack.spheres() {
            sphere.for_each_step(|ball| {
                let centre = to_node.point(ball.centre);
                touched.add(Sphere { centre, ..ball }, grid.cell(), reach);
            });
        }
    }

    /// Keeps the candidates that vacate any touched cell.
    fn keep_filed_in_any(&mut self) {
        let grid = self.query.baked.grid();
        let columns = self.scratch.touched.merge();
        self.list.retain(|candidate| {
            candidate
                .path()
                .is_some_and(|path| grid.vacates_any(path, columns))
        });
    }

    /// Keeps the candidates that vacate one touched cell: the one nearest to the root, or the nearest that some candidate vacates.
    fn keep_filed_in_one(&mut self, cell: Enumerate) {
        let grid = self.query.baked.grid();
        let root = self.request.root(self.query.baked);
        let vacates = |candidate: &Candidate, column: CellColumn| {
            candidate
                .path()
                .is_some_and(|path| grid.vacates(path, column) != 0)
        };
        let GatherScratch {
            touched, nearest, ..
        } = &mut *self.scratch;
        nearest.clear();
        for column in touched.merge() {
            nearest.extend(column.cells().map(|cell| {
                let distance = cell.middle(grid.cell()).distance_squared(root);
                (distance, cell)
            }));
        }
        nearest.sort_unstable_by(|a, b| {
            let place = |c: &CellColumn| (c.x, c.z, c.heights);
            a.0.total_cmp(&b.0)
                .then_with(|| place(&a.1).cmp(&place(&b.1)))
        });
        let list = &mut *self.list;
        let found = match cell {
            Enumerate::NearestCell => nearest.first(),
            _ => nearest
                .iter()
                .find(|(_, cell)| list.iter().any(|candidate| vacates(candidate, *cell))),
        };
        match found {
            Some(&(_, cell)) => list.retain(|candidate| vacates(candidate, cell)),
            None => list.clear(),
        }
    }

    /// Keeps the candidate with the rate nearest to 1 among those that perform the same evasion at nearly the same place, and no more candidates
    /// than the settings allow.
    fn keep_different(&mut self) -> SearchReport {
        let (table, settings) = (self.query.baked.paths(), self.query.settings);
        let path = |candidate: &Candidate| candidate.path().unwrap_or_default();
        let change = |candidate: &Candidate| (candidate.rate.rate - 1.0).abs();
        let (list, seen) = (&mut *self.list, &mut self.scratch.seen);
        list.sort_unstable_by(|a, b| {
            change(a)
                .total_cmp(&change(b))
                .then_with(|| path(a).cmp(&path(b)))
        });
        seen.clear();
        let all = list.len();
        list.retain(|candidate| {
            let path = table.path(path(candidate));
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
}
