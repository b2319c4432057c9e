//! For each node, the paths from it to evasions. They are found once, during the bake.
//!
//! Source: Masaoka & Oshita, section 4.1: for each node, every path within a time horizon that ends
//! in an evasion. Differs: a graph of real motion has millions of paths from a node, most of which
//! are different routes to the same result. A path's result is the evasion, its start time, the
//! place and heading at its start, and how much of the path can be retimed. Of paths with similar
//! results, only the one with the best transitions is kept. Paths that a limit removes are counted.
//!
//! A path is stored as its first edge and the path from that edge's end, so that paths share their
//! ends. That takes two numbers for each path.

mod build;
mod restore;

use serde::{Deserialize, Serialize};

pub(super) use build::{PathSource, build};
pub(super) use restore::PathsBeside;
use restore::Restorer;

use super::{OnFirstUse, Retimable};
use crate::graph::{EdgeId, NodeId};
use crate::math::{Rigid2, floor, in_parallel};

/// Settings of the path search.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PathSettings {
    /// Maximum duration of a path at rate 1, from the node to the evasion's start, in seconds.
    /// Default 2.
    pub horizon: f32,
    /// Cell size for similar places, in metres, at least 0.001. Paths to the same evasion at the
    /// same time are similar if the evasion starts in the same cell. Default 0.05.
    pub alike_distance: f32,
    /// Cell size for similar headings at the evasion's start, in radians, at least 0.001. Default
    /// 5°.
    pub alike_angle: f32,
    /// Maximum number of paths of a node. They are distributed evenly over the frames of the
    /// horizon and, within a frame, over the evasions. All nodes together have at most
    /// [`PathSettings::MOST_OF_ALL`] paths. Default 960.
    pub most: u32,
    /// Number of threads, or 0 for one thread per CPU core. The paths do not depend on it.
    pub threads: usize,
}

impl PathSettings {
    /// Maximum number of paths of all nodes, 4,194,304. Each node may have at least one path for each number of frames, even if that exceeds
    /// it. Paths beyond the maximum are removed and counted. So many paths are restored in a fifth of a second when a file is loaded.
    pub const MOST_OF_ALL: usize = 1 << 22;
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

/// Statistics of the path search.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PathReport {
    /// Number of paths of all nodes that were kept.
    pub kept: u64,
    /// Number of paths that were removed because a similar path was kept.
    pub alike: u64,
    /// Number of paths that [`PathSettings::most`] removed although no similar path was kept.
    pub cut: u64,
}

/// Index of a path in the [`PathTable`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PathId(pub u32);

/// A path from a node to the start of a goal: an evasion, or in an attack grid an attack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodePath {
    /// First edge and the path from its end, or `None` if the evasion starts at the node.
    pub(super) next: Option<(EdgeId, PathId)>,
    /// Index of the goal: of the evasion in [`BakedGraph::evasions`](super::BakedGraph::evasions), or in the paths of an attack grid of the
    /// attack in [`BakedGraph::attack_moves`](super::BakedGraph::attack_moves).
    pub goal: u32,
    /// Number of frames until the evasion starts, at rate 1.
    pub frames: u16,
    /// Number of those frames on edges that may be played faster.
    pub faster: u16,
    /// Number of those frames on edges that may be played slower.
    pub slower: u16,
    /// Character's frame (root on the ground, facing +Z) at the evasion's start, relative to that
    /// at the node.
    pub placement: Rigid2,
}

/// The part of an edge in the paths that start with it.
#[derive(Clone, Copy, Debug)]
struct EdgeStep {
    /// Length, in frames.
    frames: u16,
    retimable: Retimable,
    /// Character's frame at the edge's end, relative to that at its start.
    placement: Rigid2,
}

impl NodePath {
    /// Path without edges: the evasion starts at the node.
    fn start(goal: u32) -> Self {
        Self {
            next: None,
            goal,
            frames: 0,
            faster: 0,
            slower: 0,
            placement: Rigid2::IDENTITY,
        }
    }

    /// Cell of the place and heading at the evasion's start: x, z and heading.
    #[must_use]
    pub fn alike_cell(&self, distance: f32, angle: f32) -> [i32; 3] {
        alike_cell(self.placement, distance, angle)
    }

    /// Returns this path, whose index is `own`, with an edge in front of it. Returns `None` if the path would have too many frames.
    fn after(self, edge: EdgeId, own: PathId, step: EdgeStep) -> Option<Self> {
        let EdgeStep {
            frames, retimable, ..
        } = step;
        let of = |changes: bool| if changes { frames } else { 0 };
        Some(Self {
            next: Some((edge, own)),
            goal: self.goal,
            frames: self.frames.checked_add(frames)?,
            faster: self.faster + of(retimable.faster),
            slower: self.slower + of(retimable.slower),
            placement: step.placement * self.placement,
        })
    }
}

