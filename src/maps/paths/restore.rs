//! Rebuilds the path data that is derived on load and not stored in the file.

use super::build::step;
use super::{EdgeStep, NodePath, PathId, PathTable};
use crate::graph::{EdgeId, MotionGraph, NodeId};
use crate::maps::{Evasion, Retimable};
use crate::math::{Rigid2, fill};

/// What paths depend on beside their graph.
#[derive(Clone, Copy)]
pub(in crate::maps) struct PathsBeside<'a> {
    pub(in crate::maps) retimable: &'a [Retimable],
    pub(in crate::maps) evasions: &'a [Evasion],
    /// Character's frame at each node, in the space of the node's clip.
    pub(in crate::maps) placements: &'a [Rigid2],
}

impl PathTable {
    /// Rebuilds the paths of a table from a file and checks them against the graph.
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
        let paths = Restorer::new(&self, graph, beside).run()?;
        Ok(Self { paths, ..self })
    }
}

struct Restorer<'a> {
    table: &'a PathTable,
    evasions: &'a [Evasion],
    graph: &'a MotionGraph,
    steps: Vec<Step>,
    paths: Vec<NodePath>,
    /// Paths that wait for the rest of the last one, and the nodes from which they start.
    open: Vec<(u32, NodeId)>,
}

/// What an edge leads to.
#[derive(Clone, Copy)]
struct Step {
    to: NodeId,
    /// What it adds to paths. It has 0 frames if it is too long for a path.
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

/// A path that is not known yet. No evasion has this index.
const UNKNOWN: NodePath = NodePath {
    next: None,
    evasion: u32::MAX,
    frames: 0,
    faster: 0,
    slower: 0,
    placement: Rigid2::IDENTITY,
};

/// What is known of a path after one more look at it.
enum Found {
    Path(NodePath),
    /// The path goes on with another one, from this node on, which has to be found first.
    Rest(u32, NodeId),
}

const NOWHERE: &str = "a path leads nowhere, or to itself";

impl<'a> Restorer<'a> {
    fn new(table: &'a PathTable, graph: &'a MotionGraph, beside: PathsBeside<'a>) -> Self {
        let mut steps = vec![NO_STEP; graph.edges().len()];
        fill(&mut steps, |edge| {
            let id = EdgeId(edge as u32);
            let edge = graph.edge(id);
            Step {
                to: edge.to,
                adds: EdgeStep {
                    frames: u16::try_from(edge.frames).unwrap_or(0),
                    retimable: beside.retimable[id.index()],
                    placement: step(graph, beside.placements, id),
                },
            }
        });
        Self {
            table,
            evasions: beside.evasions,
            graph,
            steps,
            paths: vec![UNKNOWN; table.links.len()],
            open: Vec::new(),
        }
    }

    /// Rebuilds all paths, or says what is wrong: a link that points outside the table, a path that contains itself, or a node
    /// whose paths are not in the order of their length.
    ///
    /// Nodes are taken from the last to the first: most paths go on along their clip, and the next node of a clip is the next in
    /// number.
    fn run(mut self) -> Result<Vec<NodePath>, String> {
        for node in (0..self.graph.nodes().len() as u32).rev().map(NodeId) {
            let [first, end] = self.ends(node);
            for index in first..end {
                if self.paths[index as usize].evasion == UNKNOWN.evasion {
                    self.find(index, node).ok_or(NOWHERE)?;
                }
            }
            if !self.paths[first as usize..end as usize].is_sorted_by_key(|path| path.frames) {
                return Err("a node's paths are not in the order of their length".to_owned());
            }
        }
        Ok(self.paths)
    }

    /// First path of a node, and the end of its paths.
    fn ends(&self, node: NodeId) -> [u32; 2] {
        let first = &self.table.first[node.index()..];
        [first[0], first[1]]
    }

    /// Finds a path of a node, and the paths that it goes on with.
    fn find(&mut self, index: u32, node: NodeId) -> Option<()> {
        self.open.push((index, node));
        while let Some(&(path, node)) = self.open.last() {
            match self.look(path, node)? {
                Found::Path(found) => {
                    self.paths[path as usize] = found;
                    self.open.pop();
                }
                // Every path is longer than its rest, so a chain has at most `u16::MAX` paths. A path that contains itself exceeds this.
                Found::Rest(..) if self.open.len() > usize::from(u16::MAX) => return None,
                Found::Rest(rest, to) => self.open.push((rest, to)),
            }
        }
        Some(())
    }

    #[inline]
    fn look(&self, path: u32, node: NodeId) -> Option<Found> {
        let link = self.table.links[path as usize];
        let Some(number) = link.edge.checked_sub(1) else {
            let evasion = self.evasions.get(link.rest as usize)?;
            let starts_here = self.graph.edge(evasion.edge).from == node;
            return starts_here.then_some(Found::Path(NodePath::start(link.rest)));
        };
        let edge = self.graph.edge_from(node, number)?;
        let step = &self.steps[edge.index()];
        let [first, end] = self.ends(step.to);
        let rest = first.checked_add(link.rest).filter(|&rest| rest < end)?;
        let known = &self.paths[rest as usize];
        if known.evasion == UNKNOWN.evasion {
            return Some(Found::Rest(rest, step.to));
        }
        if step.adds.frames == 0 {
            return None;
        }
        let path = known.after(edge, PathId(rest), step.adds)?;
        Some(Found::Path(path))
    }
}
