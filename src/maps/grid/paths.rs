//! For each node, the paths from it to evasions. They are found once, during the bake.
//!
//! Source: Masaoka & Oshita, section 4.1: for each node, every path within a time horizon that ends
//! in an evasion. Differs: a graph of real motion has millions of paths from a node, most of which
//! are different routes to the same result. A path's result is the evasion, its start time, the
//! place and heading at its start, and how much of the path can be retimed. Of paths with similar
//! results, only the one with the best transitions is kept. Paths that a limit removes are counted.
//!
//! A path is stored as its first edge and the path from that edge's end, so that paths share their
//! ends. That takes two numbers for each path. The other data of a path is computed when it is asked for, along its edges, up to a node
//! whose paths are kept. When a file is read, all links are checked, so that every path leads to an evasion.

use std::fmt;
use std::sync::OnceLock;

use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::retime::Retimable;
use crate::graph::{EdgeId, MotionGraph, NodeId};
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
    /// Maximum number of paths of a node, at most 65,534. They are distributed evenly over the frames of the
    /// horizon and, within a frame, over the evasions. All nodes together have at most
    /// [`PathSettings::MOST_OF_ALL`] paths. Default 960.
    pub most: u32,
    /// Number of threads, or 0 for one thread per CPU core. The paths do not depend on it.
    pub threads: usize,
}

impl PathSettings {
    /// Maximum number of paths of a node, whatever [`PathSettings::most`] says. Also the maximum number of edges from a node with which its
    /// paths begin.
    pub(super) const MOST_OF_A_NODE: usize = 65_534;

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
    /// Index of the goal: of the evasion in [`BakedGraph::evasions`](crate::maps::BakedGraph::evasions), or in the paths of an attack grid of the
    /// attack in [`BakedGraph::attack_moves`](crate::maps::BakedGraph::attack_moves).
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

impl NodePath {
    /// Path without edges: the evasion starts at the node.
    fn start(goal: u16) -> Self {
        Self {
            goal: goal.into(),
            frames: 0,
            faster: 0,
            slower: 0,
            placement: Rigid2::IDENTITY,
        }
    }

    /// Cell of the place and heading at the evasion's start: x, z and heading.
    pub fn alike_cell(&self, distance: f32, angle: f32) -> [i32; 3] {
        alike_cell(self.placement, distance, angle)
    }

    /// Puts an edge in front of the path. In place, because a copy would wait for the numbers that it was just given.
    #[inline]
    fn prepend(&mut self, step: &Step) {
        let Retimable { faster, slower } = step.retimable;
        self.frames += step.frames;
        self.faster += step.frames * u16::from(faster);
        self.slower += step.frames * u16::from(slower);
        self.placement = step.placement * self.placement;
    }
}

/// Cell of a place and heading: x, z and heading.
pub(super) fn alike_cell(placement: Rigid2, distance: f32, angle: f32) -> [i32; 3] {
    /// Minimum cell size. It keeps the cell indices finite.
    const SHORTEST: f32 = 1e-3;
    let cell = |value: f32, side: f32| floor(value / side.max(SHORTEST));
    [
        cell(placement.x, distance),
        cell(placement.z, distance),
        cell(placement.heading(), angle),
    ]
}

/// The paths of all nodes.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct PathTable {
    /// Index of each node's first path. The last entry is the number of paths. The paths of a node
    /// are sorted by length.
    first: Vec<u32>,
    links: Links,
    report: PathReport,
    /// Paths of every [`PathTable::KEPT`]th node.
    #[serde(skip)]
    kept: Vec<OnceLock<Box<[NodePath]>>>,
    /// Largest number of paths of a node.
    #[serde(skip)]
    most: u32,
    /// Index of each node's first edge. The last entry is the number of edges.
    #[serde(skip)]
    first_edge: Vec<u32>,
    /// The part of each edge in paths.
    #[serde(skip)]
    steps: Vec<Step>,
}

