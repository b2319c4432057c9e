//! Paths to attacks, filed in the cells that they strike.

use glam::Vec3;

use super::contact::{edges, frames, of_all};
use super::{AttackGrid, AttackGridSettings, Blow, Contact, Filed, cell_of};
use crate::graph::NodeId;
use crate::maps::paths::{self, PathSource, PathTable};
use crate::maps::{BakedGraph, Retimable};
use crate::math::in_parallel;

/// A blow that is being considered.
#[derive(Clone, Copy)]
struct Draft {
    cell: [i16; 3],
    strike: u32,
    /// Seconds.
    cost: f32,
    blow: Blow,
}

pub(super) fn build(baked: &BakedGraph, settings: &AttackGridSettings) -> AttackGrid {
    let graph = baked.graph();
    let settings = AttackGridSettings {
        cell: settings.cell.max(0.02),
        ..*settings
    };
    // Attacks come when they come: no way to one is better for what could be retimed on it.
    let nothing = Retimable {
        faster: false,
        slower: false,
    };
    let source = PathSource {
        graph,
        retimable: &vec![nothing; graph.edges().len()],
        goals: &edges(baked),
    };
    let paths = paths::build(source, &settings.paths);
    let contacts = of_all(baked, settings.drive);
    let filing = Filing {
        rate: graph.frame_rate() as f32,
        notice: frames(graph, settings.notice),
        settings: &settings,
        paths: &paths,
        contacts: &contacts,
    };
    let nodes = graph.nodes().len();
    let filed = in_parallel(settings.paths.threads, nodes, |node| {
        filing.of_node(NodeId(node as u32))
    });
    let mut grid = AttackGrid {
        settings,
        paths,
        contacts,
        first: vec![0],
        cells: Vec::new(),
        blows: Vec::new(),
    };
    for drafts in filed {
        for of_cell in drafts.chunk_by(|a, b| a.cell == b.cell) {
            grid.cells.push(Filed {
                cell: of_cell[0].cell,
                first: grid.blows.len() as u32,
            });
            grid.blows.extend(of_cell.iter().map(|draft| draft.blow));
        }
        grid.first.push(grid.cells.len() as u32);
    }
    grid
}

/// What all nodes share.
struct Filing<'a> {
    settings: &'a AttackGridSettings,
    paths: &'a PathTable,
    contacts: &'a [Vec<Contact>],
    /// Frames a second.
    rate: f32,
    /// Frames.
    notice: u32,
}

impl Filing<'_> {
    /// What is kept of a node, by cell, the best first.
    fn of_node(&self, node: NodeId) -> Vec<Draft> {
        let mut drafts = Vec::new();
        for (id, path) in self.paths.ids(node).zip(self.paths.of(node)) {
            let contacts = self.contacts[path.evasion as usize].iter();
            for (contact, number) in contacts.zip(0..) {
                let wait = u32::from(path.frames) + contact.frame;
                if wait < self.notice {
                    continue;
                }
                let place = path.placement.point(contact.centre);
                let blow = Blow {
                    path: id,
                    contact: number,
                };
                self.for_each_cell((place, contact.radius), |cell, away| {
                    drafts.push(Draft {
                        cell,
                        strike: path.evasion,
                        cost: wait as f32 / self.rate + self.settings.aside * away,
                        blow,
                    });
                });
            }
        }
        drafts.sort_unstable_by(|a, b| {
            (a.cell, a.strike)
                .cmp(&(b.cell, b.strike))
                .then(a.cost.total_cmp(&b.cost))
                .then(a.blow.cmp(&b.blow))
        });
        drafts.dedup_by_key(|draft| (draft.cell, draft.strike));
        drafts.sort_by(|a, b| a.cell.cmp(&b.cell).then(a.cost.total_cmp(&b.cost)));
        let mut kept = 0;
        let mut last = None;
        drafts.retain(|draft| {
            kept = if last == Some(draft.cell) {
                kept + 1
            } else {
                0
            };
            last = Some(draft.cell);
            kept < self.settings.most
        });
        drafts
    }

    /// The cells whose inner ball a sphere meets, each with the distance of its middle from the sphere's centre.
    fn for_each_cell(&self, (centre, radius): (Vec3, f32), mut found: impl FnMut([i16; 3], f32)) {
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
