//! Finds the paths of all nodes to evasions (or other goals), backwards from the goals.
//!
//! A path of n frames from a node is an edge of m frames followed by a path of n - m frames from
//! the edge's end. If paths are built in the order of n, the shorter paths already exist. Each
//! length n needs one pass over the edges, regardless of the number of routes.

use super::{EdgeStep, Link, NodeOfPath, NodePath, PathId, PathReport, PathSettings, PathTable};
use crate::graph::{EdgeId, EdgeMotion, MotionGraph, NodeId};
use crate::maps::{OnFirstUse, Retimable};
use crate::math::{Rigid2, in_parallel};

/// Input of the path search.
#[derive(Clone, Copy)]
pub(in crate::maps) struct PathSource<'a> {
    pub graph: &'a MotionGraph,
    pub retimable: &'a [Retimable],
    /// Character's frame at each node, in the space of the node's clip.
    pub placements: &'a [Rigid2],
    /// Edges that paths lead to. [`NodePath::evasion`] is an index into this list.
    pub goals: &'a [EdgeId],
}

/// A candidate path.
#[derive(Clone, Copy)]
struct Draft {
    link: Link,
    path: NodePath,
    /// Sum of the transitions' costs. Lower is better.
    cost: f32,
}

/// Paths of one node that were found so far.
#[derive(Clone, Default)]
struct Drafts {
    all: Vec<Draft>,
    /// Index in `all` of the first path of each number of frames.
    by_frames: Vec<u32>,
}

/// Number of nodes that share scratch.
const BATCH: usize = 256;

/// Paths of one length of some nodes, and the statistics of [`PathReport`].
#[derive(Default)]
struct LayerPaths {
    kept: Vec<Draft>,
    /// End of each node's paths in `kept`.
    ends: Vec<usize>,
    alike: u64,
    cut: u64,
}

/// Memory of the selection of paths.
#[derive(Default)]
struct Scratch {
    found: Vec<Draft>,
    keyed: Vec<([i32; 6], Draft)>,
    ranked: Vec<(u32, Draft)>,
}

/// Finds the paths from every node of a graph.
pub(in crate::maps) fn build(source: PathSource<'_>, settings: &PathSettings) -> PathTable {
    let layers = Layers::new(source, settings);
    let mut nodes = vec![Drafts::default(); source.graph.nodes().len()];
    let mut report = PathReport::default();
    for _ in 0..=layers.longest {
        let found = in_parallel(settings.threads, nodes.len().div_ceil(BATCH), |batch| {
            let (mut scratch, mut found) = (Scratch::default(), LayerPaths::default());
            let end = ((batch + 1) * BATCH).min(nodes.len());
            for node in batch * BATCH..end {
                layers.find(&nodes, NodeId(node as u32), &mut scratch);
                layers.select(&mut scratch, &mut found);
            }
            found
        });
        for (nodes, found) in nodes.chunks_mut(BATCH).zip(&found) {
            let mut first = 0;
            for (drafts, &end) in nodes.iter_mut().zip(&found.ends) {
                drafts.by_frames.push(drafts.all.len() as u32);
                drafts.all.extend_from_slice(&found.kept[first..end]);
                first = end;
            }
            report.alike += found.alike;
            report.cut += found.cut;
        }
    }
    report.kept = nodes.iter().map(|drafts| drafts.all.len() as u64).sum();
    table(source.graph, &nodes, report)
}

fn table(graph: &MotionGraph, nodes: &[Drafts], report: PathReport) -> PathTable {
    let mut table = PathTable {
        report,
        first: vec![0],
        ..PathTable::default()
    };
    for drafts in nodes {
        let end = table.first[table.first.len() - 1] + drafts.all.len() as u32;
        table.first.push(end);
    }
    for drafts in nodes {
        let paths = drafts.all.iter().map(|draft| {
            let of_target = |edge: EdgeId| table.first[graph.edge(edge).to.index()];
            let next = draft.path.next;
            NodePath {
                next: next.map(|(edge, rest)| (edge, PathId(of_target(edge) + rest.0))),
                ..draft.path
            }
        });
        table.paths.push(OnFirstUse::known(paths.collect()));
        table
            .links
            .extend(drafts.all.iter().map(|draft| draft.link));
    }
    table.nodes = NodeOfPath::new(&table.first);
    table
}

/// Data that all layers share.
struct Layers<'a> {
    source: PathSource<'a>,
    settings: &'a PathSettings,
    /// Horizon, in frames.
    longest: usize,
    /// Maximum number of paths of a node in a layer.
    most: usize,
    /// For each edge, the character's frame at its end, relative to that at its start.
    steps: Vec<Rigid2>,
    /// For each node, the goals that start there.
    starts: Vec<Vec<u32>>,
}

impl<'a> Layers<'a> {
    fn new(source: PathSource<'a>, settings: &'a PathSettings) -> Self {
        let graph = source.graph;
        let longest = (settings.horizon * graph.frame_rate() as f32)
            .round()
            .clamp(0.0, f32::from(u16::MAX - 1)) as usize;
        let mut starts = vec![Vec::new(); graph.nodes().len()];
        for (&goal, index) in source.goals.iter().zip(0..) {
            starts[graph.edge(goal).from.index()].push(index);
        }
        Self {
            source,
            settings,
            longest,
            most: (settings.most as usize)
                .min(PathSettings::MOST_OF_ALL / graph.nodes().len().max(1))
                .div_euclid(longest + 1)
                .max(1),
            steps: { graph.edge_ids() }
                .map(|edge| step(graph, source.placements, edge))
                .collect(),
            starts,
        }
    }

