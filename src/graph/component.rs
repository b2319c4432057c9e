//! Reduces a graph to its largest strongly connected component, which can be walked without end.
//!
//! Source: Kovar, Gleicher & Pighin (2002), section 3.3.

use super::prune::{self, WeightedEdge};
use super::{Edge, EdgeMotion, EventId, Feet, MotionGraph, NodeId};

/// Returns the strongly connected component with the most motion, or `None` if no component has an
/// edge.
pub(super) fn largest_component(full: &MotionGraph) -> Option<MotionGraph> {
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
    let kept = prune::largest(full.nodes.len(), &weighted)?;
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
    let component = MotionGraph {
        skeleton: full.skeleton.clone(),
        frame_rate: full.frame_rate,
        clips: full.clips.clone(),
        events,
        nodes,
        edges,
        first_edge: Vec::new(),
        feet: Feet::default(),
        rig: super::motion_graph::KnownRig::default(),
    };
    Some(component.with_index())
}
