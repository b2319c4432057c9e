//! Reduces a graph to its largest strongly connected component, which can be walked without end.
//!
//! Source: Kovar, Gleicher & Pighin (2002), section 3.3.

use crate::graph::motion_graph::{Edge, EdgeMotion, EventId, Grouped, MotionGraph, NodeId};

/// Returns the strongly connected component with the most motion, or `None` if no component has an
/// edge.
pub(crate) fn largest_component(full: &MotionGraph) -> Option<MotionGraph> {
    let weighted_edge = |edge: &Edge| WeightedEdge {
        from: edge.from.0,
        to: edge.to.0,
        clip_frames: match edge.motion {
            EdgeMotion::Clip => edge.frames,
            EdgeMotion::Transition { .. } => 0,
        },
        frames: edge.frames,
    };
    let weighted: Vec<WeightedEdge> = full.edges.iter().map(weighted_edge).collect();
    let kept = largest(full.nodes.len(), &weighted)?;
    let mut new_id = vec![NodeId(u32::MAX); full.nodes.len()];
    let mut nodes = Vec::new();
    for (index, node) in full.nodes.iter().enumerate() {
        if kept[index] {
            new_id[index] = NodeId(nodes.len() as u32);
            nodes.push(*node);
        }
    }
    let mut events = Vec::new();
    let edges = full
        .edges
        .iter()
        .filter(|edge| kept[edge.from.index()] && kept[edge.to.index()])
        .map(|edge| {
            let event = edge.event.map(|event| {
                events.push(full.events[event.index()].clone());
                EventId(events.len() as u32 - 1)
            });
            Edge {
                from: new_id[edge.from.index()],
                to: new_id[edge.to.index()],
                event,
                ..edge.clone()
            }
        })
        .collect();
    let (skeleton, clips) = (full.skeleton.clone(), full.clips.clone());
    let mut kept = MotionGraph::new(skeleton, full.frame_rate, clips, events, nodes, edges);
    kept.leads.clone_from(&full.leads);
    Some(kept)
}

// Finds the largest strongly connected component of a graph.
//
// Source: Kovar, Gleicher & Pighin (2002), section 3.3. Components are found by two depth-first searches (Sharir, "A strong-connectivity
// algorithm and its applications in data flow analysis", 1981), without recursion. Differs: the largest component is the one with the most
// motion, not the one with the most nodes.

#[derive(Clone, Copy, Debug)]
pub(crate) struct WeightedEdge {
    pub(crate) from: u32,
    pub(crate) to: u32,
    /// Number of clip frames that the edge plays, 0 for a blend.
    pub(crate) clip_frames: u32,
    pub(crate) frames: u32,
}

/// For each of `nodes` nodes, whether it belongs to the strongly connected component with the most
/// clip frames. Ties are decided by the number of frames, then by the first node. Returns `None` if
/// the graph has no cycle.
pub(crate) fn largest(nodes: usize, weighted: &[WeightedEdge]) -> Option<Vec<bool>> {
    let ends: Vec<(u32, u32)> = weighted.iter().map(|edge| (edge.from, edge.to)).collect();
    let components = components(nodes, &ends);
    let mut frames = vec![(0u64, 0u64); nodes];
    for edge in weighted {
        let component = components[edge.from as usize];
        if component == components[edge.to as usize] {
            let sums = &mut frames[component as usize];
            *sums = (
                sums.0 + u64::from(edge.clip_frames),
                sums.1 + u64::from(edge.frames),
            );
        }
    }
    // In reverse order, so that a tie selects the component of the first node.
    let best = components
        .iter()
        .rev()
        .max_by_key(|&&component| frames[component as usize])?;
    (frames[*best as usize].1 > 0).then(|| components.iter().map(|c| c == best).collect())
}

/// For each node, a node of its strongly connected component, the same for all nodes of the component.
///
/// `edges` are pairs of nodes, and `nodes` is the number of nodes.
pub(crate) fn components(nodes: usize, edges: &[(u32, u32)]) -> Vec<u32> {
    let ends = edges.iter().map(|&(from, to)| (from as usize, to));
    let targets = Grouped::new(nodes, ends);
    let (mut seen, mut left) = (vec![false; nodes], Vec::with_capacity(nodes));
    for root in 0..nodes as u32 {
        leave_all(&targets, root, &mut seen, |node| left.push(node));
    }
    // Against the edges, from the node that was left last on, a search finds the nodes of one component alone.
    let ends = edges.iter().map(|&(from, to)| (to as usize, from));
    let sources = Grouped::new(nodes, ends);
    seen.fill(false);
    let mut components = vec![0; nodes];
    for root in left.into_iter().rev() {
        leave_all(&sources, root, &mut seen, |node| {
            components[node as usize] = root;
        });
    }
    components
}

/// Calls `leave` with each node that is reached from a root and was not seen before, after the nodes that it leads to.
fn leave_all(next: &Grouped, root: u32, seen: &mut [bool], mut leave: impl FnMut(u32)) {
    let mut is_new = |node: u32| !std::mem::replace(&mut seen[node as usize], true);
    if !is_new(root) {
        return;
    }
    // Each node with those of its next nodes that are left.
    let mut path = vec![(root, next.group(root as usize).iter())];
    while let Some((node, to)) = path.last_mut() {
        match to.find(|&&to| is_new(to)) {
            Some(&to) => path.push((to, next.group(to as usize).iter())),
            None => {
                leave(*node);
                path.pop();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Naive search: returns for each node whether it is reached by following edges.
    fn reached(nodes: usize, edges: &[(u32, u32)], from: u32) -> Vec<bool> {
        let mut seen = vec![false; nodes];
        let mut open = vec![from];
        while let Some(node) = open.pop() {
            if !std::mem::replace(&mut seen[node as usize], true) {
                open.extend(
                    edges
                        .iter()
                        .filter(|edge| edge.0 == node)
                        .map(|edge| edge.1),
                );
            }
        }
        seen
    }

    proptest! {
        #[test]
        fn same_component_means_there_and_back(edges in prop::collection::vec((0..12u32, 0..12u32), 0..40)) {
            let components = components(12, &edges);
            let reached: Vec<Vec<bool>> = (0..12).map(|from| reached(12, &edges, from)).collect();
            for a in 0..12 {
                for b in 0..12 {
                    let both_ways = reached[a][b] && reached[b][a];
                    prop_assert_eq!(components[a] == components[b], both_ways);
                }
            }
        }
    }
}