    /// Finds the next longer paths from a node: those of one frame more than the longest that were found so far.
    fn find(&self, nodes: &[Drafts], node: NodeId, scratch: &mut Scratch) {
        let frames = nodes[node.index()].by_frames.len();
        let found = &mut scratch.found;
        found.clear();
        let starts = self.starts[node.index()].iter().filter(|_| frames == 0);
        found.extend(starts.map(|&evasion| Draft {
            link: Link {
                edge: 0,
                rest: evasion,
            },
            path: NodePath::start(evasion),
            cost: 0.0,
        }));
        let graph = self.source.graph;
        for (edge, number) in graph.edges_from(node).zip(1..) {
            let Some(left) = frames.checked_sub(graph.edge(edge).frames as usize) else {
                continue;
            };
            let rest = &nodes[graph.edge(edge).to.index()];
            let first = rest.by_frames[left] as usize;
            let end = rest
                .by_frames
                .get(left + 1)
                .map_or(rest.all.len(), |&end| end as usize);
            found.extend((first..end).filter_map(|position| {
                let link = Link {
                    edge: number,
                    rest: position as u32,
                };
                self.extended(edge, link, &rest.all[position])
            }));
        }
    }

    /// Path that starts with `edge` and continues with `rest`.
    fn extended(&self, edge: EdgeId, link: Link, rest: &Draft) -> Option<Draft> {
        let graph = self.source.graph;
        let frames = u16::try_from(graph.edge(edge).frames).ok()?;
        let step = EdgeStep {
            frames,
            retimable: self.source.retimable[edge.index()],
            placement: self.steps[edge.index()],
        };
        let looks = match graph.edge(edge).motion {
            EdgeMotion::Clip => 0.0,
            EdgeMotion::Transition { distance, .. } => TRANSITION_COST + distance,
        };
        Some(Draft {
            link,
            // The final index of `rest` is not known yet. The index among its node's paths stands
            // in for it.
            path: rest.path.after(edge, PathId(link.rest), step)?,
            cost: rest.cost + looks,
        })
    }

    /// Selects the paths to keep: the best one of each group of similar paths, limited to `most` in
    /// turns: first the best of each evasion, then the second best of each, and so on.
    fn select(&self, scratch: &mut Scratch, layer: &mut LayerPaths) {
        let Scratch {
            found,
            keyed,
            ranked,
        } = scratch;
        let all = found.len();
        if all > 1 {
            keyed.clear();
            keyed.extend(found.iter().map(|draft| (self.key(&draft.path), *draft)));
            // No two paths are equally good, so that their order is known.
            keyed.sort_unstable_by(|a, b| a.0.cmp(&b.0).then_with(|| better(&a.1, &b.1)));
            keyed.dedup_by_key(|(key, _)| *key);
            layer.alike += (all - keyed.len()) as u64;
            found.clear();
            found.extend(keyed.iter().map(|(_, draft)| *draft));
        }
        if found.len() > self.most {
            found.sort_unstable_by(|a, b| {
                let evasions = a.path.evasion.cmp(&b.path.evasion);
                evasions.then_with(|| better(a, b))
            });
            ranked.clear();
            for draft in found.iter() {
                let rank = match ranked.last() {
                    Some((rank, last)) if last.path.evasion == draft.path.evasion => rank + 1,
                    _ => 0,
                };
                ranked.push((rank, *draft));
            }
            ranked.sort_unstable_by(|a, b| a.0.cmp(&b.0).then_with(|| better(&a.1, &b.1)));
            layer.cut += (ranked.len() - self.most) as u64;
            ranked.truncate(self.most);
            found.clear();
            found.extend(ranked.iter().map(|(_, draft)| *draft));
        }
        layer.kept.extend_from_slice(found);
        layer.ends.push(layer.kept.len());
    }

    /// Key that is equal for similar paths of one length.
    fn key(&self, path: &NodePath) -> [i32; 6] {
        // Paths count as different if their retimable durations differ by a fifth of a second, or
        // if only one of them can be retimed.
        let fifth = ((self.source.graph.frame_rate() / 5.0) as u16).max(1);
        let share = |frames: u16| match frames {
            0 => -1,
            some => i32::from(some / fifth),
        };
        let [x, z, heading] =
            path.alike_cell(self.settings.alike_distance, self.settings.alike_angle);
        let evasion = path.evasion as i32;
        [
            evasion,
            x,
            z,
            heading,
            share(path.faster),
            share(path.slower),
        ]
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

/// The character's frame at an edge's end, relative to that at its start.
pub(super) fn step(graph: &MotionGraph, placements: &[Rigid2], id: EdgeId) -> Rigid2 {
    let edge = graph.edge(id);
    let (from, to) = (placements[edge.from.index()], placements[edge.to.index()]);
    from.inverse() * graph.clip_change(id) * to
}
