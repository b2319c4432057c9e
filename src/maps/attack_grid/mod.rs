//! For every node, what to do about somebody who stands there: found once, for all places that the graph's attacks reach.
//!
//! Source: Lee & Lee, "Precomputing Avatar Behavior from Human Motion Data" (2004): at every node a grid over where the
//! target is, seen from the avatar, and in each cell the best action. Differs: they find the actions by value iteration
//! over target positions on the ground, one a cell, and approach by them as well. Here a cell is one of space, since a
//! blow at the head is none at the knee; it holds several paths, each to another attack, with the moment at which the attack's
//! limb is there; and where it holds none, whoever asks has to come nearer first (see [`avoid::duel`](crate::duel)).

mod build;
mod contact;

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

pub use contact::Contact;

use super::{BakedGraph, PathId, PathReport, PathSettings, PathTable, Strike};
use crate::graph::NodeId;
use crate::math::floor;

/// What is filed in an [`AttackGrid`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AttackGridSettings {
    /// Side of a cell, metres; 0.02 at least. Default 0.15.
    pub cell: f32,
    /// Most attacks of a cell, each by its best path. Default 4.
    pub most: u32,
    /// No attack is filed that strikes sooner after the node, seconds: whoever is to avoid it needs some time. Default 0.4.
    pub notice: f32,
    /// An attack strikes from where its limb has this share of its furthest reach, until where that is largest. Default 0.8.
    pub drive: f32,
    /// What a metre between the striking sphere and the middle of a cell weighs, in seconds of waiting. Default 2.
    pub aside: f32,
    /// How far paths to attacks are followed, and how many of a node there are.
    pub paths: PathSettings,
}

impl Default for AttackGridSettings {
    fn default() -> Self {
        Self {
            cell: 0.15,
            most: 4,
            notice: 0.4,
            drive: 0.8,
            aside: 2.0,
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

/// A path to an attack, and the moment at which that strikes the cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Blow {
    /// In [`AttackGrid::paths`]: the path to the attack's start.
    pub path: PathId,
    /// Which of the attack's [`AttackGrid::contacts`].
    pub contact: u32,
}

/// A cell of a node in which something is filed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Filed {
    /// x, y and z.
    cell: [i16; 3],
    first: u32,
}

/// For each node the cells that an attack can strike, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct AttackGrid {
    settings: AttackGridSettings,
    /// Where a path's evasion would stand there is an attack: its position in [`BakedGraph::strikes`].
    paths: PathTable,
    /// By strike.
    contacts: Vec<Vec<Contact>>,
    /// For each node its first cell; one more at the end.
    first: Vec<u32>,
    /// Of each node in order.
    cells: Vec<Filed>,
    /// Of each cell the best first.
    blows: Vec<Blow>,
}

impl AttackGrid {
    /// Finds the paths from all nodes to all attacks, and files them. The same for any number of threads.
    #[must_use]
    pub fn new(baked: &BakedGraph, settings: &AttackGridSettings) -> Self {
        build::build(baked, settings)
    }

    /// The settings that it was made with.
    #[must_use]
    pub fn settings(&self) -> &AttackGridSettings {
        &self.settings
    }

    /// What strikes somebody at `target` (in the character's frame at the node), the best first.
    #[must_use]
    pub fn at(&self, node: NodeId, target: Vec3) -> &[Blow] {
        let (from, to) = (self.first[node.index()], self.first[node.index() + 1]);
        let cells = &self.cells[from as usize..to as usize];
        let Some(key) = cell_of(target, self.settings.cell) else {
            return &[];
        };
        match cells.binary_search_by_key(&key, |filed| filed.cell) {
            Ok(index) => self.blows_of(from as usize + index),
            Err(_) => &[],
        }
    }

    /// The cells of a node, each with its blows, in order.
    pub fn cells(&self, node: NodeId) -> impl Iterator<Item = ([i16; 3], &[Blow])> {
        let (from, to) = (self.first[node.index()], self.first[node.index() + 1]);
        (from as usize..to as usize).map(|index| (self.cells[index].cell, self.blows_of(index)))
    }

