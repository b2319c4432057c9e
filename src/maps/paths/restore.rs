//! Rebuilds the path data that is derived on load and not stored in the file.

use super::build::steps;
use super::{Link, NodePath, PathId, PathTable};
use crate::graph::{EdgeId, MotionGraph, NodeId};
use crate::maps::{Evasion, Retimable};
use crate::math::Rigid2;

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
        let paths = Restorer {
            table: &self,
            graph,
            retimable: beside.retimable,
            evasions: beside.evasions,
            steps: steps(graph, beside.placements),
            paths: vec![None; self.links.len()],
        }
        .run()
        .ok_or_else(|| "a path leads nowhere, or to itself".to_owned())?;
        let of = |node: usize| &paths[self.first[node] as usize..self.first[node + 1] as usize];
        let sorted = (0..graph.nodes().len()).all(|node| of(node).is_sorted_by_key(|p| p.frames));
        if !sorted {
            return Err("a node's paths are not in the order of their length".to_owned());
        }
        Ok(Self { paths, ..self })
    }
}

struct Restorer<'a> {
    table: &'a PathTable,
    graph: &'a MotionGraph,
    retimable: &'a [Retimable],
    evasions: &'a [Evasion],
    steps: Vec<Rigid2>,
    paths: Vec<Option<NodePath>>,
}

/// Decoded form of a [`Link`].
enum Meaning {
    /// The evasion starts at the node.
    Start(u32),
    /// The path starts with an edge and continues with another path.
    Edge(EdgeId, PathId),
}

impl Restorer<'_> {
    /// Rebuilds all paths, or returns `None` if a link points outside the table or a path contains
    /// itself.
    fn run(mut self) -> Option<Vec<NodePath>> {
        let mut owners = Vec::with_capacity(self.paths.len());
        for (node, ends) in (0..).zip(self.table.first.windows(2)) {
            owners.extend(std::iter::repeat_n(
                NodeId(node),
                (ends[1] - ends[0]) as usize,
            ));
        }
        let mut open: Vec<u32> = Vec::new();
        for index in 0..self.paths.len() as u32 {
            open.push(index);
            while let Some(&path) = open.last() {
                if self.paths[path as usize].is_none() {
                    match self.meaning(owners[path as usize], self.table.links[path as usize])? {
                        Meaning::Start(evasion) => {
                            self.paths[path as usize] = Some(NodePath::start(evasion));
                        }
                        Meaning::Edge(edge, rest) => match self.paths[rest.0 as usize] {
                            Some(known) => {
                                self.paths[path as usize] = self.extended(edge, rest, &known);
                                self.paths[path as usize]?;
                            }
                            // Every path is longer than its rest, so a chain has at most `u16::MAX`
                            // paths. A path that contains itself exceeds this.
                            None if open.len() > usize::from(u16::MAX) => return None,
                            None => {
                                open.push(rest.0);
                                continue;
                            }
                        },
                    }
                }
                open.pop();
            }
        }
        self.paths.into_iter().collect()
    }

    fn meaning(&self, node: NodeId, link: Link) -> Option<Meaning> {
        let Some(number) = link.edge.checked_sub(1) else {
            let evasion = self.evasions.get(link.rest as usize)?;
            let starts_here = self.graph.edge(evasion.edge).from == node;
            return starts_here.then_some(Meaning::Start(link.rest));
        };
        let edge = self.graph.edges_from(node).nth(number as usize)?;
        let to = self.graph.edge(edge).to.index();
        let rest = self.table.first[to].checked_add(link.rest)?;
        (rest < self.table.first[to + 1]).then_some(Meaning::Edge(edge, PathId(rest)))
    }

    fn extended(&self, edge: EdgeId, rest: PathId, known: &NodePath) -> Option<NodePath> {
        let frames = u16::try_from(self.graph.edge(edge).frames).ok()?;
        known.after(
            (edge, rest),
            (frames, self.retimable[edge.index()]),
            self.steps[edge.index()],
        )
    }
}
