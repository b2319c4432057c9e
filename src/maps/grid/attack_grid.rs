//! For each graph node, a grid of the attacks that hit a target at a given place. The grid is
//! computed once, for all places that the graph's attacks reach.
//!
//! Source: Lee & Lee, "Precomputing Avatar Behavior from Human Motion Data" (2004). They store at
//! each node a grid over the target's position relative to the avatar, with the best action in each
//! cell. This module differs in three ways. Their cells are 2-D and hold one action; these cells
//! are 3-D, because an attack to the head misses the knee, and hold several paths, each to another
//! attack, with the frame at which the attack's limb is in the cell. They find actions by value
//! iteration, which also plans the approach; this grid only covers attacks that start within the
//! path horizon. If a cell is empty, the caller has to approach first (see [`duel`](crate::duel)).

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::path_search::find_paths;
use super::paths::{PathId, PathReport, PathSettings, PathTable};
use super::retime::Retimable;
use crate::graph::{EdgeId, MotionGraph, NodeId};
use crate::maps::regions::{MovingSphere, SphereKey};
use crate::math::{Rigid2, Sphere, floor, in_parallel};

/// Settings of an [`AttackGrid`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AttackGridSettings {
    /// Side of a cell, in metres, at least 0.02. Default 0.15.
    pub cell: f32,
    /// Maximum number of attacks in a cell. Each attack is stored with its best path. Default 4.
    pub most: u32,
    /// Minimum time from the node to the hit, in seconds. Faster attacks are left out, because the
    /// defender needs time to avoid them. Default 0.4.
    #[serde(rename = "notice")]
    pub min_seconds: f32,
    /// Share of the maximum reach at which an attack starts to hit. It stops hitting at maximum
    /// reach. Default 0.8.
    #[serde(rename = "drive")]
    pub reach_share: f32,
    /// Penalty for the distance between the attacking sphere and the cell's centre, in seconds per
    /// metre. Default 2.
    #[serde(rename = "aside")]
    pub distance_weight: f32,
    /// Horizon of the path search, and limits on the paths that are kept.
    pub paths: PathSettings,
}

impl Default for AttackGridSettings {
    fn default() -> Self {
        Self {
            cell: 0.15,
            most: 4,
            min_seconds: 0.4,
            reach_share: 0.8,
            distance_weight: 2.0,
            paths: PathSettings {
                horizon: 2.0,
                alike_distance: 0.10,
                alike_angle: 10f32.to_radians(),
                most: 960,
                threads: 0,
            },
        }
    }
}

/// The foremost sphere of an attack's limb at one moment of contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Time since the attack's start, in frames.
    pub frame: u32,
    /// Centre of the sphere, in the character's frame at the attack's start, in metres.
    pub centre: Vec3,
    /// Radius of the sphere, in metres.
    pub radius: f32,
}

/// A path to an attack, and the frame at which that attack hits the cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct AttackOption {
    /// Path to the attack's start, in [`AttackGrid::paths`].
    pub path: PathId,
    /// Index of the contact in [`AttackGrid::contacts`] of the attack.
    pub contact: u32,
}

/// A candidate entry of the grid.
#[derive(Clone, Copy)]
struct Candidate {
    cell: [i16; 3],
    attack: u32,
    /// Time until the hit plus the distance penalty, in seconds. Lower is better.
    cost: f32,
    option: AttackOption,
}

/// A non-empty cell of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct NodeCell {
    /// Cell coordinates: x, y and z.
    cell: [i16; 3],
    first: u32,
}

/// For each node, the cells that attacks can hit, and the attacks that hit them.
#[derive(Clone, Debug, PartialEq)]
pub struct AttackGrid {
    settings: AttackGridSettings,
    /// Paths to attacks. [`NodePath::goal`](super::paths::NodePath::goal) is an index in
    /// [`BakedGraph::attack_moves`](crate::maps::BakedGraph::attack_moves).
    paths: PathTable,
    /// Contacts of each attack, by its index in [`BakedGraph::attack_moves`](crate::maps::BakedGraph::attack_moves).
    contacts: Vec<Vec<Contact>>,
    /// Index of each node's first cell. The last entry is the number of cells.
    first: Vec<u32>,
    /// Non-empty cells, node by node, sorted within a node.
    cells: Vec<NodeCell>,
    /// Entries of the cells, cell by cell, best first.
    options: Vec<AttackOption>,
}