/// Target of an edge, and its part in the paths that start with it.
#[derive(Clone, Copy, Debug)]
struct Step {
    /// The first path of the edge's target.
    rest: At,
    /// Length, in frames, or 0 if the edge is too long for a path.
    frames: u16,
    retimable: Retimable,
    /// Character's frame at the edge's end, relative to that at its start.
    placement: Rigid2,
}

/// A path, its node and the first edge of that node.
#[derive(Clone, Copy, Debug)]
struct At {
    path: u32,
    node: NodeId,
    first_edge: u32,
}

impl PartialEq for PathTable {
    /// Compares the stored parts. All others are derived from the graph.
    fn eq(&self, other: &Self) -> bool {
        (&self.first, &self.links, self.report) == (&other.first, &other.links, other.report)
    }
}

/// A path as it is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Link {
    /// Number of the edge among the node's edges, from 1, or 0 if the evasion starts at the node.
    pub(super) edge: u16,
    /// Index of the rest among the paths from the edge's end, or the evasion's index if `edge` is
    /// 0.
    pub(super) rest: u16,
}

/// The links of all paths, 2 bytes each.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Links {
    /// [`Link::edge`] above the `rest_bits` of [`Link::rest`]; 0 for the links in `others`.
    packed: Vec<u16>,
    rest_bits: u32,
    /// Paths without edges and those whose numbers do not fit, in order, with their links.
    others: Vec<(u32, Link)>,
}

impl Links {
    fn len(&self) -> usize {
        self.packed.len()
    }

    #[inline]
    fn get(&self, path: u32) -> Link {
        let packed = self.packed[path as usize];
        if packed == 0 {
            return self.other(path);
        }
        Link {
            edge: packed >> self.rest_bits,
            rest: packed & ((1 << self.rest_bits) - 1),
        }
    }

    /// Link of a path that is not packed.
    fn other(&self, path: u32) -> Link {
        self.others[self.others.partition_point(|other| other.0 < path)].1
    }
}

/// The [packed](Links::packed) link, or 0 if it does not fit.
fn pack(link: Link, rest_bits: u32) -> u16 {
    let packed = u32::from(link.edge) << rest_bits | u32::from(link.rest);
    let fits = link.edge > 0 && link.rest < 1 << rest_bits;
    u16::try_from(packed).ok().filter(|_| fits).unwrap_or(0)
}

impl Links {
    fn iter(&self) -> impl ExactSizeIterator<Item = Link> + '_ {
        (0..self.len() as u32).map(|path| self.get(path))
    }

    /// Appends a link. All links are packed anew once one needs more bits.
    fn push(&mut self, link: Link) {
        let bits = (u16::BITS - link.rest.leading_zeros()).min(u16::BITS - 1);
        if link.edge > 0 && bits > self.rest_bits {
            self.widen(bits);
        }
        let packed = pack(link, self.rest_bits);
        if packed == 0 {
            self.others.push((self.packed.len() as u32, link));
        }
        self.packed.push(packed);
    }

    fn widen(&mut self, rest_bits: u32) {
        let mut others = Vec::new();
        for path in 0..self.packed.len() as u32 {
            let link = self.get(path);
            let packed = pack(link, rest_bits);
            if packed == 0 {
                others.push((path, link));
            }
            self.packed[path as usize] = packed;
        }
        (self.others, self.rest_bits) = (others, rest_bits);
    }
}

impl FromIterator<Link> for Links {
    fn from_iter<I: IntoIterator<Item = Link>>(links: I) -> Self {
        let mut all = Self::default();
        links.into_iter().for_each(|link| all.push(link));
        all
    }
}

impl Serialize for Links {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.iter())
    }
}