    fn blows_of(&self, cell: usize) -> &[Blow] {
        let end = self.cells.get(cell + 1);
        let end = end.map_or(self.blows.len(), |next| next.first as usize);
        &self.blows[self.cells[cell].first as usize..end]
    }

    /// The paths to attacks. What [`NodePath::evasion`](super::NodePath::evasion) says is the attack's position in
    /// [`BakedGraph::strikes`].
    #[must_use]
    pub fn paths(&self) -> &PathTable {
        &self.paths
    }

    /// The attack that a path leads to.
    #[must_use]
    pub fn strike<'a>(&self, baked: &'a BakedGraph, path: PathId) -> &'a Strike {
        &baked.strikes()[self.paths.path(path).evasion as usize]
    }

    /// Where and when an attack strikes, by its position in [`BakedGraph::strikes`].
    #[must_use]
    pub fn contacts(&self, strike: usize) -> &[Contact] {
        &self.contacts[strike]
    }

    /// The moment of a blow.
    #[must_use]
    pub fn contact(&self, blow: Blow) -> Contact {
        let strike = self.paths.path(blow.path).evasion as usize;
        self.contacts[strike][blow.contact as usize]
    }

    /// Frames from the node to the blow.
    #[must_use]
    pub fn frames(&self, blow: Blow) -> u32 {
        u32::from(self.paths.path(blow.path).frames) + self.contact(blow).frame
    }

    /// Where attacks from a node strike on the whole, in the character's frame there: at which bearing (radians, 0 ahead, π/2 to the
    /// left), and how far away (metres). Soon ones weigh more. `None` where none is filed. A guard is not held with the hips
    /// square to whom it is held against, so this, and not the way that the character faces, says where it looks.
    #[must_use]
    pub fn aim(&self, node: NodeId) -> Option<(f32, f32)> {
        /// Frames: an attack that is so far away weighs half.
        const SOON: f32 = 15.0;
        let (mut way, mut reach, mut all) = (Vec2::ZERO, 0.0, 0.0);
        for &blow in self.cells(node).flat_map(|(_, blows)| blows) {
            let path = self.paths.path(blow.path);
            let place = path.placement.point(self.contact(blow).centre);
            let place = Vec2::new(place.x, place.z);
            let late = self.frames(blow) as f32 / SOON;
            let weight = 1.0 / (1.0 + late * late * late);
            way += place.normalize_or(Vec2::Y) * weight;
            reach += place.length() * weight;
            all += weight;
        }
        (all > 0.0).then(|| (way.x.atan2(way.y), reach / all))
    }

    /// How much there is of everything.
    #[must_use]
    pub fn report(&self) -> AttackGridReport {
        AttackGridReport {
            nodes: self.first.len() as u64 - 1,
            cells: self.cells.len() as u64,
            blows: self.blows.len() as u64,
            bytes: (size_of_val(self.cells.as_slice())
                + size_of_val(self.blows.as_slice())
                + size_of_val(self.first.as_slice())) as u64,
            path_bytes: self.paths.bytes() as u64,
            paths: self.paths.report(),
        }
    }
}

/// How large an [`AttackGrid`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AttackGridReport {
    /// Of the graph.
    pub nodes: u64,
    /// Cells of all nodes in which something is filed.
    pub cells: u64,
    /// What is filed in them.
    pub blows: u64,
    /// Of cells and blows in memory.
    pub bytes: u64,
    /// Of the paths.
    pub path_bytes: u64,
    /// How the search for paths went.
    pub paths: PathReport,
}

/// The cell that a place lies in; `None` for one that is thousands of cells away.
fn cell_of(place: Vec3, side: f32) -> Option<[i16; 3]> {
    let axis = |value: f32| i16::try_from(floor(value / side)).ok();
    Some([axis(place.x)?, axis(place.y)?, axis(place.z)?])
}
