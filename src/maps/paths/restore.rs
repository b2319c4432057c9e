//! Restores the paths of a table from its links: of a bake, or of a file.
//!
//! When a file is read, all links are checked, so that every path leads to an evasion, and the number of frames of each path is computed.
//! The other data of a path is computed on first use.

use std::sync::atomic::{AtomicBool, AtomicU16, Ordering};

use super::build::step;
use super::{EdgeStep, NodeOfPath, NodePath, PathId, PathTable};
use crate::graph::{EdgeId, MotionGraph, NodeId};
use crate::maps::{Evasion, OnFirstUse, Retimable};
use crate::math::parallel::fill;
use crate::math::{Rigid2, in_parallel};

/// Inputs of paths besides their graph.
#[derive(Clone, Copy)]
pub(in crate::maps) struct PathsBeside<'a> {
    pub(in crate::maps) retimable: &'a [Retimable],
    pub(in crate::maps) evasions: &'a [Evasion],
    /// Character's frame at each node, in the space of the node's clip.
    pub(in crate::maps) placements: &'a [Rigid2],
}

const NOWHERE: &str = "a path leads nowhere, or to itself";
const UNSORTED: &str = "a node's paths are not in the order of their length";

impl PathTable {
    /// Checks the paths of a table from a file against the graph, so that they can be restored.
    pub(in crate::maps) fn restored(
        self,
        graph: &MotionGraph,
        beside: PathsBeside<'_>,
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
        let restorer = Restorer::new(graph, beside.retimable, beside.placements);
        let check = Check {
            table: &self,
            restorer: &restorer,
            starts: beside
                .evasions
                .iter()
                .map(|evasion| graph.edge(evasion.edge).from)
                .collect(),
            frames: self.links.iter().map(|_| AtomicU16::new(UNKNOWN)).collect(),
        };
        check.run()?;
        Ok(self.with_restorer(restorer))
    }

    /// The table with paths that are restored on first use. Its links are sound.
    pub(super) fn with_restorer(self, restorer: Restorer) -> Self {
        let nodes = self.first.len() - 1;
        Self {
            paths: (0..nodes).map(|_| OnFirstUse::default()).collect(),
            nodes: NodeOfPath::new(&self.first),
            restorer,
            ..self
        }
    }

    /// First path of a node, and the end of its paths.
    #[inline]
    fn ends(&self, node: NodeId) -> [u32; 2] {
        let first = &self.first[node.index()..];
        [first[0], first[1]]
    }
}

/// Data that paths are restored from.
#[derive(Clone, Debug, Default)]
pub(super) struct Restorer {
    /// Index of each node's first edge. The last entry is the number of edges.
    first_edge: Vec<u32>,
    steps: Vec<Step>,
}

/// Target of an edge, and its part in paths.
#[derive(Clone, Copy, Debug)]
struct Step {
    to: NodeId,
    /// The edge's part in paths. It has 0 frames if the edge is too long for a path.
    adds: EdgeStep,
}

const NO_STEP: Step = Step {
    to: NodeId(0),
    adds: EdgeStep {
        frames: 0,
        retimable: Retimable {
            faster: false,
            slower: false,
        },
        placement: Rigid2::IDENTITY,
    },
};

/// Continuation of a path: an edge, and the path from its end.
#[derive(Clone, Copy)]
struct Next {
    edge: EdgeId,
    rest: u32,
    to: NodeId,
}

impl Restorer {
    pub(super) fn new(graph: &MotionGraph, retimable: &[Retimable], placements: &[Rigid2]) -> Self {
        let mut steps = vec![NO_STEP; graph.edges().len()];
        fill(&mut steps, |edge| {
            let id = EdgeId(edge as u32);
            let edge = graph.edge(id);
            Step {
                to: edge.to,
                adds: EdgeStep {
                    frames: u16::try_from(edge.frames).unwrap_or(0),
                    retimable: retimable[id.index()],
                    placement: step(graph, placements, id),
                },
            }
        });
        Self {
            first_edge: graph.first_edges().to_vec(),
            steps,
        }
    }

    /// Restores the paths of a node, whose links were checked. Paths of other nodes that are restored already are reused.
    pub(super) fn paths(&self, table: &PathTable, node: NodeId) -> Box<[NodePath]> {
        let [first, end] = table.ends(node);
        // Edges of the path in reverse order.
        let mut edges: Vec<Next> = Vec::new();
        let path = |path: u32| {
            edges.clear();
            let (mut at, mut from) = (path, node);
            let mut path = loop {
                let Some(next) = self.next(table, at, from) else {
                    break NodePath::start(table.links[at as usize].rest);
                };
                edges.push(next);
                (at, from) = (next.rest, next.to);
                if let Some(known) = table.paths[from.index()].get() {
                    break known[(at - table.first[from.index()]) as usize];
                }
            };
            while let Some(Next { edge, rest, .. }) = edges.pop() {
                let longer = path.after(edge, PathId(rest), self.steps[edge.index()].adds);
                path = longer.unwrap_or(path);
            }
            path
        };
        (first..end).map(path).collect()
    }

