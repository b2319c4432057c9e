//! The candidates of a node: paths to an evasion that some rate brings in time.
//!
//! Source: Masaoka & Oshita, sections 5.1 and 5.2. Differs: of candidates that perform the same
//! evasion at nearly the same place only the one whose rate is nearest to 1 is kept; and where no
//! path is in time, those that are nearest to it are taken.

use super::candidate::{Candidate, Way};
use super::context::QueryContext;
use super::query::{Lookup, QuerySettings};
use super::retime::{Direction, Rate, rate};
use super::situation::Situation;
use crate::maps::{BakedGraph, CellColumn, NodePath};

/// Where candidates are gathered from.
#[derive(Clone, Copy)]
pub(super) struct Gathering<'a> {
    pub baked: &'a BakedGraph,
    pub settings: &'a QuerySettings,
    /// Only what is filed in the attack's cells.
    pub lookup: Option<Lookup>,
}

impl Gathering<'_> {
    /// Fills the context with candidates, evasions only.
    pub(super) fn run(&self, situation: &Situation<'_>, context: &mut QueryContext) {
        context.candidates.clear();
        context.late.clear();
        context.late_count = 0;
        context.search = Default::default();
        self.in_time(situation, context);
        self.nearly_in_time(situation, context);
        if let Some(lookup) = self.lookup {
            self.filed(situation, lookup, context);
        }
        self.different(context);
    }

    fn in_time(&self, situation: &Situation<'_>, context: &mut QueryContext) {
        let table = self.baked.paths();
        for (id, path) in table.ids(situation.node).zip(table.of(situation.node)) {
            let durations = Situation::durations(self.baked, path);
            match rate(&durations, situation.available, &self.settings.rates) {
                Ok(rate) => {
                    let start = match rate.direction {
                        Direction::Unchanged => situation.wait + durations.total,
                        Direction::Faster | Direction::Slower => situation.attack.start(),
                    };
                    let way = Way::Evasion { path: id, start };
                    context.candidates.push(Candidate { way, rate });
                }
                Err(error) => {
                    context.late_count += 1;
                    if self.settings.list_late {
                        context.late.push((id, error));
                    }
                }
            }
        }
    }

    /// Where nothing is in time takes what is nearest to it.
    fn nearly_in_time(&self, situation: &Situation<'_>, context: &mut QueryContext) {
        let (table, rates) = (self.baked.paths(), &self.settings.rates);
        if !context.candidates.is_empty() || rates.nearest <= 0.0 {
            return;
        }
        let off = |path: &NodePath| {
            let total = Situation::durations(self.baked, path).total;
            (total - situation.available).abs()
        };
        let all = || table.ids(situation.node).zip(table.of(situation.node));
        let nearest = all()
            .map(|(_, path)| off(path))
            .fold(f32::INFINITY, f32::min);
        // One frame more: what is as near on the attack's other side.
        let furthest = (nearest + rates.tolerance).min(rates.nearest);
        for (id, path) in all().filter(|(_, path)| off(path) <= furthest) {
            let start = situation.wait + Situation::durations(self.baked, path).total;
            context.candidates.push(Candidate {
                way: Way::Evasion { path: id, start },
                rate: Rate::UNCHANGED,
            });
        }
        context.late_count -= context.candidates.len();
        context.late.retain(|(id, _)| {
            let taken = |candidate: &Candidate| candidate.path() == Some(*id);
            !context.candidates.iter().any(taken)
        });
    }

    /// Keeps what vacates the cells that are looked up.
    fn filed(&self, situation: &Situation<'_>, lookup: Lookup, context: &mut QueryContext) {
        let grid = self.baked.grid();
        self.touch(situation, context);
        let QueryContext {
            touched,
            nearest,
            candidates,
            ..
        } = context;
        let columns = touched.merge();
        let vacates = |candidate: &Candidate, column: CellColumn| match candidate.way {
            Way::Evasion { path, .. } => grid.vacates(path, column) != 0,
            Way::Move(_) => false,
        };
        if lookup == Lookup::Union {
            candidates.retain(|candidate| match candidate.way {
                Way::Evasion { path, .. } => grid.vacates_any(path, columns),
                Way::Move(_) => false,
            });
            return;
        }
        // One cell at a time, the nearest to the root first.
        let root = situation.root(self.baked);
        nearest.clear();
        for column in columns {
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
        let looked_up = match lookup {
            Lookup::Nearest => nearest.first(),
            _ => nearest
                .iter()
                .find(|(_, cell)| candidates.iter().any(|c| vacates(c, *cell))),
        };
        match looked_up {
            Some(&(_, cell)) => candidates.retain(|c| vacates(c, cell)),
            None => candidates.clear(),
        }
    }

    /// Notes the cells that the attack touches, in the node's frame, as far as a body can be.
    fn touch(&self, situation: &Situation<'_>, context: &mut QueryContext) {
        let (grid, table) = (self.baked.grid(), self.baked.paths());
        let furthest = |candidate: &Candidate| match candidate.way {
            Way::Evasion { path, .. } => table.path(path).placement.ground().abs().max_element(),
            Way::Move(_) => 0.0,
        };
        let reach =
            self.baked.reach() + context.candidates.iter().map(furthest).fold(0.0, f32::max);
        let to_node = situation.node_frame.inverse();
        context.touched.clear();
        for sphere in situation.attack.spheres() {
            sphere.for_each_step(|centre, radius| {
                let centre = to_node.point(centre);
                context.touched.add((centre, radius), grid.cell(), reach);
            });
        }
    }

    /// Of candidates that perform the same evasion at nearly the same place keeps the one whose
    /// rate is nearest to 1; and of the others as many as are allowed.
    fn different(&self, context: &mut QueryContext) {
        let (table, settings) = (self.baked.paths(), self.settings);
        let QueryContext {
            candidates,
            seen,
            search,
            ..
        } = context;
        let place = |candidate: &Candidate| match candidate.way {
            Way::Evasion { path, .. } => path,
            Way::Move(_) => Default::default(),
        };
        let change = |candidate: &Candidate| (candidate.rate.rate - 1.0).abs();
        candidates.sort_unstable_by(|a, b| {
            change(a)
                .total_cmp(&change(b))
                .then_with(|| place(a).cmp(&place(b)))
        });
        seen.clear();
        let all = candidates.len();
        candidates.retain(|candidate| {
            let path = table.path(place(candidate));
            let [x, z, heading] = path.alike_cell(settings.alike_distance, settings.alike_angle);
            seen.insert([path.evasion as i32, x, z, heading])
        });
        let different = candidates.len();
        candidates.truncate(settings.most_evasions);
        search.alike = all - different;
        search.cut = different - candidates.len();
        search.followed = candidates.len();
    }
}
