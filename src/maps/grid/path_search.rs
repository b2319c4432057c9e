//! Finds the paths of all nodes to evasions (or other goals), backwards from the goals.
//!
//! A path of n frames from a node is an edge of m frames followed by a path of n - m frames from
//! the edge's end. If paths are built in the order of n, the shorter paths already exist. Each
//! length n needs one pass over the edges, regardless of the number of routes.

use super::paths::{Link, PathReport, PathSettings, PathTable, alike_cell, edge_placement};
use super::retime::Retimable;
use crate::graph::motion_graph::starts;
use crate::graph::{EdgeId, EdgeMotion, MotionGraph, NodeId};
use crate::math::{Rigid2, in_parallel};

/// A candidate path, whose number of frames is that of its layer.
#[derive(Clone, Copy)]
struct Draft {
    link: Link,
    goal: u32,
    /// Number of frames that may be played faster, and number of frames that may be played slower.
    faster: u16,
    slower: u16,
    placement: Rigid2,
    /// Sum of the transitions' costs. Lower is better.
    cost: f32,
}

/// All paths with the same number of frames.
struct Layer {
    /// Paths of [`BATCH`] nodes each.
    batches: Vec<LayerBatch>,
}

/// Number of nodes of a batch. A thread finds its paths.
const BATCH: usize = 256;

/// Paths of one length of some nodes, with the statistics of [`PathReport`].
#[derive(Default)]
struct LayerBatch {
    drafts: Vec<Draft>,
    /// Range of each node's paths. The last entry is the end.
    nodes: Vec<NodeDrafts>,
    alike: u64,
    cut: u64,
}

/// The paths of a node in a layer.
#[derive(Clone, Copy, Default)]
struct NodeDrafts {
    /// Index of the node's first path in [`LayerBatch::drafts`].
    first: u32,
    /// Number of shorter paths of the node.
    shorter: u32,
}

#[derive(Default)]
struct Scratch {
    found: Vec<Draft>,
    keyed: Vec<([i32; 6], Draft)>,
    ranked: Vec<(u32, Draft)>,
}

/// Finds the paths from every node of a graph to the edges `goals`. [`NodePath::goal`](super::paths::NodePath::goal) is an index into them.
/// `placements` holds the character's frame at each node, in the space of the node's clip.
pub(in crate::maps) fn find_paths(
    graph: &MotionGraph,
    retimable: &[Retimable],
    placements: &[Rigid2],
    goals: &[EdgeId],
    settings: &PathSettings,
) -> PathTable {
    let search = PathSearch::new(graph, retimable, placements, goals, settings);
    let nodes = graph.nodes().len();
    let (mut layers, mut report) = (Vec::<Layer>::new(), PathReport::default());
    for _ in 0..=search.longest {
        let batches = in_parallel(settings.threads, nodes.div_ceil(BATCH), |batch| {
            let (mut scratch, mut found) = (Scratch::default(), LayerBatch::default());
            let end = ((batch + 1) * BATCH).min(nodes);
            for node in batch * BATCH..end {
                found.nodes.push(NodeDrafts {
                    first: found.drafts.len() as u32,
                    shorter: layers.last().map_or(0, |before| before.up_to(node)),
                });
                search.find(&layers, NodeId(node as u32), &mut scratch);
                search.select(&mut scratch, &mut found);
            }
            found.nodes.push(NodeDrafts {
                first: found.drafts.len() as u32,
                shorter: 0,
            });
            found
        });
        for found in &batches {
            report.alike += found.alike;
            report.cut += found.cut;
            report.kept += found.drafts.len() as u64;
        }
        layers.push(Layer { batches });
    }
    let count = |node: usize| layers.last().map_or(0, |last| last.up_to(node));
    let first = starts((0..nodes).map(count));
    let links = in_parallel(settings.threads, nodes.div_ceil(BATCH), |batch| {
        let end = ((batch + 1) * BATCH).min(nodes);
        let count = first[end] - first[batch * BATCH];
        let mut links = Vec::with_capacity(count as usize);
        for node in (batch * BATCH..end).map(|node| NodeId(node as u32)) {
            for layer in &layers {
                links.extend(layer.drafts(node).map(|(_, draft)| draft.link));
            }
        }
        links
    });
    PathTable::new(
        first,
        links.concat().into_iter().collect(),
        report,
        graph,
        retimable,
        placements,
    )
}

