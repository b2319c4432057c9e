//! Tests of `sabaki::maps`.

use sabaki::graph::{EdgeId, Motion, MotionStep, NodeId, Playhead};
use sabaki::maps::BakedGraph;

mod grid;
mod paths;
mod regions;
mod slices;
mod strikes;

/// Every `step`th node.
fn nodes(baked: &BakedGraph, step: usize) -> impl Iterator<Item = NodeId> {
    let nodes = 0..baked.graph().nodes().len() as u32;
    nodes.step_by(step).map(NodeId)
}

/// The motion from a node along edges, in the character's frame at the node.
fn play(baked: &BakedGraph, node: NodeId, edges: &[EdgeId]) -> Motion {
    let first = Playhead {
        edge: edges[0],
        frame: 0.0,
        clip_to_world: baked.placement(node).inverse(),
    };
    let steps = edges[1..]
        .iter()
        .map(|&edge| MotionStep { edge, rate: 1.0 });
    Motion::new(baked.graph(), first, &steps.collect::<Vec<_>>())
}