/// One by one: all of them unpacked would take several times the memory of what is read.
impl<'de> Deserialize<'de> for Links {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct EachLink;
        impl<'de> Visitor<'de> for EachLink {
            type Value = Links;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the links of paths")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut links: A) -> Result<Links, A::Error> {
                let mut all = Links::default();
                let count = links.size_hint().unwrap_or(0);
                all.packed
                    .reserve_exact(count.min(PathSettings::MOST_OF_ALL));
                while let Some(link) = links.next_element()? {
                    all.push(link);
                }
                Ok(all)
            }
        }
        deserializer.deserialize_seq(EachLink)
    }
}

/// Stands for a number of frames that is not known yet.
const UNKNOWN: u16 = u16::MAX;

impl PathTable {
    /// Number of nodes between two whose paths are kept. Most paths continue along their clip, whose next node has the next number.
    const KEPT: usize = 20;

    /// Number of paths that are restored together.
    const TOGETHER: usize = 16;

    /// A table of stored paths whose other data is restored on first use. `placements` holds the character's frame at each node, in the
    /// space of the node's clip. Links are sound or will be checked.
    pub(super) fn new(
        first: Vec<u32>,
        links: Links,
        report: PathReport,
        graph: &MotionGraph,
        retimable: &[Retimable],
        placements: &[Rigid2],
    ) -> Self {
        let steps = in_parallel(0, graph.edges().len(), |edge| {
            let id = EdgeId(edge as u32);
            let edge = graph.edge(id);
            Step {
                rest: At {
                    path: first[edge.to.index()],
                    node: edge.to,
                    first_edge: graph.first_edge[edge.to.index()],
                },
                frames: u16::try_from(edge.frames).unwrap_or(0),
                retimable: retimable[id.index()],
                placement: edge_placement(graph, placements, id),
            }
        });
        let counts = first.windows(2).map(|pair| pair[1] - pair[0]);
        Self {
            kept: (1..first.len())
                .step_by(Self::KEPT)
                .map(|_| OnceLock::new())
                .collect(),
            most: counts.max().unwrap_or(0),
            first,
            links,
            report,
            first_edge: graph.first_edge.to_vec(),
            steps,
        }
    }

    /// Checks the paths of a table from a file against the graph, so that they can be restored. `starts` holds the node at which each
    /// evasion starts.
    pub(in crate::maps) fn restored(
        self,
        graph: &MotionGraph,
        retimable: &[Retimable],
        placements: &[Rigid2],
        starts: &[NodeId],
    ) -> Result<Self, String> {
        let ends = self.first.windows(2).all(|pair| pair[0] <= pair[1]);
        let all = self.first.last().map(|&end| end as usize);
        if self.first.len() != graph.nodes().len() + 1
            || self.first[0] != 0
            || !ends
            || all != Some(self.links.len())
        {
            return Err("the paths are not those of the graph's nodes".to_owned());
        }
        let Self {
            first,
            links,
            report,
            ..
        } = self;
        let table = Self::new(first, links, report, graph, retimable, placements);
        table.check(starts)?;
        Ok(table)
    }

    /// Paths from a node, sorted by length.
    pub fn from_node(&self, node: NodeId) -> Vec<NodePath> {
        let mut paths = Vec::new();
        self.write_paths(node, &mut paths);
        paths
    }

    /// Writes the [paths from a node](Self::from_node) to `out`, which has room for those of any node then.
    pub(crate) fn write_paths(&self, node: NodeId, out: &mut Vec<NodePath>) {
        let [first, end] = self.ends(node);
        out.clear();
        out.reserve(self.most as usize);
        out.resize((end - first) as usize, NodePath::start(0));
        let firsts = (first..).step_by(Self::TOGETHER);
        for (first, part) in firsts.zip(out.chunks_mut(Self::TOGETHER)) {
            self.restore(first, node, part);
        }
    }

    /// Ids of the paths in [`PathTable::from_node`], in the same order.
    pub fn ids(&self, node: NodeId) -> impl ExactSizeIterator<Item = PathId> + use<> {
        let [first, end] = self.ends(node);
        (first..end).map(PathId)
    }