impl AttackGrid {
    /// Finds the paths from all nodes to the edges of all attacks, which have given spheres, and lists them by the cells that they hit.
    /// `placements` holds the character's frame at each node.
    pub(in crate::maps) fn build(
        graph: &MotionGraph,
        placements: &[Rigid2],
        goals: &[EdgeId],
        spheres: &[Vec<MovingSphere>],
        settings: &AttackGridSettings,
    ) -> Self {
        let settings = AttackGridSettings {
            cell: settings.cell.max(0.02),
            ..*settings
        };
        // An attacker may choose when to attack. Retiming therefore does not make a path better, and is
        // left out.
        let retimable = vec![Retimable::default(); graph.edges().len()];
        let paths = find_paths(graph, &retimable, placements, goals, &settings.paths);
        paths.prepare();
        let spheres = spheres.iter();
        let mut grid = Self {
            settings,
            paths,
            contacts: spheres
                .map(|all| contacts(all, settings.reach_share))
                .collect(),
            first: vec![0],
            cells: Vec::new(),
            options: Vec::new(),
        };
        let nodes = graph.nodes().len();
        let found = in_parallel(settings.paths.threads, nodes, |node| {
            grid.candidates(NodeId(node as u32), graph.frame_rate() as f32)
        });
        for candidates in found {
            for own in candidates.chunk_by(|a, b| a.cell == b.cell) {
                grid.cells.push(NodeCell {
                    cell: own[0].cell,
                    first: grid.options.len() as u32,
                });
                let options = own.iter().map(|candidate| candidate.option);
                grid.options.extend(options);
            }
            grid.first.push(grid.cells.len() as u32);
        }
        grid
    }

