//! Finds paths to attacks and files them by the cells that the attacks hit.

use glam::Vec3;

use super::contact::{all_contacts, edges, frames};
use super::{AttackGrid, AttackGridSettings, AttackOption, Contact, FiledCell, cell_of};
use crate::graph::NodeId;
use crate::maps::grid::{PathTable, find_paths};
use crate::maps::{BakedGraph, Retimable};
use crate::math::{Sphere, in_parallel, sort_rarely};

/// A candidate entry of the grid.
#[derive(Clone, Copy)]
struct Candidate {
    cell: [i16; 3],
    attack: u32,
    /// Time until the hit plus the distance penalty, in seconds. Lower is better.
    cost: f32,
    option: AttackOption,
}

impl AttackGrid {
    /// Finds the paths from all nodes to all attacks and files them in cells. The result does not
    /// depend on the number of threads.
    #[must_use]
    pub fn new(baked: &BakedGraph, settings: &AttackGridSettings) -> Self {
        let graph = baked.graph();
        let settings = AttackGridSettings {
            cell: settings.cell.max(0.02),
            ..*settings
        };
        // An attacker may choose when to attack. Retiming therefore does not make a path better, and is
        // left out.
        let nothing = Retimable {
            faster: false,
            slower: false,
        };
        let retimable = vec![nothing; graph.edges().len()];
        let (placements, goals) = (baked.placements(), edges(baked));
        let paths = find_paths(graph, &retimable, placements, &goals, &settings.paths);
        paths.prepare();
        let contacts = all_contacts(baked, settings.reach_share);
        let search = NodeSearch {
            rate: graph.frame_rate() as f32,
            min_frames: frames(graph, settings.min_seconds),
            settings: &settings,
            paths: &paths,
            contacts: &contacts,
        };
        let nodes = graph.nodes().len();
        let filed = in_parallel(settings.paths.threads, nodes, |node| {
            search.of_node(NodeId(node as u32))
        });
        let mut grid = AttackGrid {
            settings,
            paths,
            contacts,
            first: vec![0],
            cells: Vec::new(),
            options: Vec::new(),
        };
        for candidates in filed {
            for of_cell in candidates.chunk_by(|a, b| a.cell == b.cell) {
                grid.cells.push(FiledCell {
                    cell: of_cell[0].cell,
                    first: grid.options.len() as u32,
                });
                grid.options
                    .extend(of_cell.iter().map(|candidate| candidate.option));
            }
            grid.first.push(grid.cells.len() as u32);
        }
        grid
    }
}

/// Data that the search shares among all nodes.
struct NodeSearch<'a> {
    settings: &'a AttackGridSettings,
    paths: &'a PathTable,
    contacts: &'a [Vec<Contact>],
    /// Frame rate, in frames per second.
    rate: f32,
    /// Minimum time until a hit, in frames.
    min_frames: u32,
}

impl NodeSearch<'_> {
    /// Entries to keep for one node, sorted by cell and, within a cell, by cost.
    fn of_node(&self, node: NodeId) -> Vec<Candidate> {
        let mut candidates = Vec::new();
        for (id, path) in self.paths.ids(node).zip(self.paths.from_node(node)) {
            let contacts = self.contacts[path.goal as usize].iter();
            for (contact, number) in contacts.zip(0..) {
                let wait = u32::from(path.frames) + contact.frame;
                if wait < self.min_frames {
                    continue;
                }
                let place = path.placement.point(contact.centre);
                let option = AttackOption {
                    path: id,
                    contact: number,
                };
                self.for_each_cell(Sphere::new(place, contact.radius), |cell, away| {
                    candidates.push(Candidate {
                        cell,
                        attack: path.goal,
                        cost: wait as f32 / self.rate + self.settings.distance_weight * away,
                        option,
                    });
                });
            }
        }
        sort_rarely(&mut candidates, |a, b| {
            (a.cell, a.attack)
                .cmp(&(b.cell, b.attack))
                .then(a.cost.total_cmp(&b.cost))
                .then(a.option.cmp(&b.option))
        });
        candidates.dedup_by_key(|candidate| (candidate.cell, candidate.attack));
        sort_rarely(&mut candidates, |a, b| {
            a.cell.cmp(&b.cell).then(a.cost.total_cmp(&b.cost))
        });
        let mut kept = 0;
        let mut last = None;
        candidates.retain(|candidate| {
            kept = if last == Some(candidate.cell) {
                kept + 1
            } else {
                0
            };
            last = Some(candidate.cell);
            kept < self.settings.most
        });
        candidates
    }

    /// Calls `found` for each cell whose inscribed sphere touches the given sphere, with the
    /// distance between the cell's centre and the sphere's centre.
    fn for_each_cell(&self, sphere: Sphere, mut found: impl FnMut([i16; 3], f32)) {
        let Sphere { centre, radius } = sphere;
        let side = self.settings.cell;
        let reach = radius + 0.5 * side;
        let around = (reach / side).ceil().clamp(1.0, 64.0) as i16;
        let Some([x, y, z]) = cell_of(centre, side) else {
            return;
        };
        for dx in -around..=around {
            for dy in -around..=around {
                for dz in -around..=around {
                    let cell = [
                        x.saturating_add(dx),
                        y.saturating_add(dy),
                        z.saturating_add(dz),
                    ];
                    let middle = cell.map(|index| (f32::from(index) + 0.5) * side);
                    let away = Vec3::from_array(middle).distance(centre);
                    if away <= reach {
                        found(cell, away);
                    }
                }
            }
        }
    }
}
