//! What of a graph can be walked for ever.
//!
//! Source: Kovar, Gleicher & Pighin (2002), section 3.3. Differs: the largest component is the one
//! with the most motion in it, not the one with the most nodes.

use super::build::with_index;
use super::{Edge, EdgeMotion, EventId, Feet, MotionGraph, NodeId, prune};

/// The strongly connected component with the most motion in it; `None` where none has an edge.
pub(super) fn largest_component(full: &MotionGraph) -> Option<MotionGraph> {
    let ends: Vec<(u32, u32)> = full
        .edges
        .iter()
        .map(|edge| (edge.from.0, edge.to.0))
        .collect();
    let components = prune::components(full.nodes.len(), &ends);
    let of = |node: NodeId| components[node.index()];
    let inside = |edge: &&Edge| of(edge.from) == of(edge.to);
    let mut frames = vec![(0u32, 0u32); full.nodes.len()];
    for edge in full.edges.iter().filter(inside) {
        let sums = &mut frames[of(edge.from) as usize];
        let clip_frames = if edge.motion == EdgeMotion::Clip {
            edge.frames
        } else {
            0
        };
        *sums = (sums.0 + clip_frames, sums.1 + edge.frames);
    }
    let (best, _) = frames
        .iter()
        .enumerate()
        .rev()
        .max_by_key(|&(_, sums)| *sums)
        .filter(|(_, sums)| sums.1 > 0)?;
    let kept: Vec<bool> = components
        .iter()
        .map(|&component| component as usize == best)
        .collect();
    let mut new_id = vec![NodeId(u32::MAX); full.nodes.len()];
    let mut nodes = Vec::new();
    for (index, node) in full
        .nodes
        .iter()
        .enumerate()
        .filter(|&(index, _)| kept[index])
    {
        new_id[index] = NodeId(nodes.len() as u32);
        nodes.push(*node);
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
    Some(with_index(MotionGraph {
        skeleton: full.skeleton.clone(),
        frame_rate: full.frame_rate,
        clips: full.clips.clone(),
        events,
        nodes,
        edges,
        first_edge: Vec::new(),
        feet: Feet::default(),
    }))
}
