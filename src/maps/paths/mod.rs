//! For every node, the ways from it to an evasion: found once, when a graph is baked.
//!
//! Source: Masaoka & Oshita, section 4.1: for every node every path within a time horizon that ends
//! in an evasion. Differs: a graph of real motion has millions of paths from a node, nearly all of
//! them different routes to the same answer. What matters of a path is which evasion starts when,
//! where and facing where, and how much of the way can be retimed: of paths that are alike in all
//! of that the one with the best transitions is kept, and what a limit drops is counted.
//!
//! A path from a node is an edge and then a path from the node that the edge leads to, so that all
//! of them share their ends: two numbers a path are enough to write them down.

mod build;
mod restore;

use serde::{Deserialize, Serialize};

pub(super) use build::{PathSource, build};

use super::Retimable;
use crate::graph::{EdgeId, NodeId};
use crate::math::{Rigid2, floor};

/// How far paths are followed, and how many are kept.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PathSettings {
    /// Paths last at most this long at rate 1 until their evasion starts, seconds. Default 2.
    pub horizon: f32,
    /// Paths to the same evasion at the same time are alike when it starts in one cell of a grid
    /// with this side, metres; 0.001 at least. Default 0.05.
    pub alike_distance: f32,
    /// And when the character faces into one cell of this size then, radians; 0.001 at least.
    /// Default 5°.
    pub alike_angle: f32,
    /// Most paths of a node. They are shared out evenly among the frames of the horizon, and there
    /// among the evasions. All nodes together have [`PathSettings::MOST_OF_ALL`] at most. Default 960.
    pub most: u32,
    /// Threads; 0 for as many as the machine has. The paths are the same for any number.
    pub threads: usize,
}

impl PathSettings {
    /// Most paths of all nodes together, some 4 GB while they are sought: what is beyond is cut off, and counted.
    pub const MOST_OF_ALL: usize = 1 << 26;
}

impl Default for PathSettings {
    fn default() -> Self {
        Self {
            horizon: 2.0,
            alike_distance: 0.05,
            alike_angle: 5f32.to_radians(),
            most: 960,
            threads: 0,
        }
    }
}

/// How the search for all paths went.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PathReport {
    /// Paths of all nodes that were kept.
    pub kept: u64,
    /// Paths that were left out since an alike one is there.
    pub alike: u64,
    /// Paths that [`PathSettings::most`] left out, different from all that were kept.
    pub cut: u64,
}

/// A path in the [`PathTable`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PathId(pub u32);

/// A path from a node to an evasion's start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodePath {
    /// The first edge, and the path from its end; `None` where the evasion starts at the node.
    pub(super) next: Option<(EdgeId, PathId)>,
    /// Position in [`BakedGraph::evasions`](super::BakedGraph::evasions) of the evasion that
    /// follows.
    pub evasion: u32,
    /// Frames until it starts, at rate 1.
    pub frames: u16,
    /// Of these, frames of edges that may be played faster.
    pub faster: u16,
    /// And slower.
    pub slower: u16,
    /// The character's frame (root on the ground, facing +Z) at the evasion's start, in that at the
    /// node.
    pub placement: Rigid2,
}

impl NodePath {
    /// The path without an edge: the evasion starts at the node.
    fn start(evasion: u32) -> Self {
        Self {
            next: None,
            evasion,
            frames: 0,
            faster: 0,
            slower: 0,
            placement: Rigid2::IDENTITY,
        }
    }

    /// Where its evasion starts, in the grid whose cells hold what is alike: x, z and heading.
    #[must_use]
    pub fn alike_cell(&self, distance: f32, angle: f32) -> [i32; 3] {
        /// With no side at all everything would be infinitely far, and so all in one cell.
        const SHORTEST: f32 = 1e-3;
        let cell = |value: f32, side: f32| floor(value / side.max(SHORTEST));
        [
            cell(self.placement.x, distance),
            cell(self.placement.z, distance),
            cell(self.placement.heading(), angle),
        ]
    }

    /// This path with an edge before it, of so many frames, that takes the character a `step` on;
    /// `None` for more frames than a path can have.
    fn after(
        self,
        next: (EdgeId, PathId),
        (frames, retimable): (u16, Retimable),
        step: Rigid2,
    ) -> Option<Self> {
        let of = |changes: bool| if changes { frames } else { 0 };
        Some(Self {
            next: Some(next),
            evasion: self.evasion,
            frames: self.frames.checked_add(frames)?,
            faster: self.faster + of(retimable.faster),
            slower: self.slower + of(retimable.slower),
            placement: step * self.placement,
        })
    }
}

/// The paths of all nodes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PathTable {
    /// For each node its first path; one more at the end. A node's paths come by their length.
    first: Vec<u32>,
    links: Vec<Link>,
    report: PathReport,
    #[serde(skip)]
    paths: Vec<NodePath>,
}

/// A path as files hold it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Link {
    /// Which of the node's edges, from 1; 0 where the evasion starts at once.
    edge: u32,
    /// Which of the paths from that edge's end; the evasion where it starts at once.
    rest: u32,
}

impl PathTable {
    /// The paths from a node, short ones first.
    #[must_use]
    pub fn of(&self, node: NodeId) -> &[NodePath] {
        &self.paths[self.first[node.index()] as usize..self.first[node.index() + 1] as usize]
    }

    pub(super) fn all(&self) -> &[NodePath] {
        &self.paths
    }

    /// The ids of [`PathTable::of`], in its order.
    #[must_use]
    pub fn ids(&self, node: NodeId) -> impl ExactSizeIterator<Item = PathId> + use<> {
        (self.first[node.index()]..self.first[node.index() + 1]).map(PathId)
    }

    /// One path.
    #[must_use]
    pub fn path(&self, id: PathId) -> &NodePath {
        &self.paths[id.0 as usize]
    }

    /// The edges of a path, the evasion's own not among them.
    pub fn edges(&self, id: PathId) -> impl Iterator<Item = EdgeId> + '_ {
        let mut next = self.path(id).next;
        std::iter::from_fn(move || {
            let (edge, rest) = next?;
            next = self.path(rest).next;
            Some(edge)
        })
    }

    /// How many paths, and how many were left out.
    #[must_use]
    pub fn report(&self) -> PathReport {
        self.report
    }

    /// What it takes in memory, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(self.first.as_slice())
            + size_of_val(self.links.as_slice())
            + size_of_val(self.paths.as_slice())
    }
}