    /// The path with an id.
    pub fn path(&self, id: PathId) -> NodePath {
        let mut path = [NodePath::start(0)];
        self.restore(id.0, self.node(id), &mut path);
        path[0]
    }

    /// The node from which a path leads.
    fn node(&self, id: PathId) -> NodeId {
        let node = self.first.partition_point(|&first| first <= id.0) - 1;
        NodeId(node as u32)
    }

    /// Edges of a path, without the evasion's edge.
    pub fn edges(&self, id: PathId) -> impl Iterator<Item = EdgeId> + '_ {
        let mut at = self.at(id.0, self.node(id));
        std::iter::from_fn(move || {
            let (edge, rest) = self.split(at).ok()?;
            at = rest;
            Some(edge)
        })
    }

    /// Restores the paths that are kept, from the last node to the first.
    pub(in crate::maps) fn prepare(&self) {
        in_parallel(0, self.kept.len(), |place| {
            let place = self.kept.len() - 1 - place;
            let node = NodeId((place * Self::KEPT) as u32);
            self.kept[place].get_or_init(|| self.from_node(node).into());
        });
    }

    /// Statistics of the path search.
    pub fn report(&self) -> PathReport {
        self.report
    }

    /// Memory of the table with the paths that are kept, in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.first.as_slice())
            + size_of_val(self.links.packed.as_slice())
            + self.links.len() / Self::KEPT * size_of::<NodePath>()
    }

    /// First path of a node, and the end of its paths.
    #[inline]
    fn ends(&self, node: NodeId) -> [u32; 2] {
        let first = &self.first[node.index()..];
        [first[0], first[1]]
    }

    fn at(&self, path: u32, node: NodeId) -> At {
        let first_edge = self.first_edge[node.index()];
        At {
            path,
            node,
            first_edge,
        }
    }

    /// First edge of a path and the path after it; the goal if the path has no edge.
    #[inline]
    fn split(&self, at: At) -> Result<(EdgeId, At), u16> {
        let link = self.links.get(at.path);
        let number = link.edge.checked_sub(1).ok_or(link.rest)?;
        let edge = EdgeId(at.first_edge + u32::from(number));
        let rest = self.steps[edge.index()].rest;
        let path = rest.path + u32::from(link.rest);
        Ok((edge, At { path, ..rest }))
    }

    /// The paths of a node, if they are kept and restored.
    #[inline]
    fn kept(&self, node: NodeId) -> Option<&[NodePath]> {
        let (place, other) = (node.index() / Self::KEPT, node.index() % Self::KEPT);
        self.kept
            .get(place)
            .filter(|_| other == 0)?
            .get()
            .map(|paths| &**paths)
    }

    /// Restores consecutive paths of a node, at most [`PathTable::TOGETHER`], whose links were checked. They are followed side by side,
    /// because each alone would wait for the memory of its next link, and its transform for that of the one before.
    fn restore(&self, first: u32, node: NodeId, out: &mut [NodePath]) {
        /// Number of edges that are followed at once.
        const MOST: usize = 32;
        let mut edges = [[EdgeId(0); Self::TOGETHER]; MOST];
        let mut counts = [0; Self::TOGETHER];
        let mut at = [self.at(first, node); Self::TOGETHER];
        at.iter_mut()
            .zip(first..)
            .for_each(|(at, path)| at.path = path);
        // A bit for each path that is not followed to its end.
        let mut open = (1u32 << out.len()) - 1;
        for (depth, edges) in edges.iter_mut().enumerate() {
            let mut left = open;
            while left != 0 {
                let lane = left.trailing_zeros() as usize;
                left &= left - 1;
                let here = at[lane];
                let kept = self.kept(here.node);
                if let Some(kept) = kept {
                    out[lane] = kept[(here.path - self.first[here.node.index()]) as usize];
                    open &= !(1 << lane);
                    continue;
                }
                match self.split(here) {
                    Ok((edge, rest)) => {
                        (edges[lane], counts[lane], at[lane]) = (edge, depth + 1, rest);
                    }
                    Err(goal) => {
                        out[lane] = NodePath::start(goal);
                        open &= !(1 << lane);
                    }
                }
            }
        }
        while open != 0 {
            let lane = open.trailing_zeros() as usize;
            open &= open - 1;
            let At { path, node, .. } = at[lane];
            self.restore(path, node, std::slice::from_mut(&mut out[lane]));
        }
        let deepest = counts.into_iter().max().unwrap_or(0);
        for (depth, edges) in edges[..deepest].iter().enumerate().rev() {
            for (lane, out) in out.iter_mut().enumerate() {
                if depth < counts[lane] {
                    out.prepend(&self.steps[edges[lane].index()]);
                }
            }
        }
    }

    /// Checks all links. The error describes the first link that points outside the table, path that contains itself, or node whose paths are
    /// not sorted by length. Nodes are processed from the last to the first, because most paths continue along their clip, whose next node has
    /// the next number.
    fn check(&self, starts: &[NodeId]) -> Result<(), &'static str> {
        let mut frames = vec![UNKNOWN; self.links.len()];
        let mut open = Vec::new();
        for node in (0..self.first.len() as u32 - 1).rev().map(NodeId) {
            let ([first, end], mut longest) = (self.ends(node), 0);
            for path in first..end {
                let count = self.count_frames(path, node, starts, &mut frames, &mut open);
                let count = count.ok_or("a path leads nowhere, or to itself")?;
                if count < longest {
                    return Err("a node's paths are not in the order of their length");
                }
                longest = count;
            }
        }
        Ok(())
    }

    /// Number of frames of a path of a node; `None` if it does not lead to an evasion. `known` holds the numbers of frames that are known
    /// already. `open` is scratch: the paths whose rest is not known yet, each with the number of frames of its first edge.
    fn count_frames(
        &self,
        mut path: u32,
        mut node: NodeId,
        starts: &[NodeId],
        known: &mut [u16],
        open: &mut Vec<(u32, u16)>,
    ) -> Option<u16> {
        open.clear();
        let mut frames = loop {
            match known[path as usize] {
                UNKNOWN => {}
                known => break known,
            }
            let link = self.links.get(path);
            let Some(number) = link.edge.checked_sub(1) else {
                let starts_here = starts.get(usize::from(link.rest)) == Some(&node);
                starts_here.then(|| known[path as usize] = 0)?;
                break 0;
            };
            let edges = &self.first_edge[node.index()..];
            let edge = Some(edges[0] + u32::from(number)).filter(|&edge| edge < edges[1])?;
            let step = self.steps[edge as usize];
            let [first, end] = self.ends(step.rest.node);
            let rest = Some(first + u32::from(link.rest)).filter(|&rest| rest < end)?;
            // Every path is longer than its rest, so a chain has at most `u16::MAX` paths. A path that contains itself exceeds this.
            if step.frames == 0 || open.len() >= usize::from(u16::MAX) {
                return None;
            }
            open.push((path, step.frames));
            (path, node) = (rest, step.rest.node);
        };
        while let Some((longer, first)) = open.pop() {
            frames = frames
                .checked_add(first)
                .filter(|&frames| frames < UNKNOWN)?;
            known[longer as usize] = frames;
        }
        Some(frames)
    }
}

/// The character's frame at an edge's end, relative to that at its start. `placements` holds the frame at each node, in the space of the
/// node's clip.
pub(super) fn edge_placement(graph: &MotionGraph, placements: &[Rigid2], id: EdgeId) -> Rigid2 {
    let edge = graph.edge(id);
    let (from, to) = (placements[edge.from.index()], placements[edge.to.index()]);
    from.inverse() * graph.clip_change(id) * to
}