impl Layer {
    /// Number of paths of a node that are no longer than those of this layer.
    fn up_to(&self, node: usize) -> u32 {
        let (_, [own, next]) = self.place(node);
        own.shorter + next.first - own.first
    }

    /// The paths of a node, each with its index among all paths of the node.
    fn drafts(&self, node: NodeId) -> impl Iterator<Item = (u32, &Draft)> {
        let (batch, [own, next]) = self.place(node.index());
        let drafts = &batch.drafts[own.first as usize..next.first as usize];
        (own.shorter..).zip(drafts)
    }

    /// The batch of a node, and the ranges of the node and the next one in it.
    fn place(&self, node: usize) -> (&LayerBatch, [NodeDrafts; 2]) {
        let (batch, own) = (&self.batches[node / BATCH], node % BATCH);
        (batch, [batch.nodes[own], batch.nodes[own + 1]])
    }
}

/// Data that all layers share.
struct PathSearch<'a> {
    graph: &'a MotionGraph,
    retimable: &'a [Retimable],
    settings: &'a PathSettings,
    /// Horizon, in frames.
    longest: usize,
    /// Maximum number of paths of a node in a layer.
    most: usize,
    /// For each edge, the character's frame at its end, relative to that at its start.
    steps: Vec<Rigid2>,
    /// For each node, the goals that start there.
    starts: Vec<Vec<u16>>,
}

impl<'a> PathSearch<'a> {
    fn new(
        graph: &'a MotionGraph,
        retimable: &'a [Retimable],
        placements: &[Rigid2],
        goals: &[EdgeId],
        settings: &'a PathSettings,
    ) -> Self {
        let longest = (settings.horizon * graph.frame_rate() as f32)
            .round()
            .clamp(0.0, f32::from(u16::MAX - 1)) as usize;
        let mut starts = vec![Vec::new(); graph.nodes().len()];
        for (&goal, index) in goals.iter().zip(0..=u16::MAX) {
            starts[graph.edge(goal).from.index()].push(index);
        }
        let step = |edge| edge_placement(graph, placements, edge);
        Self {
            graph,
            retimable,
            settings,
            longest,
            most: (settings.most as usize)
                .min(PathSettings::MOST_OF_ALL / graph.nodes().len().max(1))
                .min(PathSettings::MOST_OF_A_NODE)
                .div_euclid(longest + 1)
                .max(1),
            steps: graph.edge_ids().map(step).collect(),
            starts,
        }
    }

    /// Finds the paths from a node with one frame more than the longest known layer.
    fn find(&self, layers: &[Layer], node: NodeId, scratch: &mut Scratch) {
        let frames = layers.len();
        let found = &mut scratch.found;
        found.clear();
        let starts = self.starts[node.index()].iter().filter(|_| frames == 0);
        found.extend(starts.map(|&goal| Draft {
            link: Link {
                edge: 0,
                rest: goal,
            },
            goal: goal.into(),
            faster: 0,
            slower: 0,
            placement: Rigid2::IDENTITY,
            cost: 0.0,
        }));
        let numbers = 1..=PathSettings::MOST_OF_A_NODE as u16;
        for (id, number) in self.graph.edges_from(node).zip(numbers) {
            let edge = self.graph.edge(id);
            let left = frames.checked_sub(edge.frames as usize);
            let Some(layer) = left.and_then(|left| layers.get(left)) else {
                continue;
            };
            found.extend(layer.drafts(edge.to).map(|(rest, draft)| {
                let (edge, rest) = (number, rest as u16);
                let link = Link { edge, rest };
                self.extended(id, link, draft)
            }));
        }
    }