    /// Continuation of a path from a node, or `None` if its evasion starts there.
    #[inline]
    fn next(&self, table: &PathTable, path: u32, node: NodeId) -> Option<Next> {
        let link = table.links[path as usize];
        let edge = EdgeId(self.first_edge[node.index()] + link.edge.checked_sub(1)?);
        let to = self.steps[edge.index()].to;
        Some(Next {
            edge,
            rest: table.first[to.index()] + link.rest,
            to,
        })
    }
}

/// Stands for a number of frames that is not known yet.
const UNKNOWN: u16 = u16::MAX;

/// The check of all links.
struct Check<'a> {
    table: &'a PathTable,
    restorer: &'a Restorer,
    /// The node at which each evasion starts.
    starts: Vec<NodeId>,
    /// Number of frames of each path.
    frames: Vec<AtomicU16>,
}

impl Check<'_> {
    /// Checks all links. The error describes the first link that points outside the table, path that contains itself, or node whose paths are
    /// not sorted by length.
    ///
    /// Nodes are processed from the last to the first, because most paths continue along their clip, whose next node has the next number.
    fn run(&self) -> Result<(), String> {
        /// Number of nodes that are checked together.
        const PART: usize = 1024;
        let nodes = self.table.first.len() - 1;
        let is_wrong = AtomicBool::new(false);
        let wrong = in_parallel(0, nodes.div_ceil(PART), |part| {
            let mut open = Vec::new();
            let end = nodes - part * PART;
            let own = end.saturating_sub(PART)..end;
            let nodes = own.rev().map(|node| NodeId(node as u32));
            nodes
                .take_while(|_| !is_wrong.load(Ordering::Relaxed))
                .find_map(|node| {
                    let wrong = self.node(node, &mut open).err()?;
                    is_wrong.store(true, Ordering::Relaxed);
                    Some(wrong)
                })
        });
        match wrong.into_iter().flatten().next() {
            Some(wrong) => Err(wrong.to_owned()),
            None => Ok(()),
        }
    }

    fn node(&self, node: NodeId, open: &mut Vec<OpenPath>) -> Result<(), &'static str> {
        let [first, end] = self.table.ends(node);
        let mut longest = 0;
        for path in first..end {
            let frames = self.frames_of(path, node, open).ok_or(NOWHERE)?;
            if frames < longest {
                return Err(UNSORTED);
            }
            longest = frames;
        }
        Ok(())
    }

    /// Number of frames of a path of a node; `None` if it does not lead to an evasion.
    fn frames_of(&self, path: u32, node: NodeId, open: &mut Vec<OpenPath>) -> Option<u16> {
        open.clear();
        let (mut path, mut node) = (path, node);
        let mut frames = loop {
            match self.frames[path as usize].load(Ordering::Relaxed) {
                UNKNOWN => {}
                known => break known,
            }
            let link = self.table.links[path as usize];
            let Some(number) = link.edge.checked_sub(1) else {
                let starts_here = self.starts.get(link.rest as usize) == Some(&node);
                starts_here.then(|| self.frames[path as usize].store(0, Ordering::Relaxed))?;
                break 0;
            };
            let first = &self.restorer.first_edge[node.index()..];
            let edge = first[0]
                .checked_add(number)
                .filter(|&edge| edge < first[1])?;
            let Step { to, adds } = self.restorer.steps[edge as usize];
            let [first, end] = self.table.ends(to);
            let rest = first.checked_add(link.rest).filter(|&rest| rest < end)?;
            // Every path is longer than its rest, so a chain has at most `u16::MAX` paths. A path that contains itself exceeds this.
            if adds.frames == 0 || open.len() >= usize::from(u16::MAX) {
                return None;
            }
            open.push(OpenPath {
                path,
                frames: adds.frames,
            });
            (path, node) = (rest, to);
        };
        while let Some(longer) = open.pop() {
            frames = frames
                .checked_add(longer.frames)
                .filter(|&frames| frames < UNKNOWN)?;
            self.frames[longer.path as usize].store(frames, Ordering::Relaxed);
        }
        Some(frames)
    }
}

/// A path whose rest is not known yet.
struct OpenPath {
    path: u32,
    /// Number of frames of the path's first edge.
    frames: u16,
}