    /// Entries to keep for one node, sorted by cell and, within a cell, by cost. `rate` is the number of frames per second.
    fn candidates(&self, node: NodeId, rate: f32) -> Vec<Candidate> {
        let min_frames = (self.settings.min_seconds * rate).ceil().max(0.0) as u32;
        let mut candidates = Vec::new();
        for (id, path) in self.paths.ids(node).zip(self.paths.from_node(node)) {
            let contacts = self.contacts[path.goal as usize].iter();
            for (contact, number) in contacts.zip(0..) {
                let wait = u32::from(path.frames) + contact.frame;
                if wait < min_frames {
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
                        cost: wait as f32 / rate + self.settings.distance_weight * away,
                        option,
                    });
                });
            }
        }
        candidates.sort_by(|a, b| {
            (a.cell, a.attack)
                .cmp(&(b.cell, b.attack))
                .then(a.cost.total_cmp(&b.cost))
                .then(a.option.cmp(&b.option))
        });
        candidates.dedup_by_key(|candidate| (candidate.cell, candidate.attack));
        candidates.sort_by(|a, b| a.cell.cmp(&b.cell).then(a.cost.total_cmp(&b.cost)));
        let mut kept = 0;
        let mut last = None;
        candidates.retain(|candidate| {
            kept = match last == Some(candidate.cell) {
                true => kept + 1,
                false => 0,
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

    /// Settings that the grid was built with.
    #[must_use]
    pub fn settings(&self) -> &AttackGridSettings {
        &self.settings
    }

    /// Attacks that hit `target`, best first. `target` is in the character's frame at the node.
    #[must_use]
    pub fn at(&self, node: NodeId, target: Vec3) -> &[AttackOption] {
        let (from, to) = (self.first[node.index()], self.first[node.index() + 1]);
        let cells = &self.cells[from as usize..to as usize];
        let Some(key) = cell_of(target, self.settings.cell) else {
            return &[];
        };
        match cells.binary_search_by_key(&key, |known| known.cell) {
            Ok(index) => self.options_of(from as usize + index),
            Err(_) => &[],
        }
    }

    /// Non-empty cells of a node in sorted order, each with its attacks.
    pub fn cells(&self, node: NodeId) -> impl Iterator<Item = ([i16; 3], &[AttackOption])> {
        let (from, to) = (self.first[node.index()], self.first[node.index() + 1]);
        (from as usize..to as usize).map(|index| (self.cells[index].cell, self.options_of(index)))
    }

    fn options_of(&self, cell: usize) -> &[AttackOption] {
        let end = self.cells.get(cell + 1);
        let end = end.map_or(self.options.len(), |next| next.first as usize);
        &self.options[self.cells[cell].first as usize..end]
    }

    /// Paths to attacks. [`NodePath::goal`](super::paths::NodePath::goal) is an index in
    /// [`BakedGraph::attack_moves`](crate::maps::BakedGraph::attack_moves).
    #[must_use]
    pub fn paths(&self) -> &PathTable {
        &self.paths
    }

    /// Contacts of an attack, by its index in [`BakedGraph::attack_moves`](crate::maps::BakedGraph::attack_moves).
    #[must_use]
    pub fn contacts(&self, attack: usize) -> &[Contact] {
        &self.contacts[attack]
    }

    /// Contact at which the attack hits.
    #[must_use]
    pub fn contact(&self, option: AttackOption) -> Contact {
        let attack = self.paths.path(option.path).goal as usize;
        self.contacts[attack][option.contact as usize]
    }

    /// Time from the node to the hit, in frames.
    #[must_use]
    pub fn frames(&self, option: AttackOption) -> u32 {
        u32::from(self.paths.path(option.path).frames) + self.contact(option).frame
    }

    /// Weighted mean bearing (in radians, 0 is ahead, π/2 is to the left) and distance (in metres)
    /// at which attacks from a node hit, in the character's frame there. Attacks that hit sooner
    /// have a larger weight. Returns `None` if the node has no attacks. A fighter in guard stands
    /// with the hips at an angle to the opponent, so this bearing, not the character's facing
    /// direction, shows where the character aims.
    #[must_use]
    pub fn aim(&self, node: NodeId) -> Option<(f32, f32)> {
        /// Delay at which an attack's weight is one half, in frames.
        const SOON: f32 = 15.0;
        let (mut way, mut reach, mut all) = (Vec2::ZERO, 0.0, 0.0);
        for &option in self.cells(node).flat_map(|(_, options)| options) {
            let path = self.paths.path(option.path);
            let place = path.placement.point(self.contact(option).centre);
            let place = Vec2::new(place.x, place.z);
            let late = self.frames(option) as f32 / SOON;
            let weight = 1.0 / (1.0 + late * late * late);
            way += place.normalize_or(Vec2::Y) * weight;
            reach += place.length() * weight;
            all += weight;
        }
        (all > 0.0).then(|| (way.x.atan2(way.y), reach / all))
    }

    /// Counts of nodes, cells, entries and bytes.
    #[must_use]
    pub fn report(&self) -> AttackGridReport {
        AttackGridReport {
            nodes: self.first.len() as u64 - 1,
            cells: self.cells.len() as u64,
            options: self.options.len() as u64,
            bytes: (size_of_val(self.cells.as_slice())
                + size_of_val(self.options.as_slice())
                + size_of_val(self.first.as_slice())) as u64,
            path_bytes: self.paths.bytes() as u64,
            paths: self.paths.report(),
        }
    }
}

/// Size of an [`AttackGrid`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AttackGridReport {
    /// Number of nodes in the graph.
    pub nodes: u64,
    /// Number of non-empty cells of all nodes.
    pub cells: u64,
    /// Number of entries in all cells.
    #[serde(rename = "blows")]
    pub options: u64,
    /// Memory of cells and entries, in bytes.
    pub bytes: u64,
    /// Memory of the paths, in bytes.
    pub path_bytes: u64,
    /// Statistics of the path search.
    pub paths: PathReport,
}

/// Cell that contains a place, or `None` if the place is too far away for 16-bit coordinates.
fn cell_of(place: Vec3, side: f32) -> Option<[i16; 3]> {
    let axis = |value: f32| i16::try_from(floor(value / side)).ok();
    Some([axis(place.x)?, axis(place.y)?, axis(place.z)?])
}

/// Finds the contacts of an attack with given spheres, one for each frame. The first contact is where the foremost
/// sphere has `reach_share` of its maximum reach, the last where its reach is at its maximum. Reach is
/// measured along the ground, from the root's position at the attack's start towards the point of
/// maximum reach.
fn contacts(spheres: &[MovingSphere], reach_share: f32) -> Vec<Contact> {
    let ground = |key: &SphereKey| Vec2::new(key.center.x, key.center.z);
    let furthest = |sphere: &MovingSphere| {
        let keys = sphere.keys().iter().enumerate();
        let reached = keys.map(|(frame, key)| (frame, ground(key).length()));
        reached.fold((0, f32::NEG_INFINITY), |best, one| {
            if one.1 > best.1 { one } else { best }
        })
    };
    let reached = spheres.iter().map(|sphere| (sphere, furthest(sphere)));
    // The first of several that reach as far.
    let foremost = reached.reduce(|best, one| if best.1.1 >= one.1.1 { best } else { one });
    let Some((sphere, (last, reach))) = foremost else {
        return Vec::new();
    };
    let keys = &sphere.keys()[..=last];
    let way = ground(&keys[last]).normalize_or(Vec2::Y);
    let is_short = |key: &SphereKey| ground(key).dot(way) < reach_share * reach;
    let first = keys.iter().rposition(is_short).map_or(0, |at| at + 1);
    let contact = |frame: usize| {
        let key = keys.get(frame)?;
        Some(Contact {
            frame: frame as u32,
            centre: key.center,
            radius: key.radius,
        })
    };
    (first..=last.max(first)).filter_map(contact).collect()
}