    /// Path that starts with an edge and continues with `rest`.
    fn extended(&self, id: EdgeId, link: Link, rest: &Draft) -> Draft {
        let edge = self.graph.edge(id);
        let retimable = self.retimable[id.index()];
        // The edge is no longer than the longest path, so the cast is exact.
        let frames = |changes: bool| if changes { edge.frames as u16 } else { 0 };
        let looks = match edge.motion {
            EdgeMotion::Clip => 0.0,
            EdgeMotion::Transition { distance, .. } => TRANSITION_COST + distance,
        };
        Draft {
            link,
            goal: rest.goal,
            faster: rest.faster + frames(retimable.faster),
            slower: rest.slower + frames(retimable.slower),
            placement: self.steps[id.index()] * rest.placement,
            cost: rest.cost + looks,
        }
    }

    /// Selects the paths to keep: the best one of each group of similar paths, limited to `most` in
    /// turns: first the best of each goal, then the second best of each, and so on.
    fn select(&self, scratch: &mut Scratch, batch: &mut LayerBatch) {
        let Scratch {
            found,
            keyed,
            ranked,
        } = scratch;
        let all = found.len();
        if all > 1 {
            keyed.clear();
            keyed.extend(found.iter().map(|draft| (self.key(draft), *draft)));
            // No two paths are equally good, so an unstable sort is deterministic.
            keyed.sort_unstable_by(|a, b| a.0.cmp(&b.0).then_with(|| better(&a.1, &b.1)));
            keyed.dedup_by_key(|(key, _)| *key);
            batch.alike += (all - keyed.len()) as u64;
            found.clear();
            found.extend(keyed.iter().map(|(_, draft)| *draft));
        }
        if found.len() > self.most {
            found.sort_unstable_by(|a, b| {
                let goals = a.goal.cmp(&b.goal);
                goals.then_with(|| better(a, b))
            });
            ranked.clear();
            for draft in found.iter() {
                let rank = match ranked.last() {
                    Some((rank, last)) if last.goal == draft.goal => rank + 1,
                    _ => 0,
                };
                ranked.push((rank, *draft));
            }
            ranked.sort_unstable_by(|a, b| a.0.cmp(&b.0).then_with(|| better(&a.1, &b.1)));
            batch.cut += (ranked.len() - self.most) as u64;
            ranked.truncate(self.most);
            found.clear();
            found.extend(ranked.iter().map(|(_, draft)| *draft));
        }
        batch.drafts.extend_from_slice(found);
    }

    /// Key that is equal for similar paths of one length.
    fn key(&self, path: &Draft) -> [i32; 6] {
        // Paths count as different if their retimable durations differ by a fifth of a second, or
        // if only one of them can be retimed.
        let fifth = ((self.graph.frame_rate() / 5.0) as u16).max(1);
        let share = |frames: u16| match frames {
            0 => -1,
            some => i32::from(some / fifth),
        };
        let settings = self.settings;
        let [x, z, heading] = alike_cell(
            path.placement,
            settings.alike_distance,
            settings.alike_angle,
        );
        let goal = path.goal as i32;
        [goal, x, z, heading, share(path.faster), share(path.slower)]
    }
}

/// Orders two paths by quality. The order is the same on every machine.
fn better(a: &Draft, b: &Draft) -> std::cmp::Ordering {
    let place = |draft: &Draft| (draft.link.edge, draft.link.rest);
    a.cost
        .total_cmp(&b.cost)
        .then_with(|| place(a).cmp(&place(b)))
}

/// Fixed cost of each transition in addition to its distance, in metres. It favours paths with
/// fewer transitions.
const TRANSITION_COST: f32 = 0.02;