/// Cell of a place and heading: x, z and heading.
fn alike_cell(placement: Rigid2, distance: f32, angle: f32) -> [i32; 3] {
    /// Minimum cell size. It keeps the cell indices finite.
    const SHORTEST: f32 = 1e-3;
    let cell = |value: f32, side: f32| floor(value / side.max(SHORTEST));
    [
        cell(placement.x, distance),
        cell(placement.z, distance),
        cell(placement.heading(), angle),
    ]
}

/// The paths of all nodes. They are restored node by node on first use.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct PathTable {
    /// Index of each node's first path. The last entry is the number of paths. The paths of a node
    /// are sorted by length.
    first: Vec<u32>,
    links: Vec<Link>,
    report: PathReport,
    /// Paths of each node.
    #[serde(skip)]
    paths: Vec<OnFirstUse<Box<[NodePath]>>>,
    #[serde(skip)]
    restorer: Restorer,
    #[serde(skip)]
    nodes: NodeOfPath,
}

impl PartialEq for PathTable {
    /// Compares the stored parts. All others are derived from the graph.
    fn eq(&self, other: &Self) -> bool {
        (&self.first, &self.links, self.report) == (&other.first, &other.links, other.report)
    }
}

/// A path as it is stored in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Link {
    /// Number of the edge among the node's edges, from 1, or 0 if the evasion starts at the node.
    edge: u32,
    /// Index of the rest among the paths from the edge's end, or the evasion's index if `edge` is
    /// 0.
    rest: u32,
}

impl PathTable {
    /// Paths from a node, sorted by length.
    #[must_use]
    #[inline]
    pub fn of(&self, node: NodeId) -> &[NodePath] {
        self.paths[node.index()].get_or_make(|| self.restorer.paths(self, node))
    }

    /// Number of paths.
    pub(super) fn count(&self) -> usize {
        self.links.len()
    }

    /// Ids of the paths in [`PathTable::of`], in the same order.
    #[must_use]
    pub fn ids(&self, node: NodeId) -> impl ExactSizeIterator<Item = PathId> + use<> {
        (self.first[node.index()]..self.first[node.index() + 1]).map(PathId)
    }

    /// The path with an id.
    #[must_use]
    #[inline]
    pub fn path(&self, id: PathId) -> &NodePath {
        let node = self.nodes.of(&self.first, id);
        &self.of(node)[(id.0 - self.first[node.index()]) as usize]
    }

    /// Edges of a path, without the evasion's edge.
    pub fn edges(&self, id: PathId) -> impl Iterator<Item = EdgeId> + '_ {
        let mut next = self.path(id).next;
        std::iter::from_fn(move || {
            let (edge, rest) = next?;
            next = self.path(rest).next;
            Some(edge)
        })
    }

    /// Restores all paths. Nodes are processed from the last to the first, because most paths continue along their clip, whose next node has
    /// the next number.
    pub(super) fn prepare(&self) {
        in_parallel(0, self.paths.len(), |node| {
            let _ = self.of(NodeId((self.paths.len() - 1 - node) as u32));
        });
    }

    /// Statistics of the path search.
    #[must_use]
    pub fn report(&self) -> PathReport {
        self.report
    }

    /// Memory of the table with all paths, in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(self.first.as_slice())
            + size_of_val(self.links.as_slice())
            + self.count() * size_of::<NodePath>()
    }
}

/// Finds the node of a path by its index.
#[derive(Clone, Debug, Default)]
struct NodeOfPath {
    /// Node of every [`NodeOfPath::STEP`]th path.
    nodes: Vec<u32>,
}

impl NodeOfPath {
    const STEP: usize = 32;

    fn new(first: &[u32]) -> Self {
        let ends = first.get(1..).unwrap_or(&[]);
        let mut node = 0;
        let count = ends.last().map_or(0, |&end| end as usize);
        let nodes = (0..count).step_by(Self::STEP).map(|path| {
            while ends[node] as usize <= path {
                node += 1;
            }
            node as u32
        });
        Self {
            nodes: nodes.collect(),
        }
    }

    #[inline]
    fn of(&self, first: &[u32], PathId(path): PathId) -> NodeId {
        let mut node = self.nodes[path as usize / Self::STEP];
        while first[node as usize + 1] <= path {
            node += 1;
        }
        NodeId(node)
    }
}
